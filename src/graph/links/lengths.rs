use super::LinkSettings;
use crate::graph::GraphSettings;

/// Lengths and distances of links. Lengths are in frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    /// Length of the graph's windows.
    pub(super) window: usize,
    pub(super) shortest: usize,
    longest: usize,
    pub(super) lead: usize,
    pub(super) spread: usize,
    /// Minimum distance in time of two windows of one clip. Closer windows show the same motion.
    pub(super) separation: usize,
    /// Maximum distance at which a blend has the window's length, in metres.
    pub(super) threshold: f32,
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

    /// Length of a blend between windows at `distance` metres, if `available` frames are available.
    /// Returns `None` if the shortest blend does not fit.
    pub(super) fn blend(&self, distance: f32, available: usize) -> Option<usize> {
        let share = ((distance - self.threshold) / (self.loosest - self.threshold)).clamp(0.0, 1.0);
        // The share is not finite if the maximum distance of links is not above the graph's
        // threshold.
        let share = if share.is_finite() { share } else { 0.0 };
        let more = share * (self.longest - self.window) as f32;
        let blend = (self.window + more.round() as usize).min(available);
        (blend >= self.shortest).then_some(blend)
    }

    /// Cost of a link: its distance, scaled up if the blend is shorter than the window, because it
    /// then covers the distance in less time.
    pub(super) fn cost(&self, distance: f32, blend: usize) -> f32 {
        distance * (self.window as f32 / blend as f32).max(1.0)
    }
}
