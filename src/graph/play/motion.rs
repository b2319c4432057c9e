use crate::anim::{Envelope, JointId, Pose, Warp, slerp};
use crate::graph::ClipId;
use crate::graph::motion_graph::{EdgeId, EventId, MotionGraph};
use crate::graph::play::inertia::{BlendReach, EntryScratch, Inertia, JointReach};
use crate::graph::play::playhead::{MotionStep, Playhead};
use crate::graph::play::sample::ClipPosition;
use crate::math::Rigid2;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// A continuous motion through the graph: the rest of an edge, then the steps of a path, then the
/// default continuation. It can jump to another position of the graph at any time ([`Motion::enter`]).
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Motion {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) warp: Option<Warp>,
    pub(crate) layer: Option<Layer>,
    /// Offsets that fade out, by start time. Only the first `entered` are in use. The others are kept for their memory.
    pub(crate) inertias: Vec<Inertia>,
    pub(crate) entered: usize,
    #[serde(skip)]
    pub(crate) scratch: EntryScratch,
    /// Memory of pieces, for the motion that a cut leaves.
    #[serde(skip)]
    pub(crate) uncut: Vec<Piece>,
}

/// Clones only the offsets in use.
impl Clone for Motion {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, other: &Self) {
        self.pieces.clone_from(&other.pieces);
        self.warp = other.warp;
        self.layer = other.layer;
        self.entered = 0;
        for inertia in other.inertias() {
            match self.inertias.get_mut(self.entered) {
                Some(memory) => memory.clone_from(inertia),
                None => self.inertias.push(inertia.clone()),
            }
            self.entered += 1;
        }
    }
}

