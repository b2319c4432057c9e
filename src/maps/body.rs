use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Prop;
use crate::anim::{Clip, JointId, JointKind, JointTransform, Skeleton};

/// A sphere that is fixed to a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodySphere {
    /// The joint whose frame it moves with.
    pub joint: JointId,
    /// Of its centre, in the joint's own frame, metres.
    pub offset: Vec3,
    /// Metres.
    pub radius: f32,
}

impl BodySphere {
    /// Whether it hangs from one of `skeleton`'s joints and has a place and a size.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        self.joint.index() < skeleton.len()
            && Skeleton::is_near(self.offset)
            && self.radius > 0.0
            && self.radius <= Skeleton::FURTHEST
    }

    /// Its centre in the space of the motion.
    #[must_use]
    pub fn centre(&self, joints: &[JointTransform]) -> Vec3 {
        joints[self.joint.index()].point(self.offset)
    }
}

/// The body as spheres on its bones, and what it holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// In no particular order.
    pub spheres: Vec<BodySphere>,
    /// What its joints hold. Those that are [`Prop::is_body`] have their spheres among the body's own too.
    pub props: Vec<Prop>,
}

/// Radii as shares, set by eye against drawings of the human figure; they are what the body is made of where nobody says
/// better. "Height" is the length of the bones from crown to toe, a little more than a person's stature.
mod shares {
    /// Trunk: of the height.
    pub(super) const TRUNK: f32 = 0.062;
    /// Hips and shoulders, the bones that leave the trunk sideways: of the height.
    pub(super) const GIRDLE: f32 = 0.05;
    /// What of the trunk's line lies above the arms: of the height.
    pub(super) const NECK: f32 = 0.032;
    /// Head, from its joint to its tip: of that bone.
    pub(super) const HEAD: f32 = 0.62;
    /// Smallest and largest head: of the height.
    pub(super) const HEAD_RANGE: (f32, f32) = (0.04, 0.06);
    /// Arms and legs: of the bone.
    pub(super) const LIMB: f32 = 0.17;
    /// Thinnest and thickest limb: of the height.
    pub(super) const LIMB_RANGE: (f32, f32) = (0.02, 0.042);
    /// Spheres of a bone stand this share of their radius apart.
    pub(super) const SPACING: f32 = 1.2;
}

impl Body {
    /// Spheres along every bone, with radii from the lengths of the bones.
    ///
    /// A bone belongs to a limb where names give it a twin on the other side of the body; what has none is the trunk or, at its tip, the
    /// head.
    #[must_use]
    pub fn from_bones(skeleton: &Skeleton) -> Self {
        let height = height(skeleton);
        let sided = |id| skeleton.mirror(id).is_some();
        let within =
            |length: f32, (low, high): (f32, f32)| length.clamp(height * low, height * high);
        let mut spheres = Vec::new();
        // Bones that meet share the sphere of their joint: the largest.
        let mut at_joints = vec![0.0f32; skeleton.len()];
        for id in skeleton.ids().skip(1) {
            let joint = skeleton.joint(id);
            let (Some(parent), length) = (joint.parent, joint.offset.length()) else {
                continue;
            };
            if length < 1e-4 {
                continue;
            }
            let has_limbs = || {
                skeleton
                    .ids()
                    .any(|limb| sided(limb) && skeleton.ancestry(limb).any(|j| j == id))
            };
            let radius = match (sided(parent), sided(id), joint.kind) {
                (false, false, JointKind::EndSite) => {
                    let radius = within(length * shares::HEAD, shares::HEAD_RANGE);
                    spheres.push(BodySphere {
                        joint: parent,
                        offset: joint.offset * 0.5,
                        radius,
                    });
                    continue;
                }
                (false, false, _) if has_limbs() => height * shares::TRUNK,
                (false, false, _) => height * shares::NECK,
                (false, true, _) => height * shares::GIRDLE,
                _ => within(length * shares::LIMB, shares::LIMB_RANGE),
            };
            for end in [parent, id] {
                at_joints[end.index()] = at_joints[end.index()].max(radius);
            }
            along(&mut spheres, parent, joint.offset, radius);
        }
        let shared = skeleton.ids().zip(&at_joints).filter(|(_, r)| **r > 0.0);
        spheres.extend(shared.map(|(joint, &radius)| BodySphere {
            joint,
            offset: Vec3::ZERO,
            radius,
        }));
        // One bone after the other, so that each turns its spheres at once.
        spheres.sort_by_key(|sphere| sphere.joint);
        if spheres.is_empty() {
            spheres.push(BodySphere {
                joint: JointId::ROOT,
                offset: Vec3::ZERO,
                radius: 0.1,
            });
        }
        Self::new(spheres)
    }

