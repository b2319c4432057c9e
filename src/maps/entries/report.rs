//! Statistics of entries.

use serde::{Deserialize, Serialize};

use super::EntryTable;
use crate::graph::{ClipId, EdgeMotion, MotionGraph};

/// Figures of the entries of a baked graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EntryReport {
    /// Number of entries.
    pub entries: usize,
    /// Number of moments with the maximum number of entries. There may be more.
    pub cut: u64,
    /// Number of moments that the graph plays and that have an entry.
    pub entered: usize,
    /// Number of moments that the graph plays.
    pub moments: usize,
    /// Longest time in a clip without a moment that has an entry, in seconds.
    pub longest_without: f32,
    /// Number of exits.
    #[serde(default)]
    pub exits: usize,
    /// Number of layered evasions.
    #[serde(default)]
    pub layers: usize,
    /// Stretches of the clips without a branch point.
    #[serde(default)]
    pub unbranched: Stretches,
    /// Those of evasions and attacks.
    #[serde(default)]
    pub unbranched_in_events: Stretches,
}

/// Stretches of the clips between two branch points: frames with an entry, an exit, or a choice of edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stretches {
    /// Duration of the stretch that half of the time lies in stretches shorter than, in seconds.
    pub median: f32,
    /// Longest duration, in seconds.
    pub longest: f32,
}

impl EntryReport {
    /// Share of the moments that have an entry, 0 if there are no moments.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.entered as f64 / self.moments.max(1) as f64
    }
}

impl EntryTable {
    /// Computes the figures.
    #[must_use]
    pub(crate) fn report(&self, graph: &MotionGraph) -> EntryReport {
        let mut report = EntryReport {
            entries: self.entries.len(),
            cut: self.cut,
            exits: self.exits.lists.len(),
            layers: self.layers.len(),
            ..EntryReport::default()
        };
        let mut stretches = [Vec::new(), Vec::new()];
        let seconds = f64::from(self.step) / graph.frame_rate();
        for (clip, bounds) in self.first_moment.windows(2).enumerate() {
            let mut played = vec![false; (bounds[1] - bounds[0]) as usize];
            for edge in graph.edges() {
                let from = graph.node(edge.from);
                if from.clip.index() == clip && edge.motion == EdgeMotion::Clip {
                    let frames = from.frame..from.frame + edge.frames;
                    let moments = frames.start.div_ceil(self.step)..frames.end.div_ceil(self.step);
                    played[moments.start as usize..moments.end as usize].fill(true);
                }
            }
            self.add_stretches((graph, ClipId(clip as u32)), &mut stretches);
            let mut without = 0;
            for (moment, played) in (bounds[0]..).zip(played) {
                let has_entry = !self.entries.of(moment).is_empty();
                report.moments += usize::from(played);
                report.entered += usize::from(played && has_entry);
                without = if played && !has_entry { without + 1 } else { 0 };
                let longest = (f64::from(without) * seconds) as f32;
                report.longest_without = report.longest_without.max(longest);
            }
        }
        [report.unbranched, report.unbranched_in_events] =
            stretches.map(|frames| Stretches::of(frames, graph.frame_rate()));
        report
    }

    /// Adds the length of the stretch that each played frame of a clip lies in, in frames: those of all frames, and those of events.
    fn add_stretches(&self, (graph, clip): (&MotionGraph, ClipId), lengths: &mut [Vec<u32>; 2]) {
        let frames = graph.clip(clip).frames();
        let mut branches = vec![false; frames];
        let mut played = vec![None; frames];
        for edge in graph.edges() {
            let (from, event) = (graph.node(edge.from), edge.event.is_some());
            if from.clip == clip && edge.motion == EdgeMotion::Clip {
                let own = from.frame as usize..(from.frame + edge.frames) as usize;
                played[own].fill(Some(event));
                branches[from.frame as usize] |= graph.edges_from(edge.from).count() > 1;
            }
        }
        let bounds = self.first_moment[clip.index()]..self.first_moment[clip.index() + 1];
        for (number, moment) in bounds.enumerate() {
            let is_branch =
                !self.entries.of(moment).is_empty() || !self.exits.lists.of(moment).is_empty();
            branches[number * self.step as usize] |= is_branch;
        }
        let mut first = 0;
        for end in 1..=frames {
            let is_over = end == frames
                || branches[end]
                || played[end].is_none()
                || played[end - 1].is_none();
            if !is_over {
                continue;
            }
            let length = (end - first) as u32;
            for event in played[first..end].iter().flatten() {
                lengths[0].push(length);
                if *event {
                    lengths[1].push(length);
                }
            }
            first = end;
        }
    }
}

impl Stretches {
    fn of(mut frames: Vec<u32>, rate: f64) -> Self {
        frames.sort_unstable();
        let seconds = |at: usize| (f64::from(frames.get(at).copied().unwrap_or(0)) / rate) as f32;
        Self {
            median: seconds(frames.len() / 2),
            longest: seconds(frames.len().saturating_sub(1)),
        }
    }
}
