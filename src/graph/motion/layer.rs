//! Layers: the upper body plays a part of a clip while pelvis and legs continue.
//!
//! Source: layered blending with a mask of joints, as in game engines ("layered blend per bone", "avatar mask"). Differs: the spine also
//! takes over the difference between the tilt of the clip's pelvis and that of the played pelvis, so that the trunk leans as in the clip.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::Motion;
use crate::anim::{Envelope, JointId, Pose, slerp};
use crate::graph::{ClipId, ClipPosition, MotionGraph};

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
    pub(super) cut: Option<f32>,
}

/// Largest tilt of the clip's pelvis that the spine takes over, in radians: 20°.
const MOST_TILT: f32 = 0.35;

impl Layer {
    /// Creates a layer that plays a clip from `start` on.
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
    #[must_use]
    pub fn weight(&self, seconds: f32) -> f32 {
        match self.cut {
            Some(cut) if seconds >= cut => 0.0,
            _ => self.envelope.weight(seconds),
        }
    }

    /// Time from which the layer no longer acts, in seconds since the motion's start.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.envelope.end.min(self.cut.unwrap_or(f32::INFINITY))
    }

    /// Frame of the clip at a time of the motion.
    #[must_use]
    pub(crate) fn frame_at(&self, graph: &MotionGraph, seconds: f32) -> f32 {
        let frames = (seconds - self.envelope.start) * self.rate * graph.frame_rate() as f32;
        let last = graph.clip(self.clip).frames().saturating_sub(1) as f32;
        (self.frame + frames).clamp(0.0, last)
    }

    /// The layer as it was before a cut at a time of the motion.
    pub(super) fn before_cut(&self, seconds: f32) -> Self {
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

    fn is_sound(&self, graph: &MotionGraph) -> bool {
        let Envelope {
            start,
            full,
            release,
            end,
        } = self.envelope;
        let numbers = [
            self.frame,
            start,
            full,
            release,
            end,
            self.cut.unwrap_or(0.0),
        ];
        self.clip.index() < graph.clips().len()
            && numbers.iter().all(|number| number.is_finite())
            && self.rate.is_finite()
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
    #[doc(hidden)]
    pub fn set_layer(&mut self, layer: Option<Layer>) {
        self.layer = layer;
    }

    /// The layer of the upper body, or `None` if the motion has none.
    #[must_use]
    #[doc(hidden)]
    pub fn layer(&self) -> Option<&Layer> {
        self.layer.as_ref()
    }

    /// Whether the layer acts at `seconds`, so that the upper body differs from the playhead.
    #[must_use]
    pub fn is_layered(&self, seconds: f32) -> bool {
        let moment = self.moment(seconds);
        self.layer.is_some_and(|layer| layer.weight(moment) > 0.0)
    }

    pub(super) fn apply_layer(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        if let Some(layer) = &self.layer {
            layer.apply(graph, self.moment(seconds), pose);
        }
    }

    /// The layer with times relative to `seconds`; `None` if it has ended by then.
    pub(super) fn layer_since(&self, seconds: f32) -> Option<Layer> {
        let layer = self.layer.filter(|layer| layer.end() > seconds)?;
        Some(layer.since(seconds))
    }

    /// Ends the layer at a cut of the motion.
    pub(super) fn cut_layer(&mut self, seconds: f32) {
        if let Some(layer) = &mut self.layer {
            layer.cut = Some(layer.cut.map_or(seconds, |cut| cut.min(seconds)));
        }
    }

    pub(in crate::graph) fn is_layer_sound(&self, graph: &MotionGraph) -> bool {
        self.layer.is_none_or(|layer| layer.is_sound(graph))
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
