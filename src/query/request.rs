//! A query of a baked graph, and its requests.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::attack::Attack;
use super::clearance::{NearObstacles, PlayedTrack};
use super::obstacle::Obstacle;
use super::settings::{QuerySettings, QuerySettingsError};
use crate::graph::{EdgeId, Motion, MotionGraph, MotionMoment, NodeId, Played, Playhead};
use crate::maps::{BakedGraph, NodePath, PathId};
use crate::math::Rigid2;

/// Finds motions of a baked graph that avoid attacks. The [module](super) shows how.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    pub(super) baked: &'a BakedGraph,
    pub(super) settings: &'a QuerySettings,
}

/// Input of a [`Query`](super::Query): a character, and the attack that it has to avoid.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// Position of the character in graph and world.
    pub playhead: Playhead,
    /// Attack, in the same world. Its times count from now.
    pub attack: &'a Attack,
    /// Motion that the character is playing. It is needed during a blend, a layer or a warp, so that the offset from the playhead fades out in
    /// every candidate. Default: none.
    pub playing: Option<MotionMoment<'a>>,
    /// Which candidates are tested exactly. Default: [`Evaluation::Lazy`].
    pub evaluation: Evaluation,
    /// Obstacles at their current positions, which no candidate may enter. Default: none.
    pub obstacles: &'a [Obstacle],
}

/// Which candidates are tested exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Evaluation {
    /// Tests only the candidates that the choice depends on.
    ///
    /// Candidates that the maps remove are tested only if no other candidate is clean. A candidate that could not win even at
    /// distance 0 is not tested. With a negative weight of distance every candidate is tested. Evasions are tested on their baked body
    /// track, moves at every fourth sample first. The winner is tested once more, on its final motion.
    #[default]
    #[serde(rename = "needed")]
    Lazy,
    /// Tests every candidate that the maps keep, posed at every sample of the whole attack. The paper does this.
    #[serde(rename = "kept")]
    Kept,
    /// Tests every candidate, posed at every sample of the whole attack, and ignores the maps. The culling path `exact` does this. It is the
    /// reference for all other paths.
    #[serde(rename = "all")]
    Exhaustive,
}

/// Differences of a query of a plan from an ordinary query.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanScope<'a> {
    /// Attack of the request without the margin. If no motion avoids the request's attack, one that avoids this attack is chosen.
    pub plain: &'a Attack,
    /// Margin by which the radii of the request's attack are larger, in metres.
    pub margin: f32,
    /// Whether only paths to an evasion are candidates, because an earlier query has tested the others.
    pub evasions_only: bool,
    /// Where the query begins: those candidates of earlier stages that a plan a frame before has tested were all hit.
    pub first_stage: PlanStage,
    /// Velocity over the ground that the goal asks for (x, z), in metres per second.
    pub velocity: Vec2,
}

/// The candidates of a query that are tested one after the other until some are clean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum PlanStage {
    /// The evasions of the grid.
    #[default]
    Grid,
    Evasions,
    /// Layers and entries.
    Entries,
    /// Moves, and the warps of hits.
    Moves,
}

impl PlanStage {
    pub(crate) const ALL: [Self; 4] = [Self::Grid, Self::Evasions, Self::Entries, Self::Moves];

    pub(crate) fn next(self) -> Option<Self> {
        Self::ALL.get(self as usize + 1).copied()
    }
}

/// The paths from a node to evasions. The queries of a plan begin at the same node, and restore them once.
#[derive(Clone, Debug, Default)]
struct EvasionPaths {
    paths: Vec<NodePath>,
    first: PathId,
    /// The graph and the node.
    from: Option<(Arc<()>, NodeId)>,
}

impl EvasionPaths {
    fn set(&mut self, baked: &BakedGraph, node: NodeId) {
        let table = baked.paths();
        let is_same = |(graph, from): &(Arc<()>, NodeId)| {
            Arc::ptr_eq(graph, baked.identity()) && *from == node
        };
        if self.from.as_ref().is_some_and(is_same) {
            return;
        }
        self.from = Some((Arc::clone(baked.identity()), node));
        self.first = table.ids(node).next().unwrap_or_default();
        table.write_paths(node, &mut self.paths);
    }
}

/// A request with its own copy of the attack, and the node where the motion can branch next.
#[derive(Clone, Debug)]
pub(super) struct ActiveRequest {
    pub playhead: Playhead,
    pub attack: Attack,
    /// Motion with the offset that still fades out; empty without one.
    pub blend: Motion,
    pub evaluation: Evaluation,
    pub obstacles: NearObstacles,
    pub node: NodeId,
    paths: EvasionPaths,
    /// Time until the playhead reaches the next node, in seconds.
    pub wait: f32,
    /// Time from the next node to the attack's start, in seconds.
    pub available: f32,
    /// The character's frame (root on the ground, facing +Z) at the node, in the world.
    pub node_frame: Rigid2,
    /// Attack without the margin. It is used only if there is a margin.
    pub plain: Attack,
    /// Margin by which the radii of `attack` are larger, in metres; 0 for none.
    pub margin: f32,
    pub evasions_only: bool,
    pub first_stage: PlanStage,
    /// Whether the request is that of a plan, which has no use for a hit that no warp makes clean.
    pub is_plan: bool,
    pub velocity: Vec2,
}

impl<'a> Query<'a> {
    /// Creates a query with settings that the program has chosen.
    ///
    /// Settings out of range (see [`QuerySettings::check`]) are used as they are. Nothing panics, but the query is slow or the
    /// answer is poor. Use [`Query::checked`] for settings from other sources.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, settings: &'a QuerySettings) -> Self {
        Self { baked, settings }
    }

    /// Creates a query with settings from a file or a user.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn checked(
        baked: &'a BakedGraph,
        settings: &'a QuerySettings,
    ) -> Result<Self, QuerySettingsError> {
        settings.check()?;
        Ok(Self::new(baked, settings))
    }
}

