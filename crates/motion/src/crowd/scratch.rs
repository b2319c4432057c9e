//! Scratch memory of the threads that pose.

use super::animation_set::AnimationSet;
use super::joint_math::JointMath;
use super::level_clips::LevelClips;
use super::matrices::Matrices;
use super::moments::Moments;
use super::output::row_lines;
use crate::math::F32x16;

/// Number of groups whose moments are found together. Finding a moment is a long chain of dependent operations; the chains
/// of several groups overlap.
pub(super) const AHEAD: usize = 8;

/// Memory that a thread keeps from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// Moments of two batches of groups, which alternate.
    pub(super) moments: Vec<Moments>,
    /// Joints of a group, if they cannot be computed in the output.
    pub(super) models: Vec<F32x16>,
    /// Columns of a group's first clips, of its second clips, and of its layers.
    pub(super) columns: [Vec<F32x16>; 3],
    /// Receives the rows of unused lanes.
    pub(super) spare: Vec<F32x16>,
}

impl Scratch {
    /// Allocates enough for any level, so that threads do not allocate later.
    pub(super) fn of(animations: &AnimationSet) -> Self {
        let mut scratch = Self {
            moments: vec![Moments::BLANK; 2 * AHEAD],
            ..Self::default()
        };
        for bank in &animations.banks {
            scratch.fit(bank);
        }
        scratch
    }

    fn fit(&mut self, bank: &LevelClips) {
        let grow = |lines: &mut Vec<F32x16>, length: usize| {
            if lines.len() < length {
                lines.resize(length, F32x16::ZERO);
            }
        };
        grow(
            &mut self.models,
            (bank.joints.len() + Matrices::SPARE) * Matrices::NUMBERS,
        );
        grow(&mut self.spare, row_lines::<Matrices>(bank.joints.len()));
        for lines in &mut self.columns {
            grow(lines, bank.column_lines);
        }
    }
}