impl PartialEq for Motion {
    fn eq(&self, other: &Self) -> bool {
        self.pieces == other.pieces
            && self.warp == other.warp
            && self.layer == other.layer
            && self.inertias() == other.inertias()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Piece {
    pub(crate) playhead: Playhead,
    pub(crate) rate: f32,
    /// Start time, in seconds since the motion's start.
    pub(crate) start: f32,
    pub(crate) end: f32,
}

impl Piece {
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
    pub fn new(graph: &MotionGraph, playhead: Playhead, steps: &[MotionStep]) -> Self {
        let mut motion = Self::default();
        motion.restart(graph, playhead, steps.iter().copied());
        motion
    }

    /// Replaces this motion by [`Motion::new`] of the same arguments, without allocating.
    pub fn restart(
        &mut self,
        graph: &MotionGraph,
        playhead: Playhead,
        steps: impl IntoIterator<Item = MotionStep>,
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

    pub(crate) fn push(&mut self, graph: &MotionGraph, step: MotionStep) {
        if let Some(last) = self.pieces.last() {
            let next = last.followed(graph, step.edge, step.rate);
            self.pieces.push(next);
        }
    }

    /// Appends [`MotionGraph::natural_edge`] repeatedly until the motion lasts at least `seconds`.
    pub fn extend(&mut self, graph: &MotionGraph, seconds: f32) {
        while let Some(last) = self.pieces.last().filter(|last| last.end < seconds) {
            let step = MotionStep {
                edge: graph.natural_edge(last.playhead.next_node(graph)),
                rate: 1.0,
            };
            self.push(graph, step);
        }
    }

    /// Sets or removes the warp, which bends the played poses while its envelope lasts. Parts of the body that the skeleton lacks are not
    /// bent. Default: none.
    pub fn set_warp(&mut self, warp: Option<Warp>) {
        self.warp = warp;
    }

    /// The warp, or `None` if the motion has none.
    pub fn warp(&self) -> Option<&Warp> {
        self.warp.as_ref()
    }

    /// Removes everything. The memory is kept.
    pub fn clear(&mut self) {
        self.pieces.clear();
        self.warp = None;
        self.layer = None;
        self.entered = 0;
    }

    /// Duration, in seconds.
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

    // Positions and poses of a motion at a time.

    /// Playhead after `seconds`. Times before the start or after the end are clamped. A motion that
    /// was never started is at the start of the first edge. During a blend ([`Motion::is_blending`]) the pose differs from the
    /// playhead's.
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

    /// Playback rate after `seconds`; 0 at the end of the motion.
    pub(crate) fn rate(&self, seconds: f32) -> f32 {
        let seconds = self.moment(seconds);
        let index = self.pieces.partition_point(|piece| piece.end < seconds);
        self.pieces.get(index).map_or(0.0, |piece| piece.rate)
    }

    /// Writes the pose after `seconds` to `out`, in the world. Times before the start or after the end are clamped.
    pub fn sample(&self, graph: &MotionGraph, seconds: f32, out: &mut Pose) {
        let seconds = seconds.max(0.0);
        self.sample_unbent(graph, seconds, out);
        if let Some(warp) = &self.warp {
            warp.apply(graph.rigged_skeleton(), seconds, out);
        }
    }

    pub(crate) fn sample_both(&self, graph: &MotionGraph, seconds: [f32; 2], out: &mut [Pose; 2]) {
        for (seconds, pose) in seconds.into_iter().zip(out) {
            self.sample(graph, seconds, pose);
        }
    }

    /// Like [`Motion::sample`], without the bend of a warp. The time shift of the warp still applies.
    pub(crate) fn sample_unbent(&self, graph: &MotionGraph, seconds: f32, out: &mut Pose) {
        self.playhead(graph, seconds).pose(graph, out);
        if let Some(inertia) = self.inertia(self.moment(seconds)) {
            inertia.apply(graph, self.moment(seconds), out);
        }
        if let Some(layer) = &self.layer {
            layer.apply(graph, self.moment(seconds), out);
        }
    }

    /// Whether a blend, a layer or a warp acts at `seconds`, so that the pose is not that of the playhead alone.
    pub(crate) fn is_composed(&self, seconds: f32) -> bool {
        self.is_blending(seconds) || self.is_bent(seconds)
    }

    /// Whether a layer or a warp acts at `seconds`.
    pub(crate) fn is_bent(&self, seconds: f32) -> bool {
        self.is_layered(seconds) || self.warp.is_some_and(|warp| warp.acts_at(seconds))
    }

    /// Time since the start of the blend that acts at `seconds`, in seconds; `None` without one.
    pub(crate) fn blend_age(&self, seconds: f32) -> Option<f32> {
        let moment = self.moment(seconds);
        Some(moment - self.inertia(moment)?.start)
    }

    /// Distances by which the blend that acts at `seconds` moves the body.
    pub(crate) fn blend_reach(
        &self,
        graph: &MotionGraph,
        seconds: f32,
        reaches: &mut Vec<JointReach>,
    ) -> Option<BlendReach> {
        let moment = self.moment(seconds);
        let inertia = self.inertia(moment)?;
        Some(inertia.reach(graph, moment, reaches))
    }

    /// Time of the motion that is played at `seconds`. A warp may shift it.
    pub(crate) fn moment(&self, seconds: f32) -> f32 {
        let seconds = seconds.max(0.0);
        self.warp.map_or(seconds, |warp| warp.moment(seconds))
    }

    /// Position of the root after `seconds`, in the world. It equals the root of [`Motion::sample`]
    /// and is faster.
    pub fn root(&self, graph: &MotionGraph, seconds: f32) -> Vec3 {
        let seconds = seconds.max(0.0);
        let playhead = self.playhead(graph, seconds);
        let root = graph.sample_edge_root(playhead.edge, playhead.frame);
        let moved = self.warp.map_or(Vec3::ZERO, |warp| warp.root(seconds));
        let moment = self.moment(seconds);
        let faded = self
            .inertia(moment)
            .map_or(Vec3::ZERO, |left| left.root(moment));
        playhead.clip_to_world.point(root) + moved + faded
    }

    /// Steps after the first edge, which has already started.
    pub fn steps(&self) -> impl Iterator<Item = MotionStep> + '_ {
        self.pieces.iter().skip(1).map(|piece| MotionStep {
            edge: piece.playhead.edge,
            rate: piece.rate,
        })
    }
}

/// A moment of a motion.
#[derive(Clone, Copy, Debug)]
pub struct MotionMoment<'a> {
    /// The motion.
    pub motion: &'a Motion,
    /// Time since the start of the motion, in seconds.
    pub seconds: f32,
}

impl Motion {
    /// The moment `seconds` after the start.
    pub fn moment_at(&self, seconds: f32) -> MotionMoment<'_> {
        MotionMoment {
            motion: self,
            seconds,
        }
    }
}

// Layers: the upper body plays a part of a clip while pelvis and legs continue.
//
// Source: layered blending with a mask of joints, as in game engines ("layered blend per bone", "avatar mask"). Differs: the spine also
// takes over the difference between the tilt of the clip's pelvis and that of the played pelvis, so that the trunk leans as in the clip.

/// Part of a clip that the upper body plays: spine, arms and head. Pelvis and legs continue their motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Clip whose posture is used.
    pub clip: ClipId,
    /// Frame of the clip at the start of the fade-in.
    pub frame: f32,
    /// Playback rate of the clip.
    pub rate: f32,
    /// Weight of the clip's posture over time.
    pub envelope: Envelope,
    /// Time from which the layer no longer acts because the motion was cut, in seconds since the motion's start.
    #[serde(default)]
    pub(crate) cut: Option<f32>,
}

/// Largest tilt of the clip's pelvis that the spine takes over, in radians: 20°.
const MOST_TILT: f32 = 0.35;

impl Layer {
    #[must_use]
    pub(crate) fn new(start: ClipPosition, rate: f32, envelope: Envelope) -> Self {
        Self {
            clip: start.clip,
            frame: start.frame,
            rate,
            envelope,
            cut: None,
        }
    }

