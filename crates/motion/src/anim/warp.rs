//! Temporary displacement of a motion: the trunk leans and turns, the pelvis shifts while the feet stay planted, a foot is lifted,
//! an arm is drawn in.
//!
//! Source: Witkin & Popović, "Motion Warping" (1995): a smooth displacement is added to a captured motion and fades in and out
//! around a moment. Differs: the displacement has 19 parameters (spine, pelvis, four limbs, time). Legs and arms follow by inverse
//! kinematics ([`Leg::reach`](super::Leg::reach)), so that planted feet stay planted.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{Chain, JointTransform, Pose, Rig, RiggedSkeleton};

/// Weight of a warp over time. It fades in and out as a fifth-degree polynomial, with zero speed and acceleration at both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Envelope {
    /// Start of the fade-in, in seconds since the motion's start.
    pub start: f32,
    /// End of the fade-in, in seconds.
    pub full: f32,
    /// Start of the fade-out, in seconds.
    pub release: f32,
    /// End of the fade-out, in seconds.
    pub end: f32,
}

impl Envelope {
    /// Maximum slope of the polynomial for a fade of 1 s.
    pub const STEEPEST: f32 = 1.875;
    /// Maximum second derivative of the polynomial for a fade of 1 s.
    pub const SHARPEST: f32 = 5.7736;

    /// Weight of the warp, 0 to 1.
    pub fn weight(&self, seconds: f32) -> f32 {
        if seconds <= self.start || seconds >= self.end {
            return 0.0;
        }
        let share = |from: f32, to: f32| smooth((seconds - from) / (to - from));
        match seconds {
            early if early < self.full => share(self.start, self.full),
            late if late > self.release => share(self.end, self.release),
            _ => 1.0,
        }
    }

    /// The envelope on a clock that starts `seconds` later.
    pub fn since(&self, seconds: f32) -> Self {
        Self {
            start: self.start - seconds,
            full: self.full - seconds,
            release: self.release - seconds,
            end: self.end - seconds,
        }
    }

    /// Duration of the shorter fade, in seconds.
    pub fn shortest_way(&self) -> f32 {
        (self.full - self.start).min(self.end - self.release)
    }
}

/// Smooth step from 0 to 1 with zero first and second derivatives at both ends (Perlin 2002).
fn smooth(share: f32) -> f32 {
    let share = share.clamp(0.0, 1.0);
    share * share * share * (share * (share * 6.0 - 15.0) + 10.0)
}

/// Displacement of a pose, in the space of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bend {
    /// Rotation of the chest, as axis times angle in radians. The joints of the spine share it equally.
    pub spine: Vec3,
    /// Translation of the pelvis, in metres. The feet stay in place.
    pub pelvis: Vec3,
    /// Translations of the feet and hands, in metres, in the order of [`Rig::limbs`]. Those of
    /// hands are added to the movement of the trunk.
    pub ends: [Vec3; Rig::LIMBS],
    /// Offset in time, in seconds: positive plays a later moment of the motion.
    pub ahead: f32,
}

/// A [`Bend`] that fades in and out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Warp {
    /// Weight of the bend over time.
    pub envelope: Envelope,
    /// Displacement at full weight.
    pub bend: Bend,
}

impl Warp {
    /// Time in the motion that is played at `seconds`, in seconds.
    pub fn moment(&self, seconds: f32) -> f32 {
        seconds + self.bend.ahead * self.envelope.weight(seconds)
    }

    /// Translation of the root at `seconds`, in metres.
    pub fn root(&self, seconds: f32) -> Vec3 {
        self.bend.pelvis * self.envelope.weight(seconds)
    }

    /// Whether the weight at `seconds` is above 0.
    pub fn acts_at(&self, seconds: f32) -> bool {
        self.envelope.weight(seconds) > 0.0
    }

    /// Applies the warp to the pose at `seconds`.
    pub fn apply(&self, rigged: RiggedSkeleton<'_>, seconds: f32, pose: &mut Pose) {
        let weight = self.envelope.weight(seconds);
        if weight > 0.0 {
            self.bend.apply(rigged, weight, pose);
        }
    }
}

impl Bend {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let ends = self.ends.iter().all(|end| end.is_finite());
        self.spine.is_finite() && self.pelvis.is_finite() && ends && self.ahead.is_finite()
    }

    /// Applies the bend with a weight. Returns the largest distance of a foot from its target, in metres, which is above 0 if a leg is too
    /// short.
    pub fn apply(&self, rigged: RiggedSkeleton<'_>, weight: f32, pose: &mut Pose) -> f32 {
        let RiggedSkeleton { skeleton, rig } = rigged;
        let feet = self.feet(rigged, pose);
        pose.root += self.pelvis * weight;
        rig.turn_spine(self.spine * weight, pose);
        let mut missed = 0.0f32;
        for (limb, foot) in feet.into_iter().enumerate() {
            if let (Some(leg), Some(foot)) = (rig.limbs()[limb], foot) {
                let foot = moved(foot, self.ends[limb] * weight);
                let knee = rig.knee(limb);
                missed = missed.max(leg.reach_by_knee(skeleton, pose, foot, knee));
            }
        }
        for limb in Rig::LEGS..Rig::LIMBS {
            let arm = rig.limbs()[limb].filter(|_| self.ends[limb] != Vec3::ZERO);
            if let Some(arm) = arm {
                let hand = Chain::of(skeleton, pose).global(arm.foot);
                arm.reach(skeleton, pose, moved(hand, self.ends[limb] * weight));
            }
        }
        missed
    }

    /// Frames of the feet before the bend, to which the legs return them.
    fn feet(&self, rigged: RiggedSkeleton<'_>, pose: &Pose) -> [Option<JointTransform>; Rig::LEGS] {
        let chain = Chain::of(rigged.skeleton, pose);
        let foot = |limb: usize| {
            let is_moved = self.pelvis != Vec3::ZERO || self.ends[limb] != Vec3::ZERO;
            let leg = rigged.rig.limbs()[limb].filter(|_| is_moved)?;
            Some(chain.global(leg.foot))
        };
        [foot(0), foot(1)]
    }
}

fn moved(frame: JointTransform, by: Vec3) -> JointTransform {
    JointTransform {
        translation: frame.translation + by,
        ..frame
    }
}
