//! Mirrored clips: left and right exchanged.
//!
//! A motion is reflected in the plane x = 0, and joints exchange their motion with those of the other side, which their names tell.
//! Reflected rotations are rotations again: `v ↦ M·R·M·v`, the reflection `M` before and after. Where the axes of two sides, or of
//! a joint and its child, are no mirror images of each other, as in most captures, each joint is also turned so that its bones at rest point
//! where the reflected bones of its twin do: the rotation of least squares.

use glam::{DMat3, DVec3, Quat, Vec3, Vec4};
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, JointId, Skeleton};
use thiserror::Error;

use super::ClipSet;
use crate::rotation::{nearest_rotation, outer};

/// Reason why clips cannot be mirrored, with the joint.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// No two joints have names of two sides.
    #[error("cannot mirror: no joint names tell left and right, such as LeftHand and RightHand")]
    NoSides,
    /// The name of a joint identifies a side, and the joint of the other side is missing.
    #[error("cannot mirror: joint \"{0}\" has no joint of the other side")]
    NoTwin(String),
    /// The parents of two joints are not those of two sides.
    #[error("cannot mirror: joints \"{joint}\" and \"{twin}\" hang from joints that are no pair")]
    Parents {
        /// A joint.
        joint: String,
        /// The joint of the other side.
        twin: String,
    },
    /// The bones of two joints, or of a joint between the sides, are no mirror images, however the joints are turned.
    #[error(
        "cannot mirror: the bones of \"{joint}\" and \"{twin}\" are no mirror images, {metres:.2} m apart"
    )]
    Bones {
        /// A joint.
        joint: String,
        /// The joint of the other side, or the same one.
        twin: String,
        /// Distance of the reflected offset from the other one, in metres.
        metres: f32,
    },
    /// A mirrored clip is invalid.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

/// The pairs of joints of a skeleton, and the rotations with which it is mirrored.
struct Mirror {
    /// For each joint, the joint of the other side. A joint between the sides is its own twin.
    twins: Vec<JointId>,
    /// For each joint, the rotation from its bones at rest to the reflected bones of its twin.
    rest: Vec<Quat>,
}

impl ClipSet {
    /// Adds a mirrored copy of each clip, with its events. The copies come after all clips, in their order; their names end in
    /// `mirrored`.
    ///
    /// # Errors
    /// The first joint whose side has no other, or that is no mirror image of it.
    pub fn add_mirrored(&mut self) -> Result<(), MirrorError> {
        let mirror = Mirror::of(&self.skeleton, &self.clips)?;
        let count = self.clips.len();
        for index in 0..count {
            let clip = Clip::new(
                &self.skeleton,
                mirror.clip(&self.skeleton, &self.clips[index]),
            )?;
            self.clips.push(clip);
            self.scales.push(self.scales[index]);
        }
        let events = self.events.iter().map(|event| mirror.event(event, count));
        let events: Vec<Event> = events.collect();
        self.events.extend(events);
        Ok(())
    }
}

impl Mirror {
    fn of(skeleton: &Skeleton, clips: &[Clip]) -> Result<Self, MirrorError> {
        let name = |id: JointId| skeleton.joint(id).name.clone();
        let unpaired = |&id: &JointId| skeleton.mirror(id).is_none() && skeleton.names_side(id);
        if let Some(joint) = skeleton.ids().find(unpaired) {
            return Err(MirrorError::NoTwin(name(joint)));
        }
        let twin = |id: JointId| skeleton.mirror(id).unwrap_or(id);
        let twins: Vec<JointId> = skeleton.ids().map(twin).collect();
        let parents = |id: JointId| {
            let of = |id: JointId| skeleton.joint(id).parent;
            of(twins[id.index()]) == of(id).map(|parent| twins[parent.index()])
        };
        if let Some(id) = skeleton.ids().find(|&id| !parents(id)) {
            let (joint, twin) = (name(id), name(twins[id.index()]));
            return Err(MirrorError::Parents { joint, twin });
        }
        if skeleton.ids().eq(twins.iter().copied()) {
            return Err(MirrorError::NoSides);
        }
        let mut mirror = Self {
            twins,
            rest: Vec::with_capacity(skeleton.len()),
        };
        let means = mean_rotations(skeleton, &clips[..clips.len().min(1)]);
        for id in skeleton.ids() {
            let rest = mirror.rest_of(skeleton, &means, id);
            mirror.rest.push(rest);
        }
        mirror.check_bones(skeleton)?;
        Ok(mirror)
    }

