//! Statistics of a graph build.

use crate::anim::{Event, EventKind};
use crate::graph::build::islands::JoinedClip;
use crate::graph::build::moments;
use crate::graph::build::waits::{Waits, whole_frames};
use crate::graph::motion_graph::{GraphEvent, MotionGraph};
use crate::graph::settings::LinkGoal;
use serde::{Deserialize, Serialize};
use thiserror::Error;

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
    /// Number of transitions that were left out because a foot moves too fast in them or the body pushes too hard.
    #[serde(rename = "darting")]
    pub impossible: usize,
    /// Number of window pairs that were compared.
    pub window_pairs: u64,
    /// Number of window pairs whose distance was computed in this process. Lower bounds show that the others are above the
    /// threshold. It is 0 if the transitions come from shards.
    pub distances: u64,
    /// Statistics of the links that were added for events.
    pub links: LinkReport,
    /// Clips that nothing near leads to or from, and loops, as they were joined.
    pub joined: Vec<JoinedClip>,
    /// Clips that are not joined because their closest links are farther than [`GraphSettings::farthest_join`], or that have none.
    ///
    /// [`GraphSettings::farthest_join`]: crate::graph::GraphSettings::farthest_join
    pub islands: Vec<JoinedClip>,
    /// Share of moments that reach an evasion within 0.5, 1 and 1.5 s, and how many different ones.
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

impl EventCounts {
    pub(crate) fn new(events: &[Event]) -> Self {
        let count = |kind| events.iter().filter(|event| event.kind == kind).count();
        Self {
            evasions: count(EventKind::Evasion),
            attacks: count(EventKind::Attack),
        }
    }
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
    /// Parts of kept clips, the longest first.
    pub parts: Vec<DroppedPart>,
    /// Dropped evasions by clip and seconds, for example `"duck.bvh 0.77-1.77"`.
    pub evasions: Vec<String>,
    /// Dropped attacks, by clip and seconds.
    pub attacks: Vec<String>,
}

/// The parts of a clip that were dropped: no transition leads into its first moments, or out of its last ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DroppedPart {
    /// Name of the clip.
    pub clip: String,
    /// Seconds at its start.
    pub start: f64,
    /// Seconds at its end.
    pub end: f64,
}

impl Dropped {
    /// What is in `full` and not in its component `kept`.
    pub(crate) fn between(full: &MotionGraph, kept: &MotionGraph) -> Self {
        let gone = |kind| -> Vec<String> {
            let lost = |event: &&GraphEvent| event.kind == kind && !kept.events().contains(event);
            full.events()
                .iter()
                .filter(lost)
                .map(|event| full.describe_event(event))
                .collect()
        };
        // First and last kept frame of each clip. The component's nodes are sorted.
        let mut used: Vec<Option<[u32; 2]>> = vec![None; kept.clips().len()];
        for node in kept.nodes() {
            let ends = used[node.clip.index()].get_or_insert([node.frame; 2]);
            ends[1] = node.frame;
        }
        let mut parts = Vec::new();
        for (index, clip) in kept.clips().iter().enumerate() {
            let lead = full.leads.get(index).copied().unwrap_or(0);
            let last = (clip.frames() as u32 - 1).saturating_sub(lead);
            let seconds = |frames: u32| f64::from(frames) / full.frame_rate;
            if let Some([first, end]) =
                used[index].filter(|&[first, end]| first > lead || end < last)
            {
                parts.push(DroppedPart {
                    clip: clip.name().to_owned(),
                    start: seconds(first.saturating_sub(lead)),
                    end: seconds(last.saturating_sub(end)),
                });
            }
        }
        let length = |part: &DroppedPart| part.start + part.end;
        parts.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let unused = kept.clips().iter().zip(&used);
        let unused = unused.filter(|(_, used)| used.is_none());
        // As many frames are added after a clip as before.
        let added = 2.0 * f64::from(full.leads.iter().sum::<u32>()) / full.frame_rate;
        Self {
            clips: unused.map(|(clip, _)| clip.name().to_owned()).collect(),
            seconds: (full.seconds_kept() - added - kept.seconds_kept()).max(0.0),
            parts,
            evasions: gone(EventKind::Evasion),
            attacks: gone(EventKind::Attack),
        }
    }
}

/// Statistics of the links.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkReport {
    /// Number of links.
    pub links: usize,
    /// Number of links that were not added because a foot moves too fast in them or the body pushes too hard.
    #[serde(rename = "darting")]
    pub impossible: usize,
    /// Number of links that keep an event in the graph.
    pub joins: usize,
    /// Maximum distance of a link, in metres.
    pub loosest: f32,
    /// Maximum length of a link, in seconds.
    pub longest: f64,
    /// Results of the goals, in the settings' order.
    pub goals: Vec<GoalReport>,
    /// Events that no link could connect to the graph.
    pub unlinked: Vec<UnlinkedEvent>,
}

