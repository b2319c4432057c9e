use crate::anim::Clip;
use crate::graph::distance::Windows;
use crate::graph::feet::Aligner;
use crate::graph::watch::BakeWatch;
use crate::graph::{GraphEvent, GraphSettings};

/// Input of the search for links.
#[derive(Clone, Copy)]
pub(in crate::graph) struct LinkSource<'a> {
    /// Clips, at the graph's frame rate.
    pub(in crate::graph) clips: &'a [Clip],
    /// Points of the clips, and how they are aligned.
    pub(in crate::graph) aligner: Aligner<'a>,
    /// Windows of each cloud, as long as the graph's transitions.
    pub(in crate::graph) windows: &'a [Windows],
    /// Events in frames of the clips. Those that overlap are merged.
    pub(in crate::graph) events: &'a [GraphEvent],
    /// Settings of the graph.
    pub(in crate::graph) settings: &'a GraphSettings,
    pub(in crate::graph) watch: &'a dyn BakeWatch,
}
