use glam::Vec3;

use super::Attack;
use super::clearance::PlacedEvasion;
use super::retime::Durations;
use crate::graph::{NodeId, Playhead};
use crate::maps::{BakedGraph, NodePath, PathId};
use crate::math::Rigid2;

/// A character somewhere in the graph, and the attack that it has to avoid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Situation<'c> {
    pub playhead: Playhead,
    pub attack: &'c Attack,
    /// Where the motion can branch next.
    pub node: NodeId,
    /// Seconds until there.
    pub wait: f32,
    /// From there to the attack's start, seconds.
    pub available: f32,
    /// The character's frame (root on the ground, facing +Z) there, in the world.
    pub node_frame: Rigid2,
}

impl<'c> Situation<'c> {
    pub(super) fn new(baked: &BakedGraph, playhead: Playhead, attack: &'c Attack) -> Self {
        let graph = baked.graph();
        let playhead = playhead.made_sound(graph);
        let node = playhead.next_node(graph);
        let wait = playhead.seconds_to_next_node(graph);
        Self {
            playhead,
            attack,
            node,
            wait,
            available: attack.start() - wait,
            node_frame: playhead.next_clip_to_world(graph) * baked.placement(node),
        }
    }

    /// How long a path's edges last at rate 1.
    pub(super) fn durations(baked: &BakedGraph, path: &NodePath) -> Durations {
        let seconds = |frames: u16| (f64::from(frames) / baked.graph().frame_rate()) as f32;
        Durations {
            total: seconds(path.frames),
            faster: seconds(path.faster),
            slower: seconds(path.slower),
        }
    }

    /// The evasion that a path ends in, as it is performed `start` seconds from now.
    pub(super) fn evasion<'a>(
        &self,
        baked: &'a BakedGraph,
        path: PathId,
        start: f32,
    ) -> PlacedEvasion<'a> {
        let path = baked.paths().path(path);
        PlacedEvasion {
            track: baked.track(path.evasion as usize),
            placement: self.node_frame * path.placement,
            start,
        }
    }

    /// The root's place at the node, in the character's frame there.
    pub(super) fn root(&self, baked: &BakedGraph) -> Vec3 {
        let graph = baked.graph();
        let node = graph.node(self.node);
        let root = graph.clip(node.clip).root(node.frame as usize);
        baked.placement(self.node).inverse().point(root)
    }
}
