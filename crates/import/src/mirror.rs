//! Mirrored clips: left and right exchanged.
//!
//! A motion is reflected in the plane between the sides of the body, and joints exchange their motion with those of the other side,
//! which their names tell. Reflected rotations are rotations again: `v ↦ M·R·M·v`, the reflection `M` before and after. Where the rest pose
//! is not symmetric, as in most captures, joints are turned so that reflected bones point where the reflected motion has them.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, JointId, Skeleton};
use thiserror::Error;

use super::ClipSet;

/// Reason why clips cannot be mirrored, with the joint.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// No two joints have names of two sides.
    #[error("cannot mirror: no joint names tell left and right, such as LeftHand and RightHand")]
    NoSides,
    /// The name of a joint tells a side, and the joint of the other side is missing.
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
    /// The offsets of two joints, or of a joint between the sides, are no mirror images: the joints' axes differ between the sides.
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

/// How a skeleton is mirrored.
struct Mirror {
    /// Joint of the other side, by joint; a joint between the sides is its own.
    twins: Vec<JointId>,
    /// Normal of the plane between the sides.
    normal: Vec3,
    /// For each joint, the rotation from its bone at rest to the reflected bone of its twin.
    rest: Vec<Quat>,
}

impl ClipSet {
    /// Adds a mirrored copy of each clip, with its events. The copies come after all clips, in their order; their names end in
    /// `mirrored`.
    ///
    /// # Errors
    /// The first joint whose side has no other, or that is no mirror image of it.
    pub fn add_mirrored(&mut self) -> Result<(), MirrorError> {
        let mirror = Mirror::of(&self.skeleton)?;
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
    fn of(skeleton: &Skeleton) -> Result<Self, MirrorError> {
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
        let normal = normal(skeleton, &twins).ok_or(MirrorError::NoSides)?;
        let rest = vec![Quat::IDENTITY; twins.len()];
        let mut mirror = Self {
            twins,
            normal,
            rest,
        };
        mirror.rest = skeleton
            .ids()
            .map(|id| mirror.rest_of(skeleton, id))
            .collect();
        mirror.check_bones(skeleton)?;
        Ok(mirror)
    }

    /// The rotation of a joint with one child, whose bone has a direction; of any other joint none.
    fn rest_of(&self, skeleton: &Skeleton, id: JointId) -> Quat {
        let mut children = skeleton.children(id);
        let (Some(child), None) = (children.next(), children.next()) else {
            return Quat::IDENTITY;
        };
        let own = skeleton.joint(child).offset;
        let reflected = self.point(skeleton.joint(self.twins[child.index()]).offset);
        match (own.try_normalize(), reflected.try_normalize()) {
            (Some(own), Some(reflected)) => Quat::from_rotation_arc(own, reflected),
            _ => Quat::IDENTITY,
        }
    }

    fn check_bones(&self, skeleton: &Skeleton) -> Result<(), MirrorError> {
        /// Captured bones of two sides differ by less, in metres and as a share of the length.
        const DIFFERENCE: (f32, f32) = (0.05, 0.25);
        for id in skeleton.ids().skip(1) {
            let twin = self.twins[id.index()];
            let (one, other) = (skeleton.joint(id).offset, skeleton.joint(twin).offset);
            let parent = skeleton.joint(twin).parent.map_or(0, JointId::index);
            let metres = self.point(one).distance(self.rest[parent] * other);
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

    fn point(&self, point: Vec3) -> Vec3 {
        point - 2.0 * self.normal.dot(point) * self.normal
    }

    fn rotation(&self, rotation: Quat) -> Quat {
        let axis = -self.point(Vec3::new(rotation.x, rotation.y, rotation.z));
        Quat::from_xyzw(axis.x, axis.y, axis.z, rotation.w)
    }

    fn clip(&self, skeleton: &Skeleton, clip: &Clip) -> ClipDesc {
        let ClipDesc {
            name,
            frame_rate,
            roots,
            rotations,
            translations,
        } = clip.desc();
        let joints = self.twins.len();
        let twin = |index: usize| {
            let (frame, joint) = (index / joints, index % joints);
            frame * joints + self.twins[joint].index()
        };
        let of_parent = |joint: usize| {
            let parent = skeleton.joints()[joint].parent;
            parent.map_or(Quat::IDENTITY, |parent| self.rest[parent.index()].inverse())
        };
        let ending = if name.contains(':') { " " } else { ":" };
        ClipDesc {
            name: format!("{name}{ending}mirrored"),
            frame_rate: *frame_rate,
            roots: roots.iter().map(|root| self.point(*root)).collect(),
            rotations: (0..rotations.len())
                .map(|index| {
                    let joint = index % joints;
                    let reflected = self.rotation(rotations[twin(index)]);
                    (of_parent(joint) * reflected * self.rest[joint]).normalize()
                })
                .collect(),
            translations: (0..translations.len())
                .map(|index| of_parent(index % joints) * self.point(translations[twin(index)]))
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

/// Direction from one side to the other, along the ground, by the joints at rest; along an axis where it nearly is.
fn normal(skeleton: &Skeleton, twins: &[JointId]) -> Option<Vec3> {
    /// Directions within this angle of an axis are along it: its cosine.
    const ALONG: f32 = 0.98;
    let mut places: Vec<Vec3> = Vec::with_capacity(skeleton.len());
    for joint in skeleton.joints() {
        let parent = joint.parent.map(|parent| places[parent.index()]);
        places.push(parent.map_or(Vec3::ZERO, |parent| parent + joint.offset));
    }
    let mut sum = Vec3::ZERO;
    for (joint, twin) in twins.iter().enumerate() {
        if twin.index() > joint {
            let apart = (places[twin.index()] - places[joint]).with_y(0.0);
            sum += if apart.dot(sum) < 0.0 { -apart } else { apart };
        }
    }
    let normal = sum.try_normalize()?;
    let axis = [Vec3::X, Vec3::Z]
        .into_iter()
        .find(|axis| axis.dot(normal).abs() > ALONG);
    Some(axis.unwrap_or(normal))
}
