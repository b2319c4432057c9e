//! Prefetches the keys of a group whose characters are read one by one, while the group before it is posed.

use super::level_clips::LevelClips;
use crate::math::{F32x16, KeyRows};

/// The rows of keys that a group will read.
pub(super) trait Fetch {
    /// Prefetches the keys that one lane needs of a level.
    fn prefetch_lane(&self, level: &LevelClips, lane: usize);

    /// Prefetches all keys. This is for the first group, which has no group before it.
    #[inline(always)]
    fn prefetch_all(&self, level: &LevelClips) {
        for lane in 0..F32x16::LANES {
            self.prefetch_lane(level, lane);
        }
    }

    /// Prefetches a share of the keys, while a joint of the group before is computed.
    #[inline(always)]
    fn prefetch(&self, level: &LevelClips, joint: usize) {
        let joints = level.joints.len();
        let lane = |joint: usize| joint * F32x16::LANES / joints;
        for lane in lane(joint)..lane(joint + 1) {
            self.prefetch_lane(level, lane);
        }
    }
}

impl Fetch for KeyRows<'_> {
    #[inline(always)]
    fn prefetch_lane(&self, level: &LevelClips, lane: usize) {
        for &unit in &level.fetched {
            self.prefetch(lane, unit);
        }
    }
}
