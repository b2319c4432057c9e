//! Legs of a skeleton, and the frames of joint chains.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::limbs::{named_feet, named_hands};
use super::{JointId, JointKind, JointTransform, Pose, Skeleton};

/// The joints of a leg: two bones and a foot; of an arm, two bones and a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Leg {
    /// Joint that carries the thigh. It carries nothing but this leg.
    pub hip: JointId,
    /// Joint between the two bones.
    pub knee: JointId,
    /// Ankle, which carries the foot.
    pub foot: JointId,
    /// Point at the front of the foot: the ball or the end of the toes. `None` if the foot has no
    /// second point.
    pub toe: Option<JointId>,
}

impl Leg {
    /// Minimum length of the leg's two bones, as a share of the leg's length. It excludes twist
    /// joints and joints that lie on the pelvis.
    const SHORTEST_BONE: f32 = 0.3;

    /// Finds the legs above the feet that joint names identify, or none if the names identify no
    /// feet. Joints between a leg's three joints (twist joints) move with the bone that contains
    /// them.
    #[must_use]
    pub fn all(skeleton: &Skeleton) -> Vec<Self> {
        Self::above(skeleton, &named_feet(skeleton))
    }

    /// The arms above the hands that names tell, as two bones and an end: shoulder, elbow, hand.
    #[must_use]
    pub fn arms(skeleton: &Skeleton) -> Vec<Self> {
        Self::above(skeleton, &named_hands(skeleton))
    }

    fn above(skeleton: &Skeleton, feet: &[JointId]) -> Vec<Self> {
        let carried = |joint: JointId| {
            let carries = |foot: &&JointId| skeleton.ancestry(**foot).any(|above| above == joint);
            feet.iter().filter(carries).count()
        };
        let leg = |&foot: &JointId| {
            let own: Vec<JointId> = skeleton
                .ancestry(foot)
                .take_while(|&joint| joint != JointId::ROOT && carried(joint) == 1)
                .collect();
            let bone = |joint: JointId| skeleton.joint(joint).offset.length();
            // Length of the chain, without the bone that leads to its first joint.
            let length: f32 = own.iter().rev().skip(1).map(|&joint| bone(joint)).sum();
            let shortest = Self::SHORTEST_BONE * length;
            let above = |from: usize| {
                let mut sum = 0.0;
                (from + 1..own.len()).find(|&index| {
                    sum += bone(own[index - 1]);
                    sum > 0.0 && sum >= shortest
                })
            };
            let knee = above(0)?;
            let hip = above(knee)?;
            let toe = toe(skeleton, foot);
            let (hip, knee) = (own[hip], own[knee]);
            Some(Self {
                hip,
                knee,
                foot,
                toe,
            })
        };
        feet.iter().filter_map(leg).collect()
    }

    /// The toe, or the ankle if the foot has no second point.
    #[must_use]
    pub fn toe_or_foot(&self) -> JointId {
        self.toe.unwrap_or(self.foot)
    }

    /// Length of both bones, in metres.
    #[must_use]
    pub fn length(&self, skeleton: &Skeleton) -> f32 {
        let bones = skeleton
            .ancestry(self.foot)
            .take_while(|&joint| joint != self.hip);
        bones
            .map(|joint| skeleton.joint(joint).offset.length())
            .sum()
    }

    /// Whether the leg's joints exist in `skeleton` and form a chain. It checks legs that come from
    /// a file.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let known = |joint: JointId| joint.index() < skeleton.len();
        let below = |joint, above| {
            known(joint) && skeleton.ancestry(joint).skip(1).any(|other| other == above)
        };
        self.hip != JointId::ROOT
            && below(self.knee, self.hip)
            && below(self.foot, self.knee)
            && self.toe.is_none_or(|toe| below(toe, self.foot))
    }
}

/// The foot's child that moves or, if there is none, the farthest child.
fn toe(skeleton: &Skeleton, foot: JointId) -> Option<JointId> {
    let rank = |&id: &JointId| {
        let joint = skeleton.joint(id);
        (joint.kind == JointKind::Moving, joint.offset.length())
    };
    skeleton
        .children(foot)
        .filter(|id| rank(id).1 > 1e-3)
        .max_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
}

/// Computes joint frames from the chain of ancestors, without evaluating the whole body. `local`
/// returns a joint's rotation and position in its parent's frame; the root's are in the space of
/// the motion.
pub struct Chain<'a, L> {
    /// Skeleton of the chain.
    pub skeleton: &'a Skeleton,
    /// Rotation and position of a joint in its parent's frame, in metres.
    pub local: L,
}

impl<'a> Chain<'a, ()> {
    /// Creates a chain from a pose.
    pub fn of(
        skeleton: &'a Skeleton,
        pose: &'a Pose,
    ) -> Chain<'a, impl Fn(JointId) -> (Quat, Vec3)> {
        Chain {
            skeleton,
            local: |id| pose.local(skeleton, id),
        }
    }
}

impl<L: Fn(JointId) -> (Quat, Vec3)> Chain<'_, L> {
    /// Frame of a joint in the space of the motion.
    pub fn global(&self, joint: JointId) -> JointTransform {
        self.below(joint, None)
    }

    /// Frame of a joint relative to one of its ancestors.
    pub fn within(&self, joint: JointId, above: JointId) -> JointTransform {
        self.below(joint, Some(above))
    }

    fn below(&self, joint: JointId, above: Option<JointId>) -> JointTransform {
        let parent = |id: JointId| {
            self.skeleton
                .joint(id)
                .parent
                .filter(|&id| Some(id) != above)
        };
        if Some(joint) == above {
            return JointTransform::IDENTITY;
        }
        let (rotation, translation) = (self.local)(joint);
        let mut frame = JointTransform {
            rotation,
            translation,
        };
        let mut next = parent(joint);
        while let Some(id) = next {
            let (rotation, translation) = (self.local)(id);
            frame = JointTransform {
                rotation: rotation * frame.rotation,
                translation: rotation * frame.translation + translation,
            };
            next = parent(id);
        }
        frame
    }
}