/// Result of one goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalReport {
    /// The goal.
    pub goal: LinkGoal,
    /// Share of the moments that meet the goal without links.
    pub before: f64,
    /// Share of the moments that meet the goal with links.
    pub reached: f64,
}

/// An event that is not part of the graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnlinkedEvent {
    /// Clip and seconds of the event, for example `"duck.bvh 0.77-1.77"`.
    pub event: String,
    /// Reason why it could not be linked.
    pub obstacle: LinkObstacle,
}

/// Reason why an event could not be linked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Error)]
pub enum LinkObstacle {
    /// The event has no motion.
    #[error("it is shorter than a frame")]
    TooShort,
    /// The event starts too close to its clip's start or to the end of another event.
    #[error(
        "only {seconds:.2} s of motion lead to it, and the shortest blend takes {shortest:.2} s"
    )]
    NoLeadIn {
        /// Duration of the motion before the event, in seconds.
        seconds: f64,
        /// Duration of the shortest blend, in seconds.
        shortest: f64,
    },
    /// The event ends too close to its clip's end or to the start of another event.
    #[error(
        "only {seconds:.2} s of motion follow it, and the shortest blend takes {shortest:.2} s"
    )]
    NoTail {
        /// Duration of the motion after the event, in seconds.
        seconds: f64,
        /// Duration of the shortest blend, in seconds.
        shortest: f64,
    },
    /// No moment of the graph is close enough.
    #[error("no moment of the graph within {loosest} m leads to it, or none to which it leads")]
    NothingNear {
        /// Maximum distance of a link, in metres.
        loosest: f32,
    },
}

/// How soon the moments of a graph reach evasions, at rate 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Responsiveness {
    /// Time within which an evasion must be able to start, in seconds.
    pub seconds: f64,
    /// Share of the moments from which at least one evasion can start in time.
    pub share: f64,
    /// Mean number of different evasions that can start in time.
    pub mean: f64,
    /// Median number of different evasions that can start in time.
    pub median: usize,
}

impl MotionGraph {
    /// For all moments of the graph's clips, counts the evasions that can start within `seconds`
    /// after the next node is reached. Moments within an event count; they wait for its end.
    pub fn responsiveness(&self, seconds: f64) -> Responsiveness {
        self.responsiveness_within(&[seconds], true, 1)[0]
    }

    /// [`MotionGraph::responsiveness`] for several times, computed by `threads` threads. Without `told_apart`, all evasions count as one, which
    /// takes less memory.
    pub(crate) fn responsiveness_within(
        &self,
        seconds: &[f64],
        told_apart: bool,
        threads: usize,
    ) -> Vec<Responsiveness> {
        let limits: Vec<u32> = seconds
            .iter()
            .map(|&seconds| whole_frames(seconds, self.frame_rate))
            .collect();
        let (moments, jumps, played) = moments::from_graph(self);
        let horizon = limits.iter().copied().max().unwrap_or(0);
        let mut waits = Waits::new(&moments, &jumps, horizon);
        let evasions = self.edges_with(EventKind::Evasion);
        let starts = evasions.map(|(edge, _)| {
            let start = self.node(self.edge(edge).from);
            moments.at(start.clip.index(), start.frame as usize)
        });
        let starts: Vec<Vec<u32>> = match told_apart {
            true => starts.map(|start| vec![start]).collect(),
            false => vec![starts.collect()],
        };
        waits.set_goals(&starts, threads);
        let goes_on = moments.goes_on();
        let of_limit = |(&seconds, &limit): (&f64, &u32)| {
            let below = waits.counts_below(limit, threads);
            // The moment before another one of its clip waits one frame longer.
            let reached = |moment: usize| match goes_on[moment] {
                true => usize::from(below[moment + 1]),
                false => 0,
            };
            let counted = (0..played.len()).filter(|&moment| played[moment]);
            let mut counts: Vec<usize> = counted.map(reached).collect();
            counts.sort_unstable();
            let share = |sum: usize| sum as f64 / counts.len().max(1) as f64;
            Responsiveness {
                seconds,
                share: share(counts.iter().filter(|&&count| count > 0).count()),
                mean: share(counts.iter().sum()),
                median: counts.get(counts.len() / 2).copied().unwrap_or(0),
            }
        };
        seconds.iter().zip(&limits).map(of_limit).collect()
    }
}
