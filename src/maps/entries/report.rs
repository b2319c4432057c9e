//! Statistics of entries.

use serde::{Deserialize, Serialize};

use super::EntryTable;
use crate::graph::{EdgeMotion, MotionGraph};

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
            ..EntryReport::default()
        };
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
            let mut without = 0;
            for (moment, played) in (bounds[0]..).zip(played) {
                let has_entry = !self.of(moment).is_empty();
                report.moments += usize::from(played);
                report.entered += usize::from(played && has_entry);
                without = if played && !has_entry { without + 1 } else { 0 };
                let longest = (f64::from(without) * seconds) as f32;
                report.longest_without = report.longest_without.max(longest);
            }
        }
        report
    }
}
