use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{ClipId, ClipSource, GraphEvent, LinkReport, MotionGraph, Responsiveness};
use crate::anim::{Clip, EventKind};

/// What was found on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuildReport {
    /// Clips given.
    pub clips: usize,
    /// Seconds given.
    pub seconds: f64,
    /// Events given: evasions, attacks.
    pub events: (usize, usize),
    /// Transitions under the threshold, before anything was dropped.
    pub transitions: usize,
    /// Pairs of windows that were compared.
    pub window_pairs: u64,
    /// Links that were made for the sake of events.
    pub links: LinkReport,
    /// How soon moments of the graph reach evasions: within 0.5, 1 and 1.5 s.
    pub responsiveness: Vec<Responsiveness>,
    /// What the largest strongly connected component left out.
    pub dropped: Dropped,
}

/// What is not in the graph since no way leads there and back; events shorter than a frame, too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// Names of the clips of which no frame was kept.
    pub clips: Vec<String>,
    /// Seconds of clips.
    pub seconds: f64,
    /// Evasions, by clip and seconds: `"duck.bvh 0.77-1.77"`.
    pub evasions: Vec<String>,
    /// Attacks, by clip and seconds.
    pub attacks: Vec<String>,
}

/// What the build counted.
pub(super) struct Made {
    pub(super) transitions: usize,
    pub(super) window_pairs: u64,
    pub(super) links: LinkReport,
}

impl BuildReport {
    /// Seconds within which evasions are counted.
    const SOON: [f64; 3] = [0.5, 1.0, 1.5];

    /// `graphs` are the one before its largest component was taken, and that component.
    pub(super) fn new(
        source: ClipSource<'_>,
        (full, kept): (&MotionGraph, &MotionGraph),
        made: Made,
    ) -> Self {
        let count = |kind| {
            source
                .events
                .iter()
                .filter(|event| event.kind == kind)
                .count()
        };
        Self {
            clips: source.clips.len(),
            seconds: source.clips.iter().map(Clip::duration).sum(),
            events: (count(EventKind::Evasion), count(EventKind::Attack)),
            transitions: made.transitions,
            window_pairs: made.window_pairs,
            links: made.links,
            responsiveness: Self::SOON
                .map(|seconds| kept.responsiveness(seconds))
                .to_vec(),
            dropped: Dropped::between(full, kept),
        }
    }
}

impl Dropped {
    fn between(full: &MotionGraph, kept: &MotionGraph) -> Self {
        let gone = |kind| -> Vec<String> {
            let lost = |event: &&GraphEvent| event.kind == kind && !kept.events().contains(event);
            full.events()
                .iter()
                .filter(lost)
                .map(|event| full.describe_event(event))
                .collect()
        };
        let used: BTreeSet<ClipId> = kept.nodes().iter().map(|node| node.clip).collect();
        let unused = kept
            .clips()
            .iter()
            .zip(0..)
            .filter(|&(_, index)| !used.contains(&ClipId(index)));
        Self {
            clips: unused.map(|(clip, _)| clip.name().to_owned()).collect(),
            seconds: full.seconds_kept() - kept.seconds_kept(),
            evasions: gone(EventKind::Evasion),
            attacks: gone(EventKind::Attack),
        }
    }
}
