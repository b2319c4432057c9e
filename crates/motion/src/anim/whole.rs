//! The joints that a file has above and beside the body, as `Reference`, `Armature` or a root on the ground that carries the path.
//!
//! They are no joints of the [`Skeleton`], whose root is the body's. Motions that leave the library get them back: all of them at rest, but the
//! one that carried the path in the file, which follows the body's root.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::{Facing, Joint, JointId, JointTransform, Pose, Skeleton, forward_kinematics};

/// All joints of a file, of which some are those of a [`Skeleton`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileJoints {
    /// The joints, parents first. The offsets of the body's are not used, and those of the others are their places at rest.
    pub joints: Vec<Joint>,
    /// Rotation of each joint at rest, relative to its parent. Those of the body's joints are not used.
    pub rotations: Vec<Quat>,
    /// The joints of the skeleton, in its order.
    pub body: Vec<JointId>,
    /// The joint above the body that carries the path. `None` if all joints above it are still.
    pub carrier: Option<PathCarrier>,
}

/// How a joint above the body carries its path: below the body's root, at the same place on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathCarrier {
    /// The joint.
    pub joint: JointId,
    /// Height in metres: above the ground, or if it rises, above the body's root.
    pub height: f32,
    /// Whether it goes up and down with the body's root.
    pub rises: bool,
    /// Rotation in the space of the motion or, if it turns, from the body's facing direction.
    pub rotation: Quat,
    /// Whether it turns with the body's facing direction.
    pub turns: bool,
}

impl FileJoints {
    /// Names of the joints above the body, the topmost first.
    pub fn above(&self) -> impl Iterator<Item = &str> {
        let above = self.above_body();
        above.map(|id| self.joints[id.index()].name.as_str())
    }

    /// Names of the joints that are neither of the body nor above it.
    pub fn beside(&self) -> impl Iterator<Item = &str> {
        let is_other = |&index: &usize| {
            let id = JointId(index as u16);
            !self.body.contains(&id) && !self.above_body().any(|above| above == id)
        };
        let others = (0..self.joints.len()).filter(is_other);
        others.map(|index| self.joints[index].name.as_str())
    }

    fn above_body(&self) -> impl DoubleEndedIterator<Item = JointId> {
        let parent = |id: &JointId| self.joints.get(id.index())?.parent;
        let root = self.body.first().and_then(parent);
        let mut above: Vec<JointId> = std::iter::successors(root, parent).collect();
        above.reverse();
        above.into_iter()
    }

    /// Whether they are the joints of a file that `body` is a part of.
    pub(super) fn are_around(&self, body: &Skeleton) -> bool {
        let Ok(all) = Skeleton::new(self.joints.clone()) else {
            return false;
        };
        let parent = |id: JointId| self.joints[id.index()].parent;
        let is_part = |(index, &id): (usize, &JointId)| {
            let own = body.joints()[index].parent;
            let is_known = id.index() < all.len() && id != JointId::ROOT;
            is_known && own.is_none_or(|own| parent(id) == Some(self.body[own.index()]))
        };
        let is_unit = |rotation: &Quat| rotation.is_finite() && rotation.is_normalized();
        self.body.len() == body.len()
            && self.rotations.len() == all.len()
            && self.rotations.iter().all(is_unit)
            && self.body.iter().enumerate().all(is_part)
            && self.carrier.is_none_or(|carrier| {
                self.above_body().any(|above| above == carrier.joint)
                    && carrier.height.abs() <= Skeleton::FURTHEST
                    && is_unit(&carrier.rotation)
            })
    }
}

/// The skeleton as the file had it, with the poses of a body on it ([`Skeleton::whole`]).
#[derive(Clone, Debug)]
pub struct WholeSkeleton {
    /// All joints of the file.
    pub skeleton: Skeleton,
    file: FileJoints,
    body: Skeleton,
    facing: Facing,
    own: Vec<Option<JointId>>,
}

impl Skeleton {
    /// The skeleton with the joints that its file has above and beside it. `None` if the file has no others.
    pub fn whole(&self) -> Option<WholeSkeleton> {
        let file = self.file_joints()?.clone();
        let mut joints = file.joints.clone();
        let mut own = vec![None; joints.len()];
        for (index, (id, joint)) in file.body.iter().zip(self.joints()).enumerate() {
            own[id.index()] = Some(JointId(index as u16));
            joints[id.index()].offset = joint.offset;
        }
        Some(WholeSkeleton {
            skeleton: Self::new(joints).ok()?,
            file,
            body: self.clone(),
            facing: Facing::of(self),
            own,
        })
    }
}

impl WholeSkeleton {
    /// The joint that is a joint of the body.
    pub fn joint(&self, of_body: JointId) -> JointId {
        self.file.body[of_body.index()]
    }

    /// Whether a joint is one of the body.
    pub fn is_of_body(&self, joint: JointId) -> bool {
        self.own[joint.index()].is_some()
    }

    /// Writes all joints' frames in the space of the motion to `out`. `body` has those of the body's joints.
    pub fn places(&self, body: &[JointTransform], out: &mut Vec<JointTransform>) {
        out.clear();
        for (index, joint) in self.skeleton.joints().iter().enumerate() {
            let place = match (self.own[index], self.file.carrier) {
                (Some(own), _) => body[own.index()],
                (None, Some(carrier)) if carrier.joint.index() == index => {
                    self.carried_path(&carrier, body)
                }
                _ => {
                    let parent = joint.parent.map(|parent| out[parent.index()]);
                    let parent = parent.unwrap_or(JointTransform::IDENTITY);
                    JointTransform {
                        rotation: (parent.rotation * self.file.rotations[index]).normalize(),
                        translation: parent.point(joint.offset),
                    }
                }
            };
            out.push(place);
        }
    }

    fn carried_path(&self, carrier: &PathCarrier, body: &[JointTransform]) -> JointTransform {
        let place = self.facing.placement(body);
        let height = match carrier.rises {
            true => body[0].translation.y + carrier.height,
            false => carrier.height,
        };
        JointTransform {
            rotation: match carrier.turns {
                true => (place.rotation() * carrier.rotation).normalize(),
                false => carrier.rotation,
            },
            translation: Vec3::new(place.x, height, place.z),
        }
    }

    /// Writes the pose of all joints to `out`, with their translations.
    pub fn pose(&self, body: &Pose, out: &mut Pose) {
        let (mut joints, mut places) = (Vec::new(), Vec::new());
        forward_kinematics(&self.body, body, &mut joints);
        self.places(&joints, &mut places);
        out.rotations.clone_from(&self.file.rotations);
        out.translations.clear();
        for (index, joint) in self.skeleton.joints().iter().enumerate() {
            let is_placed = self
                .file
                .carrier
                .is_some_and(|carrier| carrier.joint.index() == index)
                || self.own[index] == Some(JointId::ROOT);
            let (rotation, place) = match (self.own[index], joint.parent) {
                (_, parent) if is_placed => {
                    let parent = parent.map(|parent| places[parent.index()]);
                    let parent = parent.unwrap_or(JointTransform::IDENTITY);
                    let back = parent.rotation.conjugate();
                    let (own, from) = (places[index], parent.translation);
                    (
                        (back * own.rotation).normalize(),
                        back * (own.translation - from),
                    )
                }
                (Some(own), _) => body.local(&self.body, own),
                _ => (self.file.rotations[index], joint.offset),
            };
            out.rotations[index] = rotation;
            out.translations.push(place);
        }
        out.root = out.translations[0];
    }
}
