//! A motion that is bent for a moment: the trunk leans and turns, the pelvis shifts while the feet stay, a foot is lifted,
//! an arm drawn in.
//!
//! Source: Witkin & Popović, "Motion Warping" (1995): a smooth displacement is added to a captured motion, in and out around
//! the moment that counts. Differs: the displacement has few parameters that a body understands, and legs and arms follow by
//! inverse kinematics ([`reach`]), so that feet that stand go on standing.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::{Chain, JointId, JointTransform, Pose, Rig, Skeleton, reach};

/// When a warp acts. It comes and goes as smoothly as a fifth-degree polynomial: speed and acceleration are 0 at each end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Envelope {
    /// The warp begins, seconds since the motion's start.
    pub start: f32,
    /// It has come in whole.
    pub full: f32,
    /// It begins to go.
    pub release: f32,
    /// It has gone.
    pub end: f32,
}

impl Envelope {
    /// Largest slope of the polynomial, per length of the way in or out.
    pub const STEEPEST: f32 = 1.875;
    /// Largest second derivative, per squared length.
    pub const SHARPEST: f32 = 5.7736;

    /// How much of the warp acts, 0 to 1.
    #[must_use]
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

    /// The same on a clock that starts `seconds` later.
    #[must_use]
    pub fn since(&self, seconds: f32) -> Self {
        Self {
            start: self.start - seconds,
            full: self.full - seconds,
            release: self.release - seconds,
            end: self.end - seconds,
        }
    }

    /// The shorter of the ways in and out, seconds.
    #[must_use]
    pub fn shortest_way(&self) -> f32 {
        (self.full - self.start).min(self.end - self.release)
    }
}

/// From 0 to 1, with no slope and no bend at either end (Perlin 2002).
fn smooth(share: f32) -> f32 {
    let share = share.clamp(0.0, 1.0);
    share * share * share * (share * (share * 6.0 - 15.0) + 10.0)
}

/// How a posture is bent. Directions are those of the motion's space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bend {
    /// What the chest turns by, axis times angle, radians; each joint of the spine has an equal share.
    pub spine: Vec3,
    /// What the pelvis moves by, metres; the feet stay.
    pub pelvis: Vec3,
    /// What the feet, then the hands, move by, metres, in the order of [`Rig::limbs`]. Hands move away from where the trunk
    /// takes them.
    pub ends: [Vec3; Rig::LIMBS],
    /// How far ahead in the motion it already is, seconds; behind where negative.
    pub ahead: f32,
}

/// A [`Bend`] that comes and goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Warp {
    /// When.
    pub envelope: Envelope,
    /// What, where it acts whole.
    pub bend: Bend,
}

impl Warp {
    /// Which moment of the motion is played instead of one, seconds.
    #[must_use]
    pub fn moment(&self, seconds: f32) -> f32 {
        seconds + self.bend.ahead * self.envelope.weight(seconds)
    }

    /// What the root moves by at a moment, metres.
    #[must_use]
    pub fn root(&self, seconds: f32) -> Vec3 {
        self.bend.pelvis * self.envelope.weight(seconds)
    }

    /// Whether anything of it acts at a moment.
    #[must_use]
    pub fn acts_at(&self, seconds: f32) -> bool {
        self.envelope.weight(seconds) > 0.0
    }

    /// Bends the pose of a moment.
    pub(crate) fn apply(&self, (skeleton, rig): (&Skeleton, &Rig), seconds: f32, pose: &mut Pose) {
        let weight = self.envelope.weight(seconds);
        if weight > 0.0 {
            self.bend.apply((skeleton, rig), weight, pose);
        }
    }
}

impl Bend {
    /// Whether every number is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let ends = self.ends.iter().all(|end| end.is_finite());
        self.spine.is_finite() && self.pelvis.is_finite() && ends && self.ahead.is_finite()
    }

    /// Bends a pose by a share of it. How far a foot is at most from where it should be, metres, where legs are too short.
    pub(crate) fn apply(
        &self,
        (skeleton, rig): (&Skeleton, &Rig),
        weight: f32,
        pose: &mut Pose,
    ) -> f32 {
        let feet = self.feet((skeleton, rig), pose);
        pose.root += self.pelvis * weight;
        self.turn_spine(rig, weight, pose);
        let mut missed = 0.0f32;
        for (limb, foot) in feet.into_iter().enumerate() {
            if let (Some(leg), Some(foot)) = (rig.limbs()[limb], foot) {
                let foot = moved(foot, self.ends[limb] * weight);
                missed = missed.max(reach(skeleton, pose, &leg, foot).missed);
            }
        }
        for limb in Rig::LEGS..Rig::LIMBS {
            let arm = rig.limbs()[limb].filter(|_| self.ends[limb] != Vec3::ZERO);
            if let Some(arm) = arm {
                let hand = Chain::of(skeleton, pose).global(arm.foot);
                reach(skeleton, pose, &arm, moved(hand, self.ends[limb] * weight));
            }
        }
        missed
    }

    /// Where the feet stand that legs must bring back there.
    fn feet(
        &self,
        (skeleton, rig): (&Skeleton, &Rig),
        pose: &Pose,
    ) -> [Option<JointTransform>; Rig::LEGS] {
        let chain = Chain::of(skeleton, pose);
        let foot = |limb: usize| {
            let is_moved = self.pelvis != Vec3::ZERO || self.ends[limb] != Vec3::ZERO;
            let leg = rig.limbs()[limb].filter(|_| is_moved)?;
            Some(chain.global(leg.foot))
        };
        [foot(0), foot(1)]
    }

    /// Turns about one axis in the space of the motion, joint after joint: what the joints below have turned does not change it.
    fn turn_spine(&self, rig: &Rig, weight: f32, pose: &mut Pose) {
        if self.spine == Vec3::ZERO || rig.spine().is_empty() {
            return;
        }
        let turn = turn_by(self.spine * (weight / rig.spine().len() as f32));
        let mut parent = pose.rotations[JointId::ROOT.index()];
        for joint in rig.spine() {
            let local = pose.rotations[joint.index()];
            let turned = parent.conjugate() * turn * parent * local;
            pose.rotations[joint.index()] = turned.normalize();
            parent *= local;
        }
    }
}

fn moved(frame: JointTransform, by: Vec3) -> JointTransform {
    JointTransform {
        translation: frame.translation + by,
        ..frame
    }
}

/// A turn by a small vector, axis times angle: of 2 atan(angle / 2), which is never more.
fn turn_by(vector: Vec3) -> Quat {
    let half = 0.5 * vector;
    Quat::from_xyzw(half.x, half.y, half.z, 1.0).normalize()
}