    /// Of spheres, with nothing in its hands.
    #[must_use]
    pub fn new(spheres: Vec<BodySphere>) -> Self {
        let props = Vec::new();
        Self { spheres, props }
    }

    /// Gives it something to hold, which attacks where the joint does and, if it is a part of the body, is hit as that is.
    pub fn hold(&mut self, prop: Prop) {
        if prop.is_body {
            self.spheres.extend(prop.body_spheres());
        }
        self.props.push(prop);
    }

    /// Whether there is a sphere and all are sound ([`BodySphere::is_sound`]), those of its props too.
    #[must_use]
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let sound = |sphere: &BodySphere| sphere.is_sound(skeleton);
        let props = self.props.iter().all(|prop| prop.is_sound(skeleton));
        !self.spheres.is_empty() && self.spheres.iter().all(sound) && props
    }

    /// The centres of all spheres, in the space of the motion.
    pub fn centres(&self, joints: &[JointTransform], out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.spheres.iter().map(|sphere| sphere.centre(joints)));
    }

    /// No part of the body is ever further than this from the root's joint in the motions of `clips`, or blends of them, metres.
    #[must_use]
    pub fn reach(&self, skeleton: &Skeleton, clips: &[Clip]) -> f32 {
        let mut bones: Vec<f32> = skeleton
            .joints()
            .iter()
            .map(|joint| joint.offset.length())
            .collect();
        for clip in clips {
            for (index, translation) in clip.desc().translations.iter().enumerate() {
                let bone = &mut bones[index % skeleton.len()];
                *bone = bone.max(translation.length());
            }
        }
        let chain = |joint| -> f32 {
            skeleton
                .ancestry(joint)
                .filter(|&j| j != JointId::ROOT)
                .map(|j| bones[j.index()])
                .sum()
        };
        let furthest =
            |sphere: &BodySphere| chain(sphere.joint) + sphere.offset.length() + sphere.radius;
        self.spheres.iter().map(furthest).fold(0.0, f32::max)
    }
}

/// The spheres of a bone but for those at its ends.
fn along(spheres: &mut Vec<BodySphere>, joint: JointId, bone: Vec3, radius: f32) {
    let pieces = (bone.length() / (radius * shares::SPACING)).ceil().max(1.0) as usize;
    spheres.extend((1..pieces).map(|i| {
        let offset = bone * (i as f32 / pieces as f32);
        BodySphere {
            joint,
            offset,
            radius,
        }
    }));
}

/// The longest chain of bones without a side, plus the longest one with: trunk and head, and a leg.
fn height(skeleton: &Skeleton) -> f32 {
    let longest = |sided: bool| {
        let of_side = skeleton
            .ids()
            .filter(|&id| skeleton.mirror(id).is_some() == sided);
        of_side
            .map(|id| own_chain(skeleton, id, sided))
            .fold(0.0, f32::max)
    };
    let (trunk, leg) = (longest(false), longest(true));
    // Without names that tell sides all chains are trunks.
    if leg > 0.0 { trunk + leg } else { 2.0 * trunk }
}

/// Length of the bones from `id` up, as long as they have a side or, for the trunk, none.
fn own_chain(skeleton: &Skeleton, id: JointId, sided: bool) -> f32 {
    skeleton
        .ancestry(id)
        .filter(|&joint| joint != JointId::ROOT)
        .take_while(|&joint| skeleton.mirror(joint).is_some() == sided)
        .map(|joint| skeleton.joint(joint).offset.length())
        .sum()
}