    /// The rotation of a joint. What its bones leave open, such as a turn about a single bone, is such that the mirrored motion is in the
    /// mean turned as the motion itself: so the two can be blended. The mean is that of the first clip, which the skeleton is of, too: other
    /// clips may be added, and the mirrored ones stay the same.
    fn rest_of(&self, skeleton: &Skeleton, means: &[Quat], id: JointId) -> Quat {
        /// Weight of the mean rotations beside the bones.
        const PRIOR: f64 = 1e-6;
        let of_parent = |parent: JointId| self.rest[parent.index()];
        let parent = skeleton.joint(id).parent;
        let parent = parent.map_or(Quat::IDENTITY, of_parent);
        let twin = reflected_rotation(means[self.twins[id.index()].index()]);
        let prior = twin.inverse() * parent * means[id.index()];
        let mut sums = DMat3::ZERO;
        let mut weight = 0.0;
        for child in skeleton.children(id) {
            let own = skeleton.joint(child).offset;
            let twin = skeleton.joint(self.twins[child.index()]).offset;
            let (own, twin) = (own.as_dvec3(), reflected(twin).as_dvec3());
            sums += outer(own, twin);
            weight += own.length() * twin.length();
        }
        let weight = if weight > 0.0 { PRIOR * weight } else { 1.0 };
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            sums += outer(axis, prior.as_dquat() * axis) * weight;
        }
        nearest_rotation(sums).as_quat()
    }

    fn check_bones(&self, skeleton: &Skeleton) -> Result<(), MirrorError> {
        /// Maximum difference of captured bones of the two sides, in metres and as a share of the length.
        const DIFFERENCE: (f32, f32) = (0.05, 0.25);
        for id in skeleton.ids().skip(1) {
            let twin = self.twins[id.index()];
            let (one, other) = (skeleton.joint(id).offset, skeleton.joint(twin).offset);
            let parent = skeleton.joint(twin).parent.map_or(0, JointId::index);
            let metres = reflected(one).distance(self.rest[parent] * other);
            if metres > DIFFERENCE.0 + DIFFERENCE.1 * one.length() {
                let name = |id: JointId| skeleton.joint(id).name.clone();
                let (joint, twin) = (name(id), name(twin));
                return Err(MirrorError::Bones {
                    joint,
                    twin,
                    metres,
                });
            }
        }
        Ok(())
    }

    fn clip(&self, skeleton: &Skeleton, clip: &Clip) -> ClipDesc {
        let desc = clip.desc();
        let (roots, rotations, translations) = (&desc.roots, &desc.rotations, &desc.translations);
        let joints = self.twins.len();
        let twin = |index: usize| {
            let (frame, joint) = (index / joints, index % joints);
            frame * joints + self.twins[joint].index()
        };
        let of_parent = |joint: usize| {
            let parent = skeleton.joints()[joint].parent;
            parent.map_or(Quat::IDENTITY, |parent| self.rest[parent.index()].inverse())
        };
        let ending = if desc.name.contains(':') { " " } else { ":" };
        ClipDesc {
            name: format!("{}{ending}mirrored", desc.name),
            frame_rate: desc.frame_rate,
            roots: roots.iter().map(|root| reflected(*root)).collect(),
            rotations: (0..rotations.len())
                .map(|index| {
                    let joint = index % joints;
                    let reflected = reflected_rotation(rotations[twin(index)]);
                    (of_parent(joint) * reflected * self.rest[joint]).normalize()
                })
                .collect(),
            translations: (0..translations.len())
                .map(|index| of_parent(index % joints) * reflected(translations[twin(index)]))
                .collect(),
        }
    }

    fn event(&self, event: &Event, clips: usize) -> Event {
        let joints = event.joints.iter();
        Event {
            clip: event.clip + clips,
            joints: joints.map(|joint| self.twins[joint.index()]).collect(),
            ..event.clone()
        }
    }
}

/// The mean rotation of each joint relative to its parent, over all frames of some clips.
fn mean_rotations(skeleton: &Skeleton, clips: &[Clip]) -> Vec<Quat> {
    let mut sums = vec![Vec4::ZERO; skeleton.len()];
    for clip in clips {
        for frame in clip.desc().rotations.chunks_exact(skeleton.len()) {
            for (sum, rotation) in sums.iter_mut().zip(frame) {
                let rotation = Vec4::from(*rotation);
                *sum += rotation * sum.dot(rotation).signum();
            }
        }
    }
    let mean = |sum: Vec4| sum.try_normalize().map_or(Quat::IDENTITY, Quat::from_vec4);
    sums.into_iter().map(mean).collect()
}

fn reflected(point: Vec3) -> Vec3 {
    Vec3::new(-point.x, point.y, point.z)
}

fn reflected_rotation(rotation: Quat) -> Quat {
    Quat::from_xyzw(rotation.x, -rotation.y, -rotation.z, rotation.w)
}
