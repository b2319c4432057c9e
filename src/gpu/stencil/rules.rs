//! The stencil rules that draw body, evasion and attack maps, as data: draws and their instances.
//!
//! Source: Masaoka & Oshita, section 4.3.
//! - **Body map**, the texels that the body covers all the time: frame i is drawn with EQUAL i and INCR, so that only texels that every
//!   earlier frame covered count up, and two discs of one frame count once.
//! - **Evasion map**, the texels that the body covers at the start but not all the time: the first frame is drawn once more, where the body
//!   map is not.
//! - **Attack map**, the texels that the attack covers at any time: all discs are drawn with REPLACE.
//!
//! Differs: counting starts at 1, because 0 marks texels that a frame did not cover, and before a stencil value overflows the count
//! restarts at 1. CPU twin: `every_frame` and `any_frame` in `src/maps/regions/raster.rs`.

use ash::vk::{CompareOp, StencilOp};

use super::screen::{Draws, Place, Shape};
use crate::{gpu::pipelines::StencilRule, maps::Drawing};

/// Highest stencil value.
const HIGHEST: u32 = 255;
/// Initial count, to which the target is cleared.
pub(super) const START: u32 = 1;
/// Value of texels of the evasion map after [`body_and_evasion`]. Texels of the body map have higher values.
pub(super) const EVASION: u8 = 1;

/// Draws body and evasion maps. Texels are then 0, [`EVASION`], or higher (body).
pub(super) fn body_and_evasion(drawings: &[Drawing], members: &[(usize, Place)], out: &mut Draws) {
    out.clear();
    let members = || {
        let members = members.iter();
        members.map(|&(index, place)| (&drawings[index], place))
    };
    let longest = members().map(|(drawing, _)| drawing.frames()).max();
    let mut count = START;
    for frame in 0..longest.unwrap_or(0) {
        if count == HIGHEST {
            out.whole_maps(members().filter(|(drawing, _)| drawing.frames() > frame));
            out.draw(Shape::WholeMaps, keep_only(HIGHEST));
            out.whole_maps(members().filter(|(drawing, _)| drawing.frames() > frame));
            out.draw(Shape::WholeMaps, restart());
            count = START;
        }
        out.discs(members(), frame);
        out.draw(Shape::Discs, count_up(count));
        count += 1;
        out.whole_maps(members().filter(|(drawing, _)| drawing.frames() == frame + 1));
        out.draw(Shape::WholeMaps, keep_only(count));
    }
    out.discs(members(), 0);
    out.draw(Shape::Discs, mark_evasion());
}

/// Draws attack maps. Texels are then [`START`], or 2 where a disc was drawn.
pub(super) fn attack(drawings: &[Drawing], members: &[(usize, Place)], out: &mut Draws) {
    out.clear();
    for &(index, place) in members {
        let Drawing { discs, rect, .. } = &drawings[index];
        let placed = discs.iter().map(|&disc| place.disc(disc, *rect));
        out.instances.extend(placed);
    }
    out.draw(Shape::Discs, replace(START + 1));
}

const ALL: StencilRule = StencilRule {
    compare: CompareOp::ALWAYS,
    pass: StencilOp::REPLACE,
    fail: StencilOp::KEEP,
    mask: HIGHEST,
    reference: 0,
    write: HIGHEST,
};

/// Rule that writes a value where a disc covers: an attack map.
pub(super) const fn replace(value: u32) -> StencilRule {
    StencilRule {
        reference: value,
        ..ALL
    }
}

/// Rule that passes where the attack map has a value, and writes nothing.
pub(super) const fn over(value: u32) -> StencilRule {
    StencilRule {
        compare: CompareOp::EQUAL,
        pass: StencilOp::KEEP,
        reference: value,
        write: 0,
        ..ALL
    }
}

/// Rule that increments texels that all earlier frames covered: a body map.
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

/// Rule for the first frame's discs outside the body map, where the value is 0 or has just become 1: an evasion map.
const fn mark_evasion() -> StencilRule {
    StencilRule {
        compare: CompareOp::GREATER_OR_EQUAL,
        reference: EVASION as u32,
        ..ALL
    }
}