impl<'a> Request<'a> {
    /// Creates a request with lazy evaluation and without obstacles.
    #[must_use]
    pub fn new(playhead: Playhead, attack: &'a Attack) -> Self {
        Self {
            playhead,
            attack,
            playing: None,
            evaluation: Evaluation::Lazy,
            obstacles: &[],
        }
    }

    /// Creates a request for a character that is at a moment of a motion.
    #[must_use]
    pub fn from_motion(graph: &MotionGraph, playing: MotionMoment<'a>, attack: &'a Attack) -> Self {
        let playhead = playing.motion.playhead(graph, playing.seconds);
        Self {
            playing: Some(playing),
            ..Self::new(playhead, attack)
        }
    }
}

impl Default for ActiveRequest {
    fn default() -> Self {
        Self {
            playhead: Playhead {
                edge: EdgeId(0),
                frame: 0.0,
                clip_to_world: Rigid2::IDENTITY,
            },
            attack: Attack::empty(),
            blend: Motion::default(),
            evaluation: Evaluation::Lazy,
            obstacles: NearObstacles::default(),
            node: NodeId(0),
            paths: EvasionPaths::default(),
            wait: 0.0,
            available: 0.0,
            node_frame: Rigid2::IDENTITY,
            plain: Attack::empty(),
            margin: 0.0,
            evasions_only: false,
            first_stage: PlanStage::Grid,
            is_plan: false,
            velocity: Vec2::ZERO,
        }
    }
}

impl ActiveRequest {
    /// Replaces the request. The attack is copied into existing memory.
    pub(super) fn set(&mut self, baked: &BakedGraph, request: Request<'_>) {
        let graph = baked.graph();
        let playhead = request.playhead.sanitized(graph);
        self.attack.copy_from(request.attack);
        (self.margin, self.evasions_only) = (0.0, false);
        (self.first_stage, self.is_plan) = (PlanStage::Grid, false);
        self.velocity = Vec2::ZERO;
        self.playhead = playhead;
        self.evaluation = request.evaluation;
        let root = graph.sample_edge_root(playhead.edge, playhead.frame);
        let middle = playhead.clip_to_world.point(root);
        self.obstacles.set(baked, request.obstacles, middle);
        self.blend.clear();
        if let Some(playing) = request.playing {
            self.set_blend(baked.graph(), playing);
        }
        self.node = playhead.next_node(graph);
        self.paths.set(baked, self.node);
        self.wait = playhead.seconds_to_next_node(graph);
        self.available = self.attack.start() - self.wait;
        self.node_frame = playhead.next_clip_to_world(graph) * baked.placement(self.node);
    }

    pub(super) fn limit(&mut self, scope: PlanScope<'_>) {
        self.plain.copy_from(scope.plain);
        (self.margin, self.evasions_only) = (scope.margin, scope.evasions_only);
        (self.first_stage, self.is_plan) = (scope.first_stage, true);
        self.velocity = scope.velocity;
    }

    /// Whether a plan's attack fills the room. What it hits is tested faster than its cells are found and its maps drawn.
    pub(super) fn fills_room(&self) -> bool {
        /// Largest section of an attack that does not, in square metres: that of a body.
        const WIDEST: f32 = 1.0;
        self.is_plan && self.attack.section() > WIDEST
    }

    /// Keeps the offset that fades out. A layer of the upper body or a warp becomes such an offset.
    fn set_blend(&mut self, graph: &MotionGraph, playing: MotionMoment<'_>) {
        /// Time in which a layer or a warp fades out, in seconds.
        const BENT: f32 = 0.25;
        let MotionMoment { motion, seconds } = playing;
        if !motion.is_bent(seconds) {
            self.blend.continue_blend(motion, seconds);
            return;
        }
        self.blend.restart(graph, self.playhead, []);
        let played = Played {
            motion,
            seconds,
            rate: 1.0,
        };
        self.blend.blend_from(graph, played, BENT);
    }

    pub(super) fn paths(&self) -> impl Iterator<Item = (PathId, &NodePath)> {
        let ids = (self.paths.first.0..).map(PathId);
        ids.zip(&self.paths.paths)
    }

    pub(super) fn path(&self, id: PathId) -> &NodePath {
        &self.paths.paths[(id.0 - self.paths.first.0) as usize]
    }

    /// The evasion at the end of a path, performed `start` seconds from now.
    pub(super) fn evasion<'a>(
        &self,
        baked: &'a BakedGraph,
        path: PathId,
        start: f32,
    ) -> PlayedTrack<'a> {
        let path = self.path(path);
        let track = baked.track(path.goal as usize);
        PlayedTrack::new(track, self.node_frame * path.placement, start)
    }

    pub(super) fn is_among_obstacles(&self) -> bool {
        !self.obstacles.obstacles.is_empty()
    }

    /// Whether candidates that enter an obstacle are removed. An exhaustive evaluation measures all candidates.
    pub(super) fn removes_blocked(&self) -> bool {
        self.evaluation == Evaluation::Lazy && self.is_among_obstacles()
    }

    /// The root's position at the node, in the character's frame there.
    pub(super) fn root(&self, baked: &BakedGraph) -> Vec3 {
        let graph = baked.graph();
        let node = graph.node(self.node);
        let root = graph.clip(node.clip).root(node.frame as usize);
        baked.placement(self.node).inverse().point(root)
    }
}
