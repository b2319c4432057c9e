use serde::{Deserialize, Serialize};

use super::{ClipSource, GraphEvent, LinkReport, MotionGraph, Responsiveness};
use crate::anim::{Clip, EventKind};

/// Statistics of a graph build.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BuildReport {
    /// Number of clips.
    pub clips: usize,
    /// Duration of all clips, in seconds.
    pub seconds: f64,
    /// Number of labelled events of the clips.
    pub events: EventCounts,
    /// Number of transitions under the threshold, before pruning.
    pub transitions: usize,
    /// Number of transitions that were left out because a foot darts in them.
    #[serde(default)]
    pub darting: usize,
    /// Number of window pairs that were compared.
    pub window_pairs: u64,
    /// Number of window pairs whose distance was computed in this process. Lower bounds show that the others are above the
    /// threshold. It is 0 if the transitions come from shards.
    #[serde(default)]
    pub distances: u64,
    /// Statistics of the links that were added for events.
    #[doc(hidden)]
    pub links: LinkReport,
    /// Share of moments that reach an evasion within 0.5, 1 and 1.5 s.
    #[doc(hidden)]
    pub responsiveness: Vec<Responsiveness>,
    /// Motion that is not part of the largest strongly connected component.
    pub dropped: Dropped,
}

/// Number of labelled events of each kind. Serialized as a pair: evasions, attacks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "(usize, usize)", into = "(usize, usize)")]
pub struct EventCounts {
    /// Number of evasions.
    pub evasions: usize,
    /// Number of attacks.
    pub attacks: usize,
}

impl From<(usize, usize)> for EventCounts {
    fn from((evasions, attacks): (usize, usize)) -> Self {
        Self { evasions, attacks }
    }
}

impl From<EventCounts> for (usize, usize) {
    fn from(counts: EventCounts) -> Self {
        (counts.evasions, counts.attacks)
    }
}

/// Motion that is not in the graph because no cycle contains it. It includes events shorter than a
/// frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Dropped {
    /// Names of clips of which no frame was kept.
    pub clips: Vec<String>,
    /// Duration of the dropped parts of clips, in seconds.
    pub seconds: f64,
    /// Dropped evasions by clip and seconds, for example `"duck.bvh 0.77-1.77"`.
    pub evasions: Vec<String>,
    /// Dropped attacks, by clip and seconds.
    pub attacks: Vec<String>,
}

/// The complete graph and its largest component.
pub(super) struct BuiltGraphs<'a> {
    pub(super) full: &'a MotionGraph,
    pub(super) kept: &'a MotionGraph,
}

/// Counts of a build.
pub(super) struct BuildCounts {
    pub(super) transitions: usize,
    pub(super) darting: usize,
    pub(super) window_pairs: u64,
    pub(super) distances: u64,
    pub(super) links: LinkReport,
    /// Number of threads that compute the statistics.
    pub(super) threads: usize,
}

impl BuildReport {
    /// Times within which evasions are counted, in seconds.
    const SOON: [f64; 3] = [0.5, 1.0, 1.5];

    pub(super) fn new(
        source: ClipSource<'_>,
        graphs: &BuiltGraphs<'_>,
        counts: BuildCounts,
    ) -> Self {
        let BuiltGraphs { full, kept } = *graphs;
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
            events: EventCounts {
                evasions: count(EventKind::Evasion),
                attacks: count(EventKind::Attack),
            },
            transitions: counts.transitions,
            darting: counts.darting,
            window_pairs: counts.window_pairs,
            distances: counts.distances,
            links: counts.links,
            responsiveness: kept.responsiveness_within(&Self::SOON, counts.threads),
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
        let mut is_used = vec![false; kept.clips().len()];
        for node in kept.nodes() {
            is_used[node.clip.index()] = true;
        }
        let unused = kept
            .clips()
            .iter()
            .zip(&is_used)
            .filter(|(_, used)| !**used);
        Self {
            clips: unused.map(|(clip, _)| clip.name().to_owned()).collect(),
            seconds: full.seconds_kept() - kept.seconds_kept(),
            evasions: gone(EventKind::Evasion),
            attacks: gone(EventKind::Attack),
        }
    }
}
