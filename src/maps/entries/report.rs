//! Statistics of entries, exits and layers.

use serde::{Deserialize, Serialize};

use super::stretches::PlayedFrames;
use super::targets::ClipPlaces;
use super::{EntryTable, Stretches};
use crate::graph::{ClipId, MotionGraph};

/// Statistics of the entries of a baked graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    #[serde(default)]
    pub exits: usize,
    /// Number of layered evasions.
    #[serde(default)]
    pub layers: usize,
    /// Stretches of the clips without a branch point.
    #[serde(default)]
    pub unbranched: Stretches,
    /// Stretches of evasions and attacks without a branch point.
    #[serde(default)]
    pub unbranched_in_events: Stretches,
}

impl EntryReport {
    /// Share of the moments that have an entry, 0 if there are no moments.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.entered as f64 / self.moments.max(1) as f64
    }
}

impl EntryTable {
    /// Computes the statistics.
    #[must_use]
    pub(crate) fn report(&self, graph: &MotionGraph) -> EntryReport {
        let mut report = EntryReport {
            entries: self.entries.len(),
            cut: self.cut,
            exits: self.exits.lists.len(),
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
            let frames = PlayedFrames::of(graph, &places, clip);
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
                let has_entry = !self.entries.of(moment).is_empty();
                report.moments += usize::from(played);
                report.entered += usize::from(played && has_entry);
                without = if played && !has_entry { without + 1 } else { 0 };
                let longest = (f64::from(without) * seconds) as f32;
                report.longest_without = report.longest_without.max(longest);
            }
        }
        report.unbranched = Stretches::of(of_all_frames, graph.frame_rate());
        report.unbranched_in_events = Stretches::of(of_event_frames, graph.frame_rate());
        report
    }
}
