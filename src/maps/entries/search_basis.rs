//! Inputs that all searches of a bake share, and the targets of entries.

use super::limits::MotionLimits;
use super::targets::ClipPlaces;
use super::{EntrySettings, EntryTarget};
use crate::graph::{MotionGraph, Node};
use crate::maps::regions::Evasion;

/// Inputs that all searches of a bake share.
#[derive(Clone, Copy)]
pub(super) struct SearchBasis<'a> {
    pub(super) graph: &'a MotionGraph,
    pub(super) limits: &'a MotionLimits,
    pub(super) places: &'a ClipPlaces,
    /// Number of threads, 0 for one per CPU core.
    pub(super) threads: usize,
}

impl SearchBasis<'_> {
    /// Frames of evasions and their lead-ins, sorted by evasion and frame.
    pub(super) fn targets(
        &self,
        evasions: &[Evasion],
        settings: &EntrySettings,
    ) -> Vec<EntryTarget> {
        let mut settings = *settings;
        settings.target_step = settings.target_step.max(1);
        loop {
            let targets = self.targets_at_steps(evasions, &settings);
            if targets.len() <= (settings.most_targets as usize).max(evasions.len()) {
                return targets;
            }
            settings.target_step += 1;
        }
    }

    fn targets_at_steps(&self, evasions: &[Evasion], settings: &EntrySettings) -> Vec<EntryTarget> {
        let graph = self.graph;
        let frames = |seconds: f32| (f64::from(seconds) * graph.frame_rate()).round() as u32;
        let mut targets = Vec::new();
        for (index, evasion) in evasions.iter().enumerate() {
            let edge = graph.edge(evasion.edge);
            let start = graph.node(edge.from);
            let last = start.frame + edge.frames.min(frames(settings.late));
            let mut frame = start.frame;
            // Parts of the lead-in that are not in the graph cannot be played.
            let earliest = start.frame.saturating_sub(frames(settings.lead_in));
            let step = settings.target_step.max(1);
            let place = |frame: u32| self.places.find(Node { frame, ..start });
            while frame >= earliest + step && place(frame - step).is_some() {
                frame -= step;
            }
            while frame < last && targets.len() < usize::from(u16::MAX) {
                targets.extend(place(frame).map(|at| EntryTarget {
                    evasion: index as u16,
                    frame,
                    edge: at.edge,
                    edge_frame: at.edge_frame,
                }));
                frame += step;
            }
        }
        targets
    }
}
