//! The body as spheres that its joints carry, and the props that they hold.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::anim::{
    Clip, JointId, JointKind, JointTransform, Leg, Limbs, Pose, Skeleton, carried,
    forward_kinematics,
};
use crate::math::{Sphere, in_parallel};

/// A sphere that is fixed to a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodySphere {
    /// Joint that the sphere moves with.
    pub joint: JointId,
    /// Position of the centre in the joint's frame, in metres.
    pub offset: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

impl BodySphere {
    /// Whether the joint exists in `skeleton`, the position is finite and the radius is positive.
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        self.joint.index() < skeleton.len()
            && Skeleton::is_near(self.offset)
            && self.radius > 0.0
            && self.radius <= Skeleton::FURTHEST
    }

    /// Position of the centre in the space of `joints`.
    pub fn centre(&self, joints: &[JointTransform]) -> Vec3 {
        joints[self.joint.index()].point(self.offset)
    }
}

/// An object that a joint holds, for example a staff, a sword or a shield. It attacks when its
/// joint does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prop {
    /// Joint that the prop moves with.
    pub joint: JointId,
    /// Spheres of the prop, in the joint's frame.
    pub spheres: Vec<Sphere>,
    /// Whether attacks can hit the prop, which makes it part of the body.
    pub is_body: bool,
}

impl Prop {
    /// Spheres of the prop as body spheres.
    pub fn body_spheres(&self) -> impl Iterator<Item = BodySphere> + '_ {
        self.spheres
            .iter()
            .map(|&Sphere { centre, radius }| BodySphere {
                joint: self.joint,
                offset: centre,
                radius,
            })
    }

    /// Whether the prop has spheres and each has a joint of `skeleton`, a finite position and a
    /// positive radius.
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        !self.spheres.is_empty() && self.body_spheres().all(|sphere| sphere.is_sound(skeleton))
    }

    /// Whether the prop takes part in an attack of `joints`. It does if its joint is one of them,
    /// or an ancestor or a descendant of one. An empty list stands for the whole body.
    pub fn takes_part(&self, skeleton: &Skeleton, joints: &[JointId]) -> bool {
        let own = self.joint;
        let tied = |&id: &JointId| skeleton.carries(id, own) || skeleton.carries(own, id);
        joints.is_empty() || joints.iter().any(tied)
    }
}

/// The body as spheres on its bones, with the props that it holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Spheres of the body, in no particular order.
    pub spheres: Vec<BodySphere>,
    /// Props that the joints hold. If [`Prop::is_body`] is set, the prop's spheres are in `spheres`
    /// too.
    pub props: Vec<Prop>,
}

/// Default radii as shares of a length, chosen by comparison with drawings of the human figure. The
/// height is the length of the bones from crown to toe, which is slightly more than a person's
/// stature.
mod shares {
    /// Radius of the trunk, as a share of the height.
    pub(super) const TRUNK: f32 = 0.062;
    /// Radius of hips and shoulders (the bones that leave the trunk sideways), as a share of the
    /// height.
    pub(super) const GIRDLE: f32 = 0.05;
    /// Radius of the trunk above the arms, as a share of the height.
    pub(super) const NECK: f32 = 0.032;
    /// Radius of the head, as a share of the bone from the head's joint to its tip.
    pub(super) const HEAD: f32 = 0.62;
    /// Minimum and maximum radius of the head, as shares of the height.
    pub(super) const HEAD_RANGE: (f32, f32) = (0.04, 0.06);
    /// Distance of the head's middle from its joint where the skeleton has no tip of it, as a share of the height.
    pub(super) const HEAD_MIDDLE: f32 = 0.05;
    /// Radius of arms and legs, as a share of the bone.
    pub(super) const LIMB: f32 = 0.17;
    /// Minimum and maximum radius of a limb, as shares of the height.
    pub(super) const LIMB_RANGE: (f32, f32) = (0.02, 0.042);
    /// Distance between neighbouring spheres of a bone, as a share of their radius.
    pub(super) const SPACING: f32 = 1.2;
}

