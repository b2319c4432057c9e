use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{EdgeId, EventId, MotionGraph, NodeId};
use crate::anim::{Facing, Pose, Warp, forward_kinematics};
use crate::math::Rigid2;

/// A character's position in the graph and in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Playhead {
    /// Edge that is playing.
    pub edge: EdgeId,
    /// Time since the edge's start, in frames.
    pub frame: f32,
    /// Transform from the space of the clip in which the edge starts to the world.
    pub clip_to_world: Rigid2,
}

impl Playhead {
    /// Playhead at a frame of an edge, with the character's frame (root on the ground, facing) at
    /// `world`.
    #[must_use]
    pub fn at(graph: &MotionGraph, edge: EdgeId, frame: f32, world: Rigid2) -> Self {
        let start = Self {
            edge,
            frame,
            clip_to_world: Rigid2::IDENTITY,
        };
        Self {
            clip_to_world: world * start.placement(graph).inverse(),
            ..start
        }
    }

    /// Whether the graph has this edge and frame and the transform is finite. It checks playheads
    /// that come from a file.
    #[must_use]
    pub fn is_sound(&self, graph: &MotionGraph) -> bool {
        /// Maximum distance from the origin, in metres.
        const FURTHEST: f32 = 10_000.0;
        let edge = graph.edges().get(self.edge.index());
        edge.is_some_and(|edge| (0.0..=edge.frames as f32).contains(&self.frame))
            && self.clip_to_world.is_sound(FURTHEST)
    }

    /// Returns a valid playhead: this one if the graph has its edge and frame. Otherwise the frame
    /// is clamped to the edge, and the transform is the identity if it is not finite or more than
    /// 10,000 km from the origin. Queries and motions use this for invalid input.
    ///
    /// # Panics
    /// Panics if the graph has no such edge, for example because the playhead belongs to another
    /// graph.
    #[must_use]
    pub fn sanitized(self, graph: &MotionGraph) -> Self {
        /// Distance beyond which a transform is replaced, in metres.
        const NOWHERE: f32 = 1e7;
        let last = graph.edge(self.edge).frames as f32;
        let sound = self.clip_to_world.is_sound(NOWHERE);
        Self {
            edge: self.edge,
            // `f32::max` turns NaN into 0.
            frame: self.frame.max(0.0).min(last),
            clip_to_world: match sound {
                true => self.clip_to_world,
                false => Rigid2::IDENTITY,
            },
        }
    }

    /// Writes the pose in the world to `out`.
    pub fn pose(&self, graph: &MotionGraph, out: &mut Pose) {
        graph.sample_edge(self.edge, self.frame, out);
        out.place(self.clip_to_world);
    }

    /// Character's frame in the world: root on the ground, facing direction.
    #[must_use]
    pub fn placement(&self, graph: &MotionGraph) -> Rigid2 {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        self.pose(graph, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Facing::of(graph.skeleton()).placement(&joints)
    }

    /// Node at the edge's end.
    #[must_use]
    pub fn next_node(&self, graph: &MotionGraph) -> NodeId {
        graph.edge(self.edge).to
    }

    /// Time until the next node at rate 1, in seconds.
    #[must_use]
    pub fn seconds_to_next_node(&self, graph: &MotionGraph) -> f32 {
        (graph.edge(self.edge).frames as f32 - self.frame) / graph.frame_rate() as f32
    }

    /// Transform from the space of the clip in which the edge ends to the world.
    #[must_use]
    pub fn next_clip_to_world(&self, graph: &MotionGraph) -> Rigid2 {
        self.clip_to_world * graph.clip_change(self.edge)
    }
}

/// One edge of a path, with its playback rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Edge to play.
    pub edge: EdgeId,
    /// Playback rate, above 0. At rate 2 the edge plays twice as fast.
    pub rate: f32,
}

/// A continuous motion through the graph: the rest of an edge, then the steps of a path, then the
/// default continuation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    pieces: Vec<Piece>,
    warp: Option<Warp>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    playhead: Playhead,
    rate: f32,
    /// Start time, in seconds since the motion's start.
    start: f32,
    end: f32,
}

