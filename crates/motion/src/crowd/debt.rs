//! When a crowd is worth sorting again.

/// What the present groups cost more than new ones would, in fiftieths of the time that sorting one character takes: about
/// a nanosecond.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Debt {
    /// Sum since the last sorting.
    pub(super) owed: usize,
    /// Joints that characters have more than they need, since they stay in their groups.
    pub(super) joints: isize,
    /// Work for lanes outside the frustum.
    pub(super) hidden: usize,
    /// Number of characters that were moved to other groups.
    pub(super) late: usize,
    /// Groups whose characters were not near each other in time in the first frame: some are not with narrow registers.
    apart: Option<usize>,
}

impl Debt {
    /// Sorting a character.
    const CHARACTER: usize = 50;
    /// A group in a frame whose characters are no longer near each other in time.
    const APART: usize = 100;
    /// A moved character in a frame: its group is not full.
    const LATE: usize = 4;

    pub(super) fn of_a_frame(&mut self, apart: usize) {
        let joints = self.joints.max(0) as usize;
        let apart = apart.saturating_sub(*self.apart.get_or_insert(apart));
        self.owed += Self::APART * apart + Self::LATE * self.late + joints + self.hidden;
    }

    pub(super) fn is_due(&self, characters: usize) -> bool {
        self.owed >= Self::CHARACTER * characters
    }
}
