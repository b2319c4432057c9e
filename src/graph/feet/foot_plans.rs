//! Plans of how transitions move their feet, and the keys that they are recorded by.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::LegBlend;
use crate::anim::Skeleton;
use crate::graph::{ClipMatch, Edge, MotionGraph, Node, NodeId, Transition};
use crate::math::{Rigid2, sorted_indices};

/// A transition, by its clips and frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::graph) struct RootPlan {
    /// Transform from the space of the target clip to that of the source clip.
    pub(in crate::graph) align: Rigid2,
    /// Maximum lowering of the root, in metres.
    pub(super) drop: f32,
}

/// Plans of transitions: of this bake, and those of earlier bakes that it may take over.
#[derive(Clone, Debug, Default)]
pub(in crate::graph) struct FootPlans {
    /// Index of each transition in the lists.
    places: FxHashMap<DartKey, u32>,
    list: FootPlanList,
    /// For each transition, whether this bake has tested it or taken it over.
    is_used: Vec<bool>,
}

/// Transitions and their plans, as they are recorded: sorted by transition.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::graph) struct FootPlanList {
    keys: Vec<DartKey>,
    /// `None` for transitions in which a foot darts.
    roots: Vec<Option<RootPlan>>,
    /// Blends of all legs, `[transition][leg]`.
    legs: Vec<Option<LegBlend>>,
}

impl FootPlans {
    /// Index of a transition that was tested, by this bake or an earlier one.
    pub(super) fn place(&self, key: &DartKey) -> Option<u32> {
        self.places.get(key).copied()
    }

    /// Takes over the result at an index. Returns whether a foot darts.
    pub(super) fn take(&mut self, place: u32) -> bool {
        self.is_used[place as usize] = true;
        self.list.roots[place as usize].is_none()
    }

    /// Adds the result for a transition, unless it is known. Returns its index.
    pub(super) fn add(
        &mut self,
        key: DartKey,
        root: Option<RootPlan>,
        legs: &[Option<LegBlend>],
    ) -> u32 {
        let end = self.list.keys.len() as u32;
        let place = *self.places.entry(key).or_insert(end);
        if place == end {
            self.list.push(key, root, legs);
            self.is_used.push(false);
        }
        place
    }

    /// The plan of a transition; `None` if there is none, or a foot darts.
    pub(in crate::graph) fn get(&self, key: &DartKey) -> Option<FootPlan<'_>> {
        let place = self.place(key)? as usize;
        Some(FootPlan {
            root: self.list.roots[place]?,
            legs: self.list.legs_of(place),
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Adds the plans of an earlier bake on a skeleton with `legs` legs. Those that are not sound, and those of clips that were removed,
    /// are left out.
    pub(super) fn add_earlier(&mut self, clips: &ClipMatch, earlier: &FootPlanList, legs: usize) {
        let FootPlanList { keys, roots, .. } = earlier;
        if roots.len() != keys.len() || earlier.legs.len() != keys.len() * legs {
            return;
        }
        self.places.reserve(keys.len());
        for (place, (&key, &root)) in keys.iter().zip(roots).enumerate() {
            let legs = &earlier.legs[place * legs..(place + 1) * legs];
            let is_sound = root.is_none_or(|root| FootPlan { root, legs }.is_sound(key));
            let Some(key) = key.now(clips).filter(|_| is_sound) else {
                continue;
            };
            self.add(key, root, legs);
        }
    }

    /// The plans that this bake has used.
    pub(in crate::graph) fn into_used(self) -> FootPlanList {
        self.into_list(false)
    }

    /// All plans, of this bake and of earlier ones.
    pub(in crate::graph) fn into_all(self) -> FootPlanList {
        self.into_list(true)
    }

    fn into_list(self, all: bool) -> FootPlanList {
        let Self { list, is_used, .. } = self;
        let keys = &list.keys;
        // The plans of an earlier bake are sorted.
        let order = sorted_indices(keys.len(), &|&a, &b| keys[a].cmp(&keys[b]));
        let mut sorted = FootPlanList::default();
        for place in order.into_iter().filter(|&place| all || is_used[place]) {
            sorted.push(keys[place], list.roots[place], list.legs_of(place));
        }
        sorted
    }
}

impl FootPlanList {
    fn push(&mut self, key: DartKey, root: Option<RootPlan>, legs: &[Option<LegBlend>]) {
        self.keys.push(key);
        self.roots.push(root);
        self.legs.extend_from_slice(legs);
    }

    fn legs_of(&self, place: usize) -> &[Option<LegBlend>] {
        let legs = self.legs.len() / self.keys.len();
        &self.legs[place * legs..(place + 1) * legs]
    }
}

impl FootPlan<'_> {
    /// Whether this can be the plan of a transition. It checks plans that come from a file.
    fn is_sound(self, key: DartKey) -> bool {
        let furthest = Skeleton::FURTHEST;
        let mut blends = self.legs.iter().flatten();
        blends.all(|blend| blend.is_sound(key.frames, furthest))
            && self.root.align.is_sound(4.0 * furthest)
            && (0.0..=furthest).contains(&self.root.drop)
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
