//! Plans of how transitions move their feet.

use rustc_hash::FxHashMap;

use super::LegBlend;
use crate::graph::{Edge, MotionGraph, Node, NodeId, Transition};
use crate::math::Rigid2;

/// A transition, by its clips and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::graph) struct DartKey {
    source: [u32; 2],
    target: [u32; 2],
    frames: u32,
}

/// How a transition moves its feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::graph) struct FootPlan<'a> {
    pub(in crate::graph) root: RootPlan,
    /// Blend of each leg.
    pub(super) legs: &'a [Option<LegBlend>],
}

/// How a transition moves the root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::graph) struct RootPlan {
    /// Transform from the space of the target clip to that of the source clip.
    pub(in crate::graph) align: Rigid2,
    /// Maximum lowering of the root, in metres.
    pub(super) drop: f32,
}

/// Plans of the transitions that were tested.
#[derive(Clone, Debug, Default)]
pub(in crate::graph) struct FootPlans {
    /// Index of each transition in the lists.
    places: FxHashMap<DartKey, u32>,
    /// `None` for transitions in which a foot darts.
    roots: Vec<Option<RootPlan>>,
    /// Blends of all legs, `[transition][leg]`.
    legs: Vec<Option<LegBlend>>,
}

impl FootPlans {
    /// Whether a foot darts in a transition; `None` if it was not tested.
    pub(super) fn darts(&self, key: &DartKey) -> Option<bool> {
        let place = *self.places.get(key)?;
        Some(self.roots[place as usize].is_none())
    }

    /// Adds the result for a transition, unless it is known.
    pub(super) fn add(&mut self, key: DartKey, root: Option<RootPlan>, legs: &[Option<LegBlend>]) {
        let end = self.roots.len() as u32;
        if *self.places.entry(key).or_insert(end) == end {
            self.roots.push(root);
            self.legs.extend_from_slice(legs);
        }
    }

    /// The plan of a transition; `None` if there is none, or a foot darts.
    pub(in crate::graph) fn get(&self, key: &DartKey) -> Option<FootPlan<'_>> {
        let place = *self.places.get(key)? as usize;
        let legs = self.legs.len() / self.roots.len();
        Some(FootPlan {
            root: self.roots[place]?,
            legs: &self.legs[place * legs..(place + 1) * legs],
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.places.is_empty()
    }
}

impl DartKey {
    pub(in crate::graph) fn of(transition: &Transition) -> Self {
        let place = |clip: usize, frame: usize| [clip as u32, frame as u32];
        Self {
            source: place(transition.source_clip, transition.source_frame),
            target: place(transition.target_clip, transition.target_frame),
            frames: transition.frames as u32,
        }
    }

    /// The transition of an edge.
    pub(super) fn of_edge(graph: &MotionGraph, edge: &Edge) -> Self {
        let place = |node: NodeId| {
            let Node { clip, frame } = graph.node(node);
            [clip.0, frame]
        };
        Self {
            source: place(edge.from),
            target: place(edge.to),
            frames: edge.frames,
        }
    }
}
