//! What each candidate would have looked like.

use super::answer::{Answer, CandidateReport};
use super::retime::Direction;
use crate::graph::{EdgeId, Motion, Playhead, Step};
use crate::maps::BakedGraph;

impl Answer {
    /// The motion of a candidate, from the moment of the query until `seconds` after it at least; `None` where no rate
    /// brings it in time.
    ///
    /// `report` is one of `candidates`, `baked` the graph that was asked, and `playhead` where the character was.
    #[must_use]
    pub fn motion_of(
        &self,
        (baked, playhead): (&BakedGraph, Playhead),
        report: &CandidateReport,
        seconds: f32,
    ) -> Option<Motion> {
        let rate = report.rate.ok()?;
        let rate_of = |edge: EdgeId| {
            let retimable = baked.retimable(edge);
            let is_changed = match rate.direction {
                Direction::Unchanged => false,
                Direction::Faster => retimable.faster,
                Direction::Slower => retimable.slower,
            };
            if is_changed { rate.rate } else { 1.0 }
        };
        let path = self.path(baked, report).map(|edge| Step {
            edge,
            rate: rate_of(edge),
        });
        let evasion = report.evasion.map(|edge| Step { edge, rate: 1.0 });
        let mut motion = Motion::default();
        motion.restart(baked.graph(), playhead, path.chain(evasion));
        motion.extend(baked.graph(), seconds);
        Some(motion)
    }
}
