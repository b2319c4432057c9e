use super::answer::{Answer, CandidateReport, EnteredAt};
use super::retime::retimed;
use crate::graph::{Motion, MotionStep, Playhead};
use crate::maps::BakedGraph;

impl Answer {
    /// The motion of a candidate, from the moment of the query until the end of its evasion. Returns `None` for a path that no rate
    /// brings in time.
    ///
    /// `report` is one of `candidates`, `baked` is the graph of the query, and `playhead` is the position of its request.
    #[must_use]
    pub fn motion_of(
        &self,
        baked: &BakedGraph,
        playhead: Playhead,
        report: &CandidateReport,
    ) -> Option<Motion> {
        let mut motion = Motion::default();
        if let Some(EnteredAt { delay, entry }) = &report.entry {
            motion.restart(baked.graph(), playhead, []);
            motion.enter(baked.graph(), *delay, entry);
        } else if let Some(layer) = report.layer {
            motion.restart(baked.graph(), playhead, []);
            motion.extend(baked.graph(), layer.end());
            motion.set_layer(Some(layer));
        } else {
            let steps = retimed(baked, report.rate.ok()?, self.path(baked, report));
            let evasion = report.evasion.map(|edge| MotionStep { edge, rate: 1.0 });
            motion.restart(baked.graph(), playhead, steps.chain(evasion));
        }
        if let Some(warp) = report.warp {
            motion.extend(baked.graph(), warp.envelope.end);
        }
        motion.set_warp(report.warp);
        Some(motion)
    }
}
