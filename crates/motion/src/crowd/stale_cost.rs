//! When a crowd is worth sorting again: the extra cost of its present groups against that of sorting.
//!
//! The method is ours: the crowd is sorted once posing the present groups has cost as much more than posing new ones would as
//! sorting costs.

/// Extra cost of posing the present groups instead of new ones. The unit is a fiftieth of the time that sorting one
/// character takes: about a nanosecond.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StaleCost {
    /// Extra cost of all frames since the last sorting.
    pub(super) total: usize,
    /// Number of joints that are posed beyond those of the characters' levels, because characters stay in their groups.
    pub(super) joints: isize,
    /// Number of joints that are posed for lanes outside the frustum.
    pub(super) hidden: usize,
    /// Number of characters that were moved to other groups.
    pub(super) late: usize,
    /// Number of groups whose characters were not near each other in time in the first frame: with narrow registers, some
    /// are not.
    apart: Option<usize>,
}

impl StaleCost {
    /// Cost of sorting a character.
    const CHARACTER: usize = 50;
    /// Extra cost of a frame for each group whose characters are no longer near each other in time.
    const APART: usize = 100;
    /// Extra cost of a frame for each moved character, whose group is not full.
    const LATE: usize = 4;

    /// Adds the extra cost of a frame in which `apart` groups had characters that are not near each other in time.
    pub(super) fn add_frame(&mut self, apart: usize) {
        let joints = self.joints.max(0) as usize;
        let apart = apart.saturating_sub(*self.apart.get_or_insert(apart));
        self.total += Self::APART * apart + Self::LATE * self.late + joints + self.hidden;
    }

    /// Whether the extra cost has reached the cost of sorting.
    pub(super) fn exceeds_sorting(&self, characters: usize) -> bool {
        self.total >= Self::CHARACTER * characters
    }
}