    /// Weight at a time of the motion, 0 to 1.
    pub fn weight(&self, seconds: f32) -> f32 {
        match self.cut {
            Some(cut) if seconds >= cut => 0.0,
            _ => self.envelope.weight(seconds),
        }
    }

    /// Time from which the layer no longer acts, in seconds since the motion's start.
    pub fn end(&self) -> f32 {
        self.envelope.end.min(self.cut.unwrap_or(f32::INFINITY))
    }

    /// Frame of the clip at a time of the motion.
    pub(crate) fn frame_at(&self, graph: &MotionGraph, seconds: f32) -> f32 {
        let frames = (seconds - self.envelope.start) * self.rate * graph.frame_rate() as f32;
        let last = graph.clip(self.clip).frames().saturating_sub(1) as f32;
        (self.frame + frames).clamp(0.0, last)
    }

    /// The layer as it was before a cut at a time of the motion.
    pub(crate) fn before_cut(&self, seconds: f32) -> Self {
        Self {
            cut: self.cut.filter(|&cut| cut < seconds),
            ..*self
        }
    }

    fn since(&self, seconds: f32) -> Self {
        Self {
            envelope: self.envelope.since(seconds),
            cut: self.cut.map(|cut| cut - seconds),
            ..*self
        }
    }

    pub(crate) fn is_sound(&self, graph: &MotionGraph) -> bool {
        let Envelope { start, full, .. } = self.envelope;
        let times = [start, full, self.envelope.release, self.envelope.end];
        let numbers = [self.frame, self.rate, self.cut.unwrap_or(0.0)];
        self.clip.index() < graph.clips().len()
            && times.iter().chain(&numbers).all(|one| one.is_finite())
            && self.rate > 0.0
    }

    /// Moves the upper body of a pose towards that of the clip.
    pub(crate) fn apply(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        let weight = self.weight(seconds);
        if weight <= 0.0 {
            return;
        }
        let rig = graph.rig();
        let moment = graph.clip(self.clip).at(self.frame_at(graph, seconds));
        moment.each_rotation(|joint, wanted| {
            if rig.part(JointId(joint as u16)).is_above_pelvis() {
                let rotation = &mut pose.rotations[joint];
                *rotation = slerp(*rotation, wanted, weight);
            }
        });
        let pelvis = pose.rotations[JointId::ROOT.index()];
        let wanted = moment.rotation(JointId::ROOT.index());
        rig.turn_spine(layer_tilt(pelvis, wanted) * weight, pose);
    }
}

/// Rotation vector, in the space of the motion, that tilts the trunk as the pelvis of the layered clip does.
pub(crate) fn layer_tilt(pelvis: Quat, wanted: Quat) -> Vec3 {
    let turn = heading(pelvis * wanted.conjugate()) * wanted * pelvis.conjugate();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.to_scaled_axis().clamp_length_max(MOST_TILT)
}

/// The component of a rotation about the vertical axis.
pub(crate) fn heading(rotation: Quat) -> Quat {
    let length = rotation.y.hypot(rotation.w);
    match length > 1e-6 {
        true => Quat::from_xyzw(0.0, rotation.y / length, 0.0, rotation.w / length),
        false => Quat::IDENTITY,
    }
}

impl Motion {
    /// Sets or removes the layer of the upper body. It has no effect on a skeleton whose spine, legs and arms are not known. Default: none.
    pub fn set_layer(&mut self, layer: Option<Layer>) {
        self.layer = layer;
    }

    /// The layer of the upper body, or `None` if the motion has none.
    pub fn layer(&self) -> Option<&Layer> {
        self.layer.as_ref()
    }

    /// Whether the layer acts at `seconds`, so that the upper body differs from the playhead.
    pub fn is_layered(&self, seconds: f32) -> bool {
        let moment = self.moment(seconds);
        self.layer.is_some_and(|layer| layer.weight(moment) > 0.0)
    }

    /// The layer with times relative to `seconds`; `None` if it has ended by then.
    pub(crate) fn layer_since(&self, seconds: f32) -> Option<Layer> {
        let layer = self.layer.filter(|layer| layer.end() > seconds)?;
        Some(layer.since(seconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heading_of_a_rotation_leaves_its_tilt() {
        let (turn, tilt) = (Quat::from_rotation_y(0.7), Quat::from_rotation_x(0.3));
        assert!(heading(turn).dot(turn).abs() > 1.0 - 1e-6);
        let left = heading(turn * tilt).conjugate() * turn * tilt;
        assert!(left.dot(tilt).abs() > 1.0 - 1e-4, "{left}");
        assert_eq!(
            heading(Quat::from_rotation_x(std::f32::consts::PI)),
            Quat::IDENTITY
        );
    }
}
