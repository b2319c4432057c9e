use super::LinkSettings;
use crate::graph::GraphSettings;

/// How long links blend and how far apart their windows may lie; lengths in frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    /// The graph's window.
    pub(super) window: usize,
    pub(super) shortest: usize,
    longest: usize,
    pub(super) lead: usize,
    pub(super) spread: usize,
    /// Windows of one clip that lie nearer than this to each other are the same motion.
    pub(super) separation: usize,
    /// Up to this distance a blend has the window's length, metres.
    threshold: f32,
    pub(super) loosest: f32,
}

impl Lengths {
    pub(super) fn new(graph: &GraphSettings, links: &LinkSettings) -> Self {
        let window = graph.frames(graph.window);
        Self {
            window,
            shortest: graph.frames(links.shortest).min(window),
            longest: graph.frames(links.longest).max(window),
            lead: (links.lead * graph.frame_rate).round() as usize,
            spread: graph.frames(links.spread),
            separation: graph.frames(graph.separation),
            threshold: graph.threshold,
            loosest: links.loosest,
        }
    }

    /// Frames of a blend between windows that lie `distance` metres apart, where `room` frames can
    /// be had; `None` where the shortest blend has no room.
    pub(super) fn blend(&self, distance: f32, room: usize) -> Option<usize> {
        let share = ((distance - self.threshold) / (self.loosest - self.threshold)).clamp(0.0, 1.0);
        // No share where the loosest is no looser than the graph's own threshold.
        let share = if share.is_finite() { share } else { 0.0 };
        let more = share * (self.longest - self.window) as f32;
        let blend = (self.window + more.round() as usize).min(room);
        (blend >= self.shortest).then_some(blend)
    }

    /// What the distance counts for: a blend that is shorter than the window has to make the same
    /// way in less time.
    pub(super) fn strain(&self, distance: f32, blend: usize) -> f32 {
        distance * (self.window as f32 / blend as f32).max(1.0)
    }
}