impl Piece {
    /// Piece that follows this one and plays `edge`.
    fn followed(&self, graph: &MotionGraph, edge: EdgeId, rate: f32) -> Self {
        Self {
            playhead: Playhead {
                edge,
                frame: 0.0,
                clip_to_world: self.playhead.next_clip_to_world(graph),
            },
            rate,
            start: self.end,
            end: self.end + graph.seconds(edge) / rate,
        }
    }
}

impl Motion {
    /// Motion that starts at `playhead` and follows `steps`.
    ///
    /// The first step must start at the playhead's next node, and each later step at the end of the
    /// step before it.
    #[must_use]
    pub fn new(graph: &MotionGraph, playhead: Playhead, steps: &[Step]) -> Self {
        let mut motion = Self::default();
        motion.restart(graph, playhead, steps.iter().copied());
        motion
    }

    /// Replaces this motion by [`Motion::new`] of the same arguments, without allocating.
    pub fn restart(
        &mut self,
        graph: &MotionGraph,
        playhead: Playhead,
        steps: impl IntoIterator<Item = Step>,
    ) {
        let playhead = playhead.sanitized(graph);
        self.warp = None;
        self.pieces.clear();
        self.pieces.push(Piece {
            playhead,
            rate: 1.0,
            start: 0.0,
            end: playhead.seconds_to_next_node(graph),
        });
        for step in steps {
            self.push(graph, step);
        }
    }

    /// Like [`Motion::restart`], for steps in reverse order.
    pub fn restart_backwards(
        &mut self,
        graph: &MotionGraph,
        playhead: Playhead,
        steps: impl IntoIterator<Item = Step>,
    ) {
        self.restart(graph, playhead, []);
        // The edges and rates are final; the times and transforms are computed below.
        let first = self.pieces[0];
        self.pieces.extend(steps.into_iter().map(|step| Piece {
            playhead: Playhead {
                edge: step.edge,
                ..first.playhead
            },
            rate: step.rate,
            ..first
        }));
        self.pieces[1..].reverse();
        let count = self.pieces.len();
        for index in 1..count {
            let Piece { playhead, rate, .. } = self.pieces[index];
            self.pieces[index] = self.pieces[index - 1].followed(graph, playhead.edge, rate);
        }
    }

    fn push(&mut self, graph: &MotionGraph, step: Step) {
        if let Some(last) = self.pieces.last() {
            let next = last.followed(graph, step.edge, step.rate);
            self.pieces.push(next);
        }
    }

    /// Appends [`MotionGraph::natural_edge`] repeatedly until the motion lasts at least `seconds`.
    pub fn extend(&mut self, graph: &MotionGraph, seconds: f32) {
        while let Some(last) = self.pieces.last().filter(|last| last.end < seconds) {
            let step = Step {
                edge: graph.natural_edge(last.playhead.next_node(graph)),
                rate: 1.0,
            };
            self.push(graph, step);
        }
    }

