//! The stencil passes that make maps, as data: which instances, under which rule.
//!
//! Source: Masaoka & Oshita, section 4.3: frame i is drawn with EQUAL i and INCR, so that only texels that every earlier frame
//! covered count up, and two discs of one frame count once. Here counting starts at 1, which leaves 0 for texels
//! that have dropped out, and before a stencil value runs out the count starts again at 1.
//! CPU twin: `every_frame` and `any_frame` in src/maps/raster.rs.

use std::ops::Range;

use ash::vk::{CompareOp, StencilOp};

use super::batch::Batch;
use crate::{
    gpu::{pipelines::StencilRule, shader_table::PlacedDisc},
    maps::Drawing,
};

/// The highest count of 8 bits.
const HIGHEST: u32 = 255;
/// What counting starts from, and what the target is cleared to.
pub(crate) const START: u32 = 1;
/// Frames that one run of the count holds.
pub(crate) const FRAMES_BETWEEN_RESTARTS: usize = (HIGHEST - START) as usize;
/// After [`every_frame`]: texels of the evasion map. Above it: of the body map.
pub(crate) const EVASION: u8 = 1;

/// One draw.
#[derive(Clone, Debug)]
pub(crate) struct Pass {
    /// Whole maps instead of discs.
    pub(crate) whole_maps: bool,
    pub(crate) rule: StencilRule,
    pub(crate) instances: Range<u32>,
}

/// The draws of a batch, and their instances.
#[derive(Debug, Default)]
pub(crate) struct Passes {
    pub(crate) passes: Vec<Pass>,
    pub(crate) instances: Vec<PlacedDisc>,
}

/// Texels end as 0, [`EVASION`] or more (body).
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

/// Texels end as [`START`] where nothing was drawn, 2 where anything was.
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

    /// A pass over the instances that no pass has yet.
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

    /// The last pass's instances again, under another rule.
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

/// Writes a value wherever a disc covers.
pub(crate) const fn draw(value: u32) -> StencilRule {
    StencilRule {
        reference: value,
        ..ALL
    }
}

/// A frame's discs count once, where all earlier frames have.
const fn count_up(count: u32) -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        pass: StencilOp::INCREMENT_AND_CLAMP,
        reference: count,
        ..ALL
    }
}

/// Texels that have dropped out become 0.
const fn keep_only(count: u32) -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        pass: StencilOp::KEEP,
        fail: StencilOp::ZERO,
        reference: count,
        ..ALL
    }
}

/// After [`keep_only`] of [`HIGHEST`], whose lowest bit is set: counting starts again.
const fn restart() -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        fail: StencilOp::ZERO,
        mask: START,
        reference: START,
        ..ALL
    }
}

/// The first frame's discs, where the body map is not: there the value is 0 (or has just become 1).
const fn mark_evasion() -> StencilRule {
    StencilRule {
        compare: CompareOp::GREATER_OR_EQUAL,
        reference: EVASION as u32,
        ..ALL
    }
}
