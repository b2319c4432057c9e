//! Stretches of the clips without a branch point: a frame with an entry, an exit, or a choice of edges.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::EntryTable;
use super::targets::ClipPlaces;
use crate::graph::{ClipId, MotionGraph};
use crate::math::sort_rarely;

/// Statistics of the stretches of the clips between two branch points: frames with an entry, an exit, or a choice of edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stretches {
    /// Median duration, weighted by time, in seconds: half of all time lies in stretches of at most this duration.
    pub median: f32,
    /// Longest duration, in seconds.
    pub longest: f32,
}

impl Stretches {
    /// Computes the statistics from the length of each frame's stretch, in frames.
    pub(super) fn of(mut lengths: Vec<u32>, rate: f64) -> Self {
        sort_rarely(&mut lengths, Ord::cmp);
        let seconds = |at: usize| (f64::from(lengths.get(at).copied().unwrap_or(0)) / rate) as f32;
        Self {
            median: seconds(lengths.len() / 2),
            longest: seconds(lengths.len().saturating_sub(1)),
        }
    }
}

/// The frames of a clip that the graph plays.
pub(super) struct PlayedFrames {
    clip: ClipId,
    /// For each frame, whether it belongs to an event; `None` if the graph does not play it.
    pub(super) is_event: Vec<Option<bool>>,
    /// For each frame, whether the graph has a choice of edges there.
    branches: Vec<bool>,
}

impl PlayedFrames {
    pub(super) fn of(graph: &MotionGraph, places: &ClipPlaces, clip: ClipId) -> Self {
        let frames = graph.clip(clip).frames();
        let (mut is_event, mut branches) = (vec![None; frames], vec![false; frames]);
        for &(first, end, edge) in places.of(clip) {
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
    pub(super) fn stretches(mut self, table: &EntryTable) -> Vec<Range<usize>> {
        for (number, moment) in table.moments_of(self.clip).enumerate() {
            let is_branch =
                !table.entries.of(moment).is_empty() || !table.exits.lists.of(moment).is_empty();
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
