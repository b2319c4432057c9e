//! The parts of a graph that files store separately, so that they can be read in parallel.

use serde::{Deserialize, Serialize};

use super::motion_graph::KnownRig;
use super::section;
use super::{Edge, Feet, GraphEvent, MotionGraph, Node};
use crate::anim::{Clip, Skeleton};
use crate::math::parallel::both;

/// All small parts of a graph, stored together.
#[derive(Deserialize)]
struct Rest {
    skeleton: Skeleton,
    frame_rate: f64,
    events: Vec<GraphEvent>,
    nodes: Vec<Node>,
    first_edge: Vec<u32>,
}

/// [`Rest`] by reference, for writing.
#[derive(Serialize)]
struct RestOf<'a> {
    skeleton: &'a Skeleton,
    frame_rate: f64,
    events: &'a [GraphEvent],
    nodes: &'a [Node],
    first_edge: &'a [u32],
}

impl MotionGraph {
    /// Number of parts.
    pub(crate) const SECTIONS: usize = 4;

    /// Serializes the parts of the graph.
    pub(crate) fn to_sections(&self) -> Result<[Vec<u8>; Self::SECTIONS], postcard::Error> {
        let rest = RestOf {
            skeleton: &self.skeleton,
            frame_rate: self.frame_rate,
            events: &self.events,
            nodes: &self.nodes,
            first_edge: &self.first_edge,
        };
        Ok([
            section::to_bytes(&rest)?,
            section::to_bytes(&self.clips)?,
            section::to_bytes(&self.edges)?,
            section::to_bytes(&self.feet)?,
        ])
    }

    /// Reads the parts of a graph. [`MotionGraph::validate`] checks them.
    pub(crate) fn from_sections(
        [rest, clips, edges, feet]: [&[u8]; Self::SECTIONS],
    ) -> Result<Self, String> {
        let (clips, (edges, (feet, rest))) = both(
            || section::from_bytes::<Vec<Clip>>(clips),
            || {
                let edges = section::from_bytes::<Vec<Edge>>(edges);
                let feet = section::from_bytes::<Feet>(feet);
                (edges, (feet, section::from_bytes::<Rest>(rest)))
            },
        );
        let Rest {
            skeleton,
            frame_rate,
            events,
            nodes,
            first_edge,
        } = rest?;
        Ok(Self {
            skeleton,
            frame_rate,
            clips: clips?,
            events,
            nodes,
            edges: edges?,
            first_edge,
            feet: feet?,
            rig: KnownRig::default(),
        })
    }
}
