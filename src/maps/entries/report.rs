//! Statistics of entries, exits and layers.

use crate::graph::{ClipId, MotionGraph};
use crate::maps::entries::table::EntryTable;
use crate::maps::entries::targets::ClipPlaces;
use serde::Serialize;
use std::ops::Range;

/// Statistics of the entries of a baked graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EntryReport {
    /// Number of entries.
    pub entries: usize,
    /// Number of moments with the maximum number of entries. Some of their entries may be missing.
    pub cut: u64,
    /// Number of moments that the graph plays and that have an entry.
    pub entered: usize,
    /// Number of moments that the graph plays.
    pub moments: usize,
    /// Longest time in a clip without a moment that has an entry, in seconds.
    pub longest_without: f32,
    /// Number of exits.
    pub exits: usize,
    /// Number of layered evasions.
    pub layers: usize,
    /// Stretches of the clips without a branch point.
    pub unbranched: Stretches,
    /// Stretches of evasions and attacks without a branch point.
    pub unbranched_in_events: Stretches,
}

impl EntryReport {
    /// Share of the moments that have an entry, 0 if there are no moments.
    pub fn share(&self) -> f64 {
        self.entered as f64 / self.moments.max(1) as f64
    }
}

impl EntryTable {
    pub(crate) fn report(&self, graph: &MotionGraph) -> EntryReport {
        let mut report = EntryReport {
            entries: self.entries.len(),
            cut: self.cut,
            exits: self.exits.len(),
            layers: self.layers.len(),
            ..EntryReport::default()
        };
        // The table of a graph without evasions is empty.
        if self.step == 0 {
            return report;
        }
        let (mut of_all_frames, mut of_event_frames) = (Vec::new(), Vec::new());
        let seconds = f64::from(self.step) / graph.frame_rate();
        let places = ClipPlaces::new(graph);
        for clip in (0..graph.clips().len()).map(|clip| ClipId(clip as u32)) {
            let frames = PlayedFrames::new(graph, &places, clip);
            let is_event = frames.is_event.clone();
            for stretch in frames.stretches(self) {
                let length = stretch.len() as u32;
                let of_events = is_event[stretch]
                    .iter()
                    .filter(|event| **event == Some(true));
                of_event_frames.extend(of_events.map(|_| length));
                of_all_frames.extend(std::iter::repeat_n(length, length as usize));
            }
            let mut without = 0;
            let played = is_event
                .iter()
                .step_by(self.step as usize)
                .map(Option::is_some);
            for (moment, played) in self.moments_of(clip).zip(played) {
                let has_entry = !self.entries.list(moment).is_empty();
                report.moments += usize::from(played);
                report.entered += usize::from(played && has_entry);
                without = if played && !has_entry { without + 1 } else { 0 };
                let longest = (f64::from(without) * seconds) as f32;
                report.longest_without = report.longest_without.max(longest);
            }
        }
        report.unbranched = Stretches::new(of_all_frames, graph.frame_rate());
        report.unbranched_in_events = Stretches::new(of_event_frames, graph.frame_rate());
        report
    }
}

// Stretches of the clips without a branch point: a frame with an entry, an exit, or a choice of edges.

/// Statistics of the stretches of the clips between two branch points: frames with an entry, an exit, or a choice of edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stretches {
    /// Median duration, weighted by time, in seconds: half of all time lies in stretches of at most this duration.
    pub median: f32,
    /// Longest duration, in seconds.
    pub longest: f32,
}

impl Stretches {
    /// Computes the statistics from the length of each frame's stretch, in frames.
    pub(crate) fn new(mut lengths: Vec<u32>, rate: f64) -> Self {
        lengths.sort();
        let seconds = |at: usize| (f64::from(lengths.get(at).copied().unwrap_or(0)) / rate) as f32;
        Self {
            median: seconds(lengths.len() / 2),
            longest: seconds(lengths.len().saturating_sub(1)),
        }
    }
}

/// The frames of a clip that the graph plays.
pub(crate) struct PlayedFrames {
    clip: ClipId,
    /// For each frame, whether it belongs to an event; `None` if the graph does not play it.
    pub(crate) is_event: Vec<Option<bool>>,
    /// For each frame, whether the graph has a choice of edges there.
    branches: Vec<bool>,
}

impl PlayedFrames {
    pub(crate) fn new(graph: &MotionGraph, places: &ClipPlaces, clip: ClipId) -> Self {
        let frames = graph.clip(clip).frames();
        let (mut is_event, mut branches) = (vec![None; frames], vec![false; frames]);
        for &(first, end, edge) in places.edges(clip) {
            let edge = graph.edge(edge);
            for frame in &mut is_event[first as usize..end as usize] {
                *frame = Some(*frame == Some(true) || edge.event.is_some());
            }
            branches[first as usize] |= graph.edges_from(edge.from).count() > 1;
        }
        Self {
            clip,
            is_event,
            branches,
        }
    }

    /// The stretches between the branch points, in frames.
    pub(crate) fn stretches(mut self, table: &EntryTable) -> Vec<Range<usize>> {
        for (number, moment) in table.moments_of(self.clip).enumerate() {
            let is_branch =
                !table.entries.list(moment).is_empty() || !table.exits.list(moment).is_empty();
            self.branches[number * table.step as usize] |= is_branch;
        }
        let (frames, mut first) = (self.is_event.len(), 0);
        let mut stretches = Vec::new();
        for end in 1..=frames {
            let is_over = end == frames
                || self.branches[end]
                || self.is_event[end].is_none()
                || self.is_event[end - 1].is_none();
            if is_over {
                stretches.push(first..end);
                first = end;
            }
        }
        stretches.retain(|stretch| self.is_event[stretch.start].is_some());
        stretches
    }
}
