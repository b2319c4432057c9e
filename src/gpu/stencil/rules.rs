//! The stencil passes that draw maps, as data: instances and stencil rules.
//!
//! Source: Masaoka & Oshita, section 4.3: frame i is drawn with EQUAL i and INCR, so that only texels that every earlier frame
//! covered are incremented, and two discs of one frame count once. Differs: counting starts at 1, because 0 marks texels that a frame did
//! not cover, and before a stencil value overflows the count restarts at 1.
//! CPU twin: `every_frame` and `any_frame` in `src/maps/raster.rs`.

use std::ops::Range;

use ash::vk::{CompareOp, StencilOp};

use super::batch::Batch;
use crate::{
    gpu::{pipelines::StencilRule, shader_table::PlacedDisc},
    maps::Drawing,
};

/// Highest stencil value.
const HIGHEST: u32 = 255;
/// Initial count, to which the target is cleared.
pub(crate) const START: u32 = 1;
/// Number of frames until the count restarts.
pub(crate) const FRAMES_BETWEEN_RESTARTS: usize = (HIGHEST - START) as usize;
/// Value of texels of the evasion map after [`every_frame`]. Texels of the body map have higher values.
pub(crate) const EVASION: u8 = 1;

/// One draw.
#[derive(Clone, Debug)]
pub(crate) struct Pass {
    /// Whether the instances are whole maps instead of discs.
    pub(crate) whole_maps: bool,
    pub(crate) rule: StencilRule,
    pub(crate) instances: Range<u32>,
}

/// Draws of a batch and their instances.
#[derive(Debug, Default)]
pub(crate) struct Passes {
    pub(crate) passes: Vec<Pass>,
    pub(crate) instances: Vec<PlacedDisc>,
}

/// Computes the passes after which texels are 0, [`EVASION`], or higher (body).
pub(crate) fn every_frame(drawings: &[Drawing], batch: &Batch, out: &mut Passes) {
    out.clear();
    let longest = batch
        .members
        .iter()
        .map(|&(index, _)| drawings[index].frames())
        .max()
        .unwrap_or(0);
    let mut count = START;
    for frame in 0..longest {
        if count == HIGHEST {
            out.whole_maps(drawings, batch, |frames| frames > frame);
            out.pass_last(true, keep_only(HIGHEST));
            out.repeat(restart());
            count = START;
        }
        out.discs(drawings, batch, frame);
        out.pass_last(false, count_up(count));
        count += 1;
        out.whole_maps(drawings, batch, |frames| frames == frame + 1);
        out.pass_last(true, keep_only(count));
    }
    out.discs(drawings, batch, 0);
    out.pass_last(false, mark_evasion());
}

/// Computes the passes after which texels are [`START`], or 2 where a disc was drawn.
pub(crate) fn any_frame(drawings: &[Drawing], batch: &Batch, out: &mut Passes) {
    out.clear();
    for &(index, cell) in &batch.members {
        let drawing = &drawings[index];
        let placed = drawing
            .discs
            .iter()
            .map(|&disc| cell.place(disc, drawing.rect));
        out.instances.extend(placed);
    }
    out.pass_last(false, draw(START + 1));
}

impl Passes {
    fn clear(&mut self) {
        self.passes.clear();
        self.instances.clear();
    }

    fn discs(&mut self, drawings: &[Drawing], batch: &Batch, frame: usize) {
        for &(index, cell) in &batch.members {
            let drawing = &drawings[index];
            if frame < drawing.frames() {
                let discs = drawing.frame(frame).iter();
                self.instances
                    .extend(discs.map(|&disc| cell.place(disc, drawing.rect)));
            }
        }
    }

    fn whole_maps(&mut self, drawings: &[Drawing], batch: &Batch, wanted: impl Fn(usize) -> bool) {
        for &(index, cell) in &batch.members {
            let drawing = &drawings[index];
            if wanted(drawing.frames()) {
                self.instances.push(cell.whole(drawing.rect));
            }
        }
    }

    /// Adds a pass over the instances since the last pass.
    fn pass_last(&mut self, whole_maps: bool, rule: StencilRule) {
        let start = self.passes.last().map_or(0, |pass| pass.instances.end);
        let instances = start..self.instances.len() as u32;
        if !instances.is_empty() {
            self.passes.push(Pass {
                whole_maps,
                rule,
                instances,
            });
        }
    }

    /// Adds a pass over the instances of the last pass with another rule.
    fn repeat(&mut self, rule: StencilRule) {
        if let Some(mut pass) = self.passes.last().cloned() {
            pass.rule = rule;
            self.passes.push(pass);
        }
    }
}

const ALL: StencilRule = StencilRule {
    compare: CompareOp::ALWAYS,
    pass: StencilOp::REPLACE,
    fail: StencilOp::KEEP,
    mask: HIGHEST,
    reference: 0,
    write: HIGHEST,
};

/// Rule that writes a value where a disc covers.
pub(crate) const fn draw(value: u32) -> StencilRule {
    StencilRule {
        reference: value,
        ..ALL
    }
}

/// Rule that increments texels that all earlier frames covered.
const fn count_up(count: u32) -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        pass: StencilOp::INCREMENT_AND_CLAMP,
        reference: count,
        ..ALL
    }
}

/// Rule that sets texels to 0 that a frame did not cover.
const fn keep_only(count: u32) -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        pass: StencilOp::KEEP,
        fail: StencilOp::ZERO,
        reference: count,
        ..ALL
    }
}

/// Rule that restarts the count, after [`keep_only`] of [`HIGHEST`], whose lowest bit is set.
const fn restart() -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        fail: StencilOp::ZERO,
        mask: START,
        reference: START,
        ..ALL
    }
}

/// Rule for the first frame's discs outside the body map, where the value is 0 or has just become 1.
const fn mark_evasion() -> StencilRule {
    StencilRule {
        compare: CompareOp::GREATER_OR_EQUAL,
        reference: EVASION as u32,
        ..ALL
    }
}