impl Body {
    /// Places spheres along all bones of the body, with radii that depend on the bones' lengths. Helpers, weapons and cloth get none.
    ///
    /// A bone belongs to a limb if a bone of the other side of the body has the mirrored name. All
    /// other bones form the trunk, and the last of them the head. Where the last joint has no tip, as in most rigs of games, the head goes on
    /// as the neck does.
    #[must_use]
    pub fn from_bones(skeleton: &Skeleton) -> Self {
        let (height, carried) = (height(skeleton), carried(skeleton));
        let sided = |id| skeleton.mirror(id).is_some();
        let within =
            |length: f32, (low, high): (f32, f32)| length.clamp(height * low, height * high);
        let (mut spheres, mut has_head) = (Vec::new(), false);
        // Eyes have sides, too.
        let limbs = Limbs::of(skeleton);
        let is_end = |id: &JointId| limbs.hands.is_empty() || limbs.all().any(|end| end == *id);
        let ends = skeleton.ids().filter(|&id| sided(id)).filter(is_end);
        let ends: Vec<JointId> = ends.collect();
        let has_limbs = |id: JointId| ends.iter().any(|&end| skeleton.carries(id, end));
        // Bones that meet at a joint share its sphere, which takes the largest of their radii.
        let mut at_joints = vec![0.0f32; skeleton.len()];
        for id in skeleton.ids().skip(1).filter(|id| !carried[id.index()]) {
            let joint = skeleton.joint(id);
            let (Some(parent), length) = (joint.parent, joint.offset.length()) else {
                continue;
            };
            if length < 1e-4 {
                continue;
            }
            let radius = match (sided(parent), sided(id), joint.kind) {
                (false, false, JointKind::EndSite) => {
                    let radius = within(length * shares::HEAD, shares::HEAD_RANGE);
                    has_head = true;
                    spheres.push(BodySphere {
                        joint: parent,
                        offset: joint.offset * 0.5,
                        radius,
                    });
                    continue;
                }
                (false, false, _) if has_limbs(id) => height * shares::TRUNK,
                (false, false, _) => height * shares::NECK,
                (false, true, _) => height * shares::GIRDLE,
                _ => within(length * shares::LIMB, shares::LIMB_RANGE),
            };
            for end in [parent, id] {
                at_joints[end.index()] = at_joints[end.index()].max(radius);
            }
            spheres.extend(along(parent, joint.offset, radius));
        }
        if let Some(head) = head(skeleton, &carried, has_limbs).filter(|_| !has_head) {
            let along = skeleton.joint(head).offset.normalize_or_zero();
            spheres.push(BodySphere {
                joint: head,
                offset: along * shares::HEAD_MIDDLE * height,
                radius: shares::HEAD_RANGE.1 * height,
            });
        }
        let shared = skeleton.ids().zip(&at_joints).filter(|(_, r)| **r > 0.0);
        spheres.extend(shared.map(|(joint, &radius)| BodySphere {
            joint,
            offset: Vec3::ZERO,
            radius,
        }));
        // Spheres are sorted by joint, so that all spheres of a joint are transformed together.
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

    /// The bone of an arm or a leg that the spheres leave most bare in the clips' own frames, by the joint at its end, with the distance of
    /// its barest point from the nearest sphere, in metres. `None` without such bones.
    pub fn barest_bone(&self, skeleton: &Skeleton, clips: &[Clip]) -> Option<(JointId, f32)> {
        /// Number of frames of all clips, and distance of the points of a bone, in metres.
        const SAMPLES: (usize, f32) = (64, 0.02);
        let mut limbs = Leg::all(skeleton);
        limbs.extend(Leg::arms(skeleton));
        let mut bones: Vec<JointId> = Vec::new();
        for limb in limbs {
            let of_limb = skeleton.ancestry(limb.toe_or_foot());
            bones.extend(of_limb.take_while(|&joint| joint != limb.hip));
        }
        let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
        let mut barest: Option<(JointId, f32)> = None;
        for clip in clips.iter().step_by(clips.len().div_ceil(SAMPLES.0).max(1)) {
            let step = (clip.frames() * clips.len()).div_ceil(SAMPLES.0).max(1);
            for frame in (0..clip.frames()).step_by(step) {
                clip.pose(frame, &mut pose);
                forward_kinematics(skeleton, &pose, &mut joints);
                self.centres(&joints, &mut centres);
                for &bone in &bones {
                    let Some(parent) = skeleton.joint(bone).parent else {
                        continue;
                    };
                    let ends = [parent, bone].map(|joint| joints[joint.index()].translation);
                    let points = (ends[0].distance(ends[1]) / SAMPLES.1).ceil().min(1e3) as usize;
                    for point in 0..=points {
                        let point = ends[0].lerp(ends[1], point as f32 / points.max(1) as f32);
                        let bare = |(sphere, centre): (&BodySphere, &Vec3)| {
                            centre.distance(point) - sphere.radius
                        };
                        let all = self.spheres.iter().zip(&centres).map(bare);
                        let bare = all.fold(f32::INFINITY, f32::min);
                        if barest.is_none_or(|(_, most)| bare > most) {
                            barest = Some((bone, bare));
                        }
                    }
                }
            }
        }
        barest
    }

    /// Creates a body from spheres, without props.
    #[must_use]
    pub fn new(spheres: Vec<BodySphere>) -> Self {
        let props = Vec::new();
        Self { spheres, props }
    }

    /// Adds a prop. It attacks when its joint does; if it is part of the body, attacks can hit it.
    pub fn hold(&mut self, prop: Prop) {
        if prop.is_body {
            self.spheres.extend(prop.body_spheres());
        }
        self.props.push(prop);
    }

    /// Whether the body has spheres and all spheres, including those of props, are valid
    /// ([`BodySphere::is_sound`]).
    pub fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let sound = |sphere: &BodySphere| sphere.is_sound(skeleton);
        let props = self.props.iter().all(|prop| prop.is_sound(skeleton));
        !self.spheres.is_empty() && self.spheres.iter().all(sound) && props
    }

