use super::moves::MoveId;
use super::retime::Rate;
use crate::maps::PathId;

/// A path that is in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub way: Way,
    pub rate: Rate,
}

/// Where a candidate leads.
#[derive(Clone, Copy, Debug)]
pub(super) enum Way {
    /// To an evasion.
    Evasion {
        path: PathId,
        /// When that starts, seconds since the query.
        start: f32,
    },
    /// On, for as long as the attack lasts.
    Move(MoveId),
}

impl Candidate {
    /// The path to its evasion, where it leads to one.
    pub(super) fn path(&self) -> Option<PathId> {
        match self.way {
            Way::Evasion { path, .. } => Some(path),
            Way::Move(_) => None,
        }
    }
}
