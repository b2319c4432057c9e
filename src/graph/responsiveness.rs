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
        self.responsiveness_within(&[seconds], 1)[0]
    }

    /// [`MotionGraph::responsiveness`] for several times, computed by `threads` threads.
    pub(super) fn responsiveness_within(
        &self,
        seconds: &[f64],
        threads: usize,
    ) -> Vec<Responsiveness> {
        let limits: Vec<u32> = seconds
            .iter()
            .map(|&seconds| within(seconds, self.frame_rate))
            .collect();
        let (moments, jumps, played) = moments::of_graph(self);
        let horizon = limits.iter().copied().max().unwrap_or(0);
        let mut waits = Waits::new(&moments, &jumps, horizon);
        let evasions = self.edges_with(EventKind::Evasion);
        let starts = evasions.map(|(edge, _)| {
            let start = self.node(self.edge(edge).from);
            moments.at(start.clip.index(), start.frame as usize)
        });
        let starts: Vec<u32> = starts.collect();
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