    /// Writes the centres of all spheres to `out`, in the space of `joints`.
    pub fn centres(&self, joints: &[JointTransform], out: &mut Vec<Vec3>) {
        out.clear();
        out.extend(self.spheres.iter().map(|sphere| sphere.centre(joints)));
    }

    /// Share of each sphere in the body's mass. Spheres along a bone overlap, so each stands for a disc of it, which is as long as the way to
    /// the spheres beside it, at most the sphere's diameter.
    pub fn masses(&self) -> Vec<f32> {
        let volume = |(at, sphere): (usize, &BodySphere)| {
            let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten();
            let beside = beside.filter_map(|at| self.spheres.get(at));
            let on_bone = beside.filter(|other| other.joint == sphere.joint);
            let ways = on_bone.map(|other| other.offset.distance(sphere.offset));
            let (mut sum, mut count) = (0.0, 0);
            for way in ways {
                sum += way.min(2.0 * sphere.radius);
                count += 1;
            }
            let length = match count {
                0 => 2.0 * sphere.radius,
                _ => sum / count as f32,
            };
            sphere.radius.powi(2) * length
        };
        let volumes: Vec<f32> = self.spheres.iter().enumerate().map(volume).collect();
        let whole: f32 = volumes.iter().sum();
        volumes.iter().map(|volume| volume / whole).collect()
    }

    /// Maximum distance of any part of the body from the root joint in all poses of `clips` and in
    /// blends of them, in metres.
    pub fn reach(&self, skeleton: &Skeleton, clips: &[Clip]) -> f32 {
        let mut bones: Vec<f32> = skeleton
            .joints()
            .iter()
            .map(|joint| joint.offset.length())
            .collect();
        let of_clip = |clip: usize| {
            let (clip, mut pose) = (&clips[clip], Pose::default());
            let mut longest = vec![0f32; skeleton.len()];
            let frames = if clip.moves_joints() {
                clip.frames()
            } else {
                0
            };
            for frame in 0..frames {
                clip.pose(frame, &mut pose);
                for (bone, translation) in longest.iter_mut().zip(&pose.translations) {
                    *bone = bone.max(translation.length());
                }
            }
            longest
        };
        for longest in in_parallel(0, clips.len(), of_clip) {
            for (bone, longest) in bones.iter_mut().zip(longest) {
                *bone = bone.max(longest);
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

/// The spheres of a bone, except those at its two ends.
fn along(joint: JointId, bone: Vec3, radius: f32) -> impl Iterator<Item = BodySphere> {
    let pieces = (bone.length() / (radius * shares::SPACING)).ceil().max(1.0) as usize;
    (1..pieces).map(move |i| {
        let offset = bone * (i as f32 / pieces as f32);
        BodySphere {
            joint,
            offset,
            radius,
        }
    })
}

/// The last joint of the trunk above the arms: the one that is called a head, otherwise the furthest from the root.
fn head(
    skeleton: &Skeleton,
    carried: &[bool],
    has_limbs: impl Fn(JointId) -> bool,
) -> Option<JointId> {
    let of_body = |id: &JointId| !carried[id.index()] && skeleton.mirror(*id).is_none();
    let is_above_arms = |id: &JointId| {
        let arms = skeleton.ancestry(*id).find(|&joint| has_limbs(joint));
        arms.is_some_and(|joint| joint != *id && joint != JointId::ROOT)
    };
    let is_called = |id: JointId| skeleton.joint(id).name.to_lowercase().contains("head");
    let above: Vec<JointId> = skeleton
        .ids()
        .filter(of_body)
        .filter(is_above_arms)
        .collect();
    let named = above.iter().copied().find(|&id| is_called(id));
    let depth = |id: &JointId| skeleton.ancestry(*id).count();
    named.or_else(|| above.iter().copied().max_by_key(depth))
}

/// Height of the skeleton: the longest chain of trunk and head bones, plus the longest leg.
fn height(skeleton: &Skeleton) -> f32 {
    let carried = carried(skeleton);
    let longest = |sided: bool| {
        let of_body = skeleton.ids().filter(|id| !carried[id.index()]);
        let of_side = of_body.filter(|&id| skeleton.mirror(id).is_some() == sided);
        of_side
            .map(|id| own_chain(skeleton, id, sided))
            .fold(0.0, f32::max)
    };
    let (trunk, leg) = (longest(false), longest(true));
    // If the names do not tell left from right, every chain counts as trunk.
    if leg > 0.0 { trunk + leg } else { 2.0 * trunk }
}

/// Length of the chain of bones from `id` up that belong to the trunk or, if `sided`, to a limb.
fn own_chain(skeleton: &Skeleton, id: JointId, sided: bool) -> f32 {
    skeleton
        .ancestry(id)
        .filter(|&joint| joint != JointId::ROOT)
        .take_while(|&joint| skeleton.mirror(joint).is_some() == sided)
        .map(|joint| skeleton.joint(joint).offset.length())
        .sum()
}
