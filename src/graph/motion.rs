use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::inertia::{Entry, EntryScratch, Inertia};
use super::{EdgeId, EventId, MotionGraph, NodeId};
use crate::anim::{EventKind, Facing, Pose, Warp, forward_kinematics};
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
/// default continuation. It can jump to another position of the graph at any time ([`Motion::enter`]).
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Motion {
    pub(super) pieces: Vec<Piece>,
    pub(super) warp: Option<Warp>,
    /// Offsets that fade out, by start time. Only the first `entered` are in use; the others are kept as memory.
    pub(super) inertias: Vec<Inertia>,
    pub(super) entered: usize,
    #[serde(skip)]
    pub(super) scratch: EntryScratch,
}

impl PartialEq for Motion {
    fn eq(&self, other: &Self) -> bool {
        self.pieces == other.pieces
            && self.warp == other.warp
            && self.inertias() == other.inertias()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Piece {
    pub(super) playhead: Playhead,
    pub(super) rate: f32,
    /// Start time, in seconds since the motion's start.
    pub(super) start: f32,
    pub(super) end: f32,
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
        self.clear();
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
        self.entered = 0;
        for inertia in other.inertias() {
            match self.inertias.get_mut(self.entered) {
                Some(memory) => memory.clone_from(inertia),
                None => self.inertias.push(inertia.clone()),
            }
            self.entered += 1;
        }
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

    /// Jumps to another position of the graph after `seconds`. The offset of the motion from that position, and its speed, fade out
    /// during the entry's blend. The motion that was planned from there on is dropped.
    pub fn enter(&mut self, graph: &MotionGraph, seconds: f32, entry: &Entry) {
        let mut scratch = std::mem::take(&mut self.scratch);
        let step = (1.0 / graph.frame_rate()) as f32;
        self.extend(graph, seconds + step);
        self.sample(graph, seconds, &mut scratch.from[0]);
        self.sample(graph, seconds + step, &mut scratch.from[1]);
        // What an earlier entry has left is in these poses.
        self.cut(seconds);
        self.push_entry(graph, entry, seconds);
        self.extend(graph, seconds + step);
        for (later, pose) in [0.0, step].into_iter().zip(&mut scratch.to) {
            self.playhead(graph, seconds + later).pose(graph, pose);
        }
        if self.inertias.len() == self.entered {
            self.inertias.push(Inertia::default());
        }
        let times = (seconds, entry.blend.max(step), step);
        self.inertias[self.entered].measure(graph, &mut scratch, times);
        self.entered += 1;
        self.scratch = scratch;
    }

    /// Ends the motion just before `seconds`, so that the next piece starts at that time.
    fn cut(&mut self, seconds: f32) {
        let played = self.pieces.partition_point(|piece| piece.start < seconds);
        self.pieces.truncate(played);
        if let Some(last) = self.pieces.last_mut() {
            last.end = last.end.min(seconds.next_down());
        }
        let begun = |inertia: &Inertia| inertia.start < seconds;
        self.entered = self.inertias[..self.entered].partition_point(begun);
    }

    /// Appends the entry's edge and the edges of its clip up to the end of the evasion, all at the entry's rate.
    fn push_entry(&mut self, graph: &MotionGraph, entry: &Entry, seconds: f32) {
        let rate = entry.rate;
        let playhead = Playhead {
            edge: entry.edge,
            frame: entry.frame,
            clip_to_world: entry.clip_to_world,
        };
        let left = playhead.seconds_to_next_node(graph) / rate;
        self.pieces.push(Piece {
            playhead,
            rate,
            start: seconds,
            end: seconds + left,
        });
        let mut edge = entry.edge;
        let is_evasion = |edge: EdgeId| {
            let event = graph.edge(edge).event;
            event.is_some_and(|event| graph.event(event).kind == EventKind::Evasion)
        };
        /// Upper limit of the number of edges of a lead-in.
        const MOST: usize = 256;
        let mut pushed = 0;
        while !is_evasion(edge) && pushed < MOST {
            edge = graph.natural_edge(graph.edge(edge).to);
            if graph.edge(edge).motion != super::EdgeMotion::Clip {
                break;
            }
            self.push(graph, Step { edge, rate });
            pushed += 1;
        }
    }

    pub(super) fn inertias(&self) -> &[Inertia] {
        &self.inertias[..self.entered]
    }

    /// Offset that still fades out after `seconds`.
    fn inertia(&self, seconds: f32) -> Option<&Inertia> {
        let begun = self
            .inertias()
            .partition_point(|inertia| inertia.start <= seconds);
        let last = self.inertias[..begun].last()?;
        last.lasts(seconds).then_some(last)
    }

    /// Whether the offset of an earlier motion still fades out after `seconds`. The pose then differs from the playhead's.
    #[must_use]
    pub fn is_blending(&self, seconds: f32) -> bool {
        self.inertia(self.moment(seconds)).is_some()
    }

    /// Forgets everything; the memory is kept.
    pub fn clear(&mut self) {
        self.pieces.clear();
        self.warp = None;
        self.entered = 0;
    }

    /// Keeps the offset that fades out after `seconds` of `other`, which this motion continues from its start on. Call it before
    /// any [`Motion::enter`].
    pub fn continue_blend(&mut self, other: &Self, seconds: f32) {
        let Some(left) = other.inertia(seconds) else {
            return;
        };
        self.entered = 0;
        if self.inertias.is_empty() {
            self.inertias.push(Inertia::default());
        }
        self.inertias[0].clone_from(left);
        self.inertias[0].start -= seconds;
        self.entered = 1;
    }

    /// Time until the offset that fades out at the start is gone, in seconds; 0 without one.
    #[must_use]
    pub fn blends_until(&self) -> f32 {
        self.inertia(0.0).map_or(0.0, Inertia::end)
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
        let left = { self.inertias().iter() }.filter(|one| one.lasts(seconds));
        let mut inertias: Vec<Inertia> = left.cloned().collect();
        for inertia in &mut inertias {
            inertia.start -= seconds;
            // Rounding may bring the end of what was left there up to the entry.
            let left =
                |piece: &&mut Piece| piece.start < inertia.start && piece.end >= inertia.start;
            if let Some(piece) = pieces.iter_mut().rev().find(left) {
                piece.end = inertia.start.next_down();
            }
        }
        Self {
            pieces,
            warp,
            entered: inertias.len(),
            inertias,
            scratch: EntryScratch::default(),
        }
    }

    /// Returns the rest of the edge that plays after `seconds`, followed by `steps`, which start at
    /// its end.
    #[must_use]
    pub fn branch(&self, graph: &MotionGraph, seconds: f32, steps: &[Step]) -> Self {
        let mut branch = self.rest(graph, seconds);
        branch.pieces.truncate(1);
        branch.entered = branch.inertias().partition_point(|one| one.start <= 0.0);
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
    /// was never started is at the start of the first edge. During a blend ([`Motion::is_blending`]) the pose differs from the
    /// playhead's.
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
        if let Some(inertia) = self.inertia(self.moment(seconds)) {
            inertia.apply(graph, self.moment(seconds), out);
        }
    }

    /// The time that is played, where a warp shifts it.
    fn moment(&self, seconds: f32) -> f32 {
        self.warp.map_or(seconds, |warp| warp.moment(seconds))
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
        let moment = self.moment(seconds);
        let faded = { self.inertia(moment) }.map_or(Vec3::ZERO, |left| left.root(moment));
        playhead.clip_to_world.point(root) + moved + faded
    }

    /// Steps after the first edge, which has already started.
    pub fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        self.pieces.iter().skip(1).map(|piece| Step {
            edge: piece.playhead.edge,
            rate: piece.rate,
        })
    }
}
