use serde::{Deserialize, Serialize};

use super::waits::{Waits, within};
use super::{MotionGraph, moments};
use crate::anim::EventKind;

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
    #[must_use]
    #[doc(hidden)]
    pub fn responsiveness(&self, seconds: f64) -> Responsiveness {
        let limit = within(seconds, self.frame_rate);
        let (moments, jumps, played) = moments::of_graph(self);
        let mut waits = Waits::new(&moments, &jumps, limit);
        let mut reached = vec![0usize; moments.len()];
        for (edge, _) in self.edges_with(EventKind::Evasion) {
            let start = self.node(self.edge(edge).from);
            let start = moments.at(start.clip.index(), start.frame as usize);
            waits.add_goal(start, |moment, old, new| {
                if new < limit && old >= limit {
                    reached[moment as usize - 1] += 1;
                }
            });
        }
        let counted = reached.iter().zip(&played).filter(|(_, played)| **played);
        let mut counts: Vec<usize> = counted.map(|(count, _)| *count).collect();
        counts.sort_unstable();
        let share = |sum: usize| sum as f64 / counts.len().max(1) as f64;
        Responsiveness {
            seconds,
            share: share(counts.iter().filter(|&&count| count > 0).count()),
            mean: share(counts.iter().sum()),
            median: counts.get(counts.len() / 2).copied().unwrap_or(0),
        }
    }
}