    /// Becomes another motion, in the memory that it has.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.pieces.clone_from(&other.pieces);
        self.warp = other.warp;
    }

    /// Bends what is played for a moment, or, with `None`, no longer does. The graph's skeleton may lack the parts: what it lacks is not bent.
    pub fn bend(&mut self, warp: Option<Warp>) {
        self.warp = warp;
    }

    /// How it is bent.
    #[must_use]
    pub fn warp(&self) -> Option<&Warp> {
        self.warp.as_ref()
    }

    /// Returns the motion that remains after `seconds`: the edge that plays then, at its rate, and
    /// everything after it.
    #[must_use]
    pub fn rest(&self, graph: &MotionGraph, seconds: f32) -> Self {
        let warp = { self.warp }.filter(|warp| warp.envelope.end > seconds);
        let moment = warp.map_or(seconds, |warp| warp.moment(seconds).min(seconds));
        let index = self.pieces.partition_point(|piece| piece.end < moment);
        let first = index.min(self.pieces.len().saturating_sub(1));
        let mut pieces = self.pieces[first..].to_vec();
        for piece in &mut pieces {
            piece.start -= seconds;
            piece.end -= seconds;
        }
        if let Some(begun) = pieces.first_mut().filter(|_| warp.is_none()) {
            begun.playhead = self.playhead(graph, seconds);
            begun.start = 0.0;
            begun.end = begun.end.max(0.0);
        }
        let warp = warp.map(|warp| Warp {
            envelope: warp.envelope.since(seconds),
            ..warp
        });
        Self { pieces, warp }
    }

    /// Returns the rest of the edge that plays after `seconds`, followed by `steps`, which start at
    /// its end.
    #[must_use]
    pub fn branch(&self, graph: &MotionGraph, seconds: f32, steps: &[Step]) -> Self {
        let mut branch = self.rest(graph, seconds);
        branch.pieces.truncate(1);
        for &step in steps {
            branch.push(graph, step);
        }
        branch
    }

    /// Duration, in seconds.
    #[must_use]
    pub fn duration(&self) -> f32 {
        self.pieces.last().map_or(0.0, |last| last.end)
    }

    /// Events that the motion plays, each with its start and end in seconds since the motion's
    /// start. If the motion starts inside an event, the rest of it counts.
    pub fn events<'a>(
        &'a self,
        graph: &'a MotionGraph,
    ) -> impl Iterator<Item = (EventId, [f32; 2])> + 'a {
        self.pieces.iter().filter_map(|piece| {
            let event = graph.edge(piece.playhead.edge).event?;
            Some((event, [piece.start.max(0.0), piece.end]))
        })
    }

    /// Playhead after `seconds`. Times before the start or after the end are clamped. A motion that
    /// was never started is at the start of the first edge.
    #[must_use]
    pub fn playhead(&self, graph: &MotionGraph, seconds: f32) -> Playhead {
        let seconds = self.warp.map_or(seconds, |warp| warp.moment(seconds));
        let index = self.pieces.partition_point(|piece| piece.end < seconds);
        let Some(piece) = self.pieces.get(index).or(self.pieces.last()) else {
            return Playhead {
                edge: EdgeId(0),
                frame: 0.0,
                clip_to_world: Rigid2::IDENTITY,
            };
        };
        let frames = (seconds - piece.start).max(0.0) * piece.rate * graph.frame_rate() as f32;
        let longest = graph.edge(piece.playhead.edge).frames as f32;
        Playhead {
            frame: (piece.playhead.frame + frames).min(longest),
            ..piece.playhead
        }
    }

    /// Writes the pose after `seconds` to `out`, in the world.
    pub fn sample(&self, graph: &MotionGraph, seconds: f32, out: &mut Pose) {
        self.sample_unbent(graph, seconds, out);
        self.apply_warp(graph, seconds, out);
    }

    /// The same as if it were not bent, but for the time at which it is.
    pub(crate) fn sample_unbent(&self, graph: &MotionGraph, seconds: f32, out: &mut Pose) {
        self.playhead(graph, seconds).pose(graph, out);
    }

    /// Bends the pose of a moment, which was sampled without.
    pub fn apply_warp(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        if let Some(warp) = &self.warp {
            warp.apply((graph.skeleton(), graph.rig()), seconds, pose);
        }
    }

    /// Position of the root after `seconds`, in the world. It equals the root of [`Motion::sample`]
    /// and is faster.
    #[must_use]
    pub fn root(&self, graph: &MotionGraph, seconds: f32) -> Vec3 {
        let playhead = self.playhead(graph, seconds);
        let root = graph.sample_edge_root(playhead.edge, playhead.frame);
        let moved = self.warp.map_or(Vec3::ZERO, |warp| warp.root(seconds));
        playhead.clip_to_world.point(root) + moved
    }

    /// Steps after the first edge, which has already started.
    pub fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        self.pieces.iter().skip(1).map(|piece| Step {
            edge: piece.playhead.edge,
            rate: piece.rate,
        })
    }
}
