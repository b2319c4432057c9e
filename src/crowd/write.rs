//! Where a group's joints go in the output.

use super::joint_math::JointMath;
use super::output::{Layout, Output, WriteMode, row_lines, turn_joints, turn_lines};
use crate::math::{F32x16, Lanes};

/// A joint in the order of the output, from memory of the thread's own.
#[inline(always)]
pub(super) fn write_joint<L: Lanes, P: JointMath>(
    models: &[P::Model],
    joint: usize,
    (out, output): (&mut [F32x16], Output),
) {
    match output.layout {
        Layout::Blocks => stream_block::<L, P>(&models[joint], block::<P>(out, joint)),
        Layout::Rows => write_rows::<L, P>(models, joint, (out, output.write)),
    }
}

/// The lines of one joint in the output of a group.
#[inline(always)]
fn block<P: JointMath>(out: &mut [F32x16], joint: usize) -> &mut [F32x16] {
    &mut out[joint * P::NUMBERS..][..P::NUMBERS]
}

#[inline(always)]
fn stream_block<L: Lanes, P: JointMath>(from: &P::Model, to: &mut [F32x16]) {
    for (from, to) in from.as_ref().iter().zip(to) {
        for part in 0..L::PARTS {
            L::load(from, part).stream(to, part);
        }
    }
}

/// Writes the whole lines of all rows that end with this joint.
#[inline(always)]
fn write_rows<L: Lanes, P: JointMath>(
    models: &[P::Model],
    joint: usize,
    (out, write): (&mut [F32x16], WriteMode),
) {
    let (of_turn, lines) = (turn_joints::<P>(), turn_lines::<P>());
    if !(joint + 1).is_multiple_of(of_turn) && joint + 1 != models.len() {
        return;
    }
    let turn = joint / of_turn;
    let row = row_lines::<P>(models.len());
    for line in 0..lines {
        let mut numbers = [&F32x16::ZERO; F32x16::LANES];
        for (index, number) in numbers.iter_mut().enumerate() {
            let place = line * F32x16::LANES + index;
            if let Some(model) = models.get(turn * of_turn + place / P::ROW)
                && let Some(found) = model.as_ref().get(place % P::ROW)
            {
                *number = found;
            }
        }
        let out = &mut out[turn * lines + line..];
        match write {
            WriteMode::Cached => L::transpose_with(
                numbers,
                #[inline(always)]
                |lane, part, numbers| numbers.store(&mut out[lane * row], part),
            ),
            WriteMode::Streamed => L::transpose_with(
                numbers,
                #[inline(always)]
                |lane, part, numbers| numbers.stream(&mut out[lane * row], part),
            ),
        }
    }
}
