//! Positions and poses of a motion at a time.

use glam::Vec3;

use super::Motion;
use crate::anim::Pose;
use crate::graph::inertia::{BlendReach, JointReach};
use crate::graph::{EdgeId, MotionGraph, MotionStep, Playhead};
use crate::math::Rigid2;

impl Motion {
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

    /// Playback rate after `seconds`; 0 at the end of the motion.
    pub(crate) fn rate(&self, seconds: f32) -> f32 {
        let seconds = self.moment(seconds);
        let index = self.pieces.partition_point(|piece| piece.end < seconds);
        self.pieces.get(index).map_or(0.0, |piece| piece.rate)
    }

    /// Writes the pose after `seconds` to `out`, in the world.
    pub fn sample(&self, graph: &MotionGraph, seconds: f32, out: &mut Pose) {
        self.sample_unbent(graph, seconds, out);
        self.apply_warp(graph, seconds, out);
    }

    /// Writes the poses of two moments.
    pub(in crate::graph) fn sample_both(
        &self,
        graph: &MotionGraph,
        seconds: [f32; 2],
        out: &mut [Pose; 2],
    ) {
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
        self.apply_layer(graph, seconds, out);
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
    pub(super) fn moment(&self, seconds: f32) -> f32 {
        self.warp.map_or(seconds, |warp| warp.moment(seconds))
    }

    /// Applies the warp to a pose that was sampled without it.
    pub fn apply_warp(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        if let Some(warp) = &self.warp {
            warp.apply(graph.rigged_skeleton(), seconds, pose);
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
