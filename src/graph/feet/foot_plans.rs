//! Plans of how transitions move their feet, and the keys that they are recorded by.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::LegBlend;
use crate::anim::Skeleton;
use crate::graph::{ClipMatch, Edge, MotionGraph, Node, NodeId, Transition};
use crate::math::Rigid2;
use sabaki_motion::internal::sort_rarely;

/// A transition, by its clips and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(in crate::graph) struct DartKey {
    source: [u32; 2],
    target: [u32; 2],
    frames: u32,
}

/// Plans by transition. `None` is a transition in which a foot darts.
pub(in crate::graph) type FootPlans = FxHashMap<DartKey, Option<FootPlan>>;

/// Plans with their transitions, sorted, as they are recorded.
pub(in crate::graph) type FootPlanList = Vec<(DartKey, Option<FootPlan>)>;

/// Sorts plans by transition.
pub(in crate::graph) fn sorted(plans: FootPlans) -> FootPlanList {
    let mut list: FootPlanList = plans.into_iter().collect();
    sort_rarely(&mut list, |(a, _), (b, _)| a.cmp(b));
    list
}

/// How a transition moves its feet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::graph) struct FootPlan {
    /// Transform from the space of the target clip to that of the source clip.
    pub(in crate::graph) align: Rigid2,
    /// Blend of each leg.
    pub(super) legs: Box<[Option<LegBlend>]>,
    pub(super) root_drop: f32,
}

impl FootPlan {
    /// Whether this can be the plan of a transition on a skeleton with `legs` legs. It checks plans that come from a file.
    pub(super) fn is_sound(&self, key: DartKey, legs: usize) -> bool {
        let furthest = Skeleton::FURTHEST;
        let mut blends = self.legs.iter().flatten();
        self.legs.len() == legs
            && blends.all(|blend| blend.is_sound(key.frames, furthest))
            && self.align.is_sound(4.0 * furthest)
            && (0.0..=furthest).contains(&self.root_drop)
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

    /// Key of the same transition in this bake, or `None` if one of its clips was removed.
    pub(super) fn now(self, clips: &ClipMatch) -> Option<Self> {
        let place = |[clip, frame]: [u32; 2]| Some([clips.now(clip)?, frame]);
        Some(Self {
            source: place(self.source)?,
            target: place(self.target)?,
            ..self
        })
    }
}
