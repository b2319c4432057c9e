//! Memory of the threads that pose.

use super::animation_set::AnimationSet;
use super::joint_math::JointMath;
use super::level_clips::LevelClips;
use super::matrices::Matrices;
use super::moments::Moments;
use super::output::row_lines;
use crate::math::F32x16;

/// Groups whose moments are found before the first of them is posed. Where a group is in its clip is a long chain of steps, each of
/// which waits for the one before: those of several groups are done at once.
pub(super) const AHEAD: usize = 8;

/// What a thread keeps from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// Where the groups are that are posed next.
    pub(super) moments: Vec<Moments>,
    /// A group's joints, where the output is not read from.
    pub(super) models: Vec<F32x16>,
    /// Columns of a group's first clips, of its second ones, and of its layers.
    pub(super) columns: [Vec<F32x16>; 3],
    /// The row of lanes that nobody uses.
    pub(super) spare: Vec<F32x16>,
}

impl Scratch {
    /// Enough for any level: threads shall not allocate later.
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
