use glam::Vec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::FileJoints;
use super::limbs::{Side, loose_reading, readings};

/// Index of a joint in its [`Skeleton`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct JointId(pub u16);

impl JointId {
    /// The root of every skeleton.
    pub const ROOT: Self = Self(0);

    /// The id as an index into per-joint arrays.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointKind {
    /// A joint with a rotation in every frame.
    Moving,
    /// The tip of a bone (End Site in BVH): a position without a rotation.
    EndSite,
}

/// One joint of a [`Skeleton`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Name, unique in the skeleton. The name of an end site is its parent's name with `_End`.
    pub name: String,
    /// Parent, or `None` for the root.
    pub parent: Option<JointId>,
    /// Position in the parent's frame in the rest pose, in metres.
    pub offset: Vec3,
    /// Kind of the joint.
    pub kind: JointKind,
}

/// An immutable tree of joints. The root is first, and parents come before children.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredSkeleton", into = "StoredSkeleton")]
pub struct Skeleton {
    joints: Vec<Joint>,
    /// Left and right hand, left and right foot, if they are not what the names say.
    ends: Option<[JointId; 4]>,
    /// With such ends, side and mirrored joint of each joint.
    twins: Vec<Option<(Side, JointId)>>,
    /// The joints of its file, if that has others.
    file: Option<Box<FileJoints>>,
}

#[derive(Serialize, Deserialize)]
struct StoredSkeleton {
    joints: Vec<Joint>,
    ends: Option<[JointId; 4]>,
    file: Option<Box<FileJoints>>,
}

/// Reason why a list of joints is not a skeleton.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SkeletonError {
    /// There are no joints.
    #[error("the skeleton has no joints")]
    Empty,
    /// There are more joints than the maximum.
    #[error("the skeleton has {0} joints; {max} is the most", max = Skeleton::MAX_JOINTS)]
    TooMany(usize),
    /// The first joint has a parent, or a later joint has none.
    #[error("joint \"{0}\": the first joint, and no other, must be without a parent")]
    Root(String),
    /// A joint comes before its parent.
    #[error("joint \"{0}\" stands before its parent")]
    Order(String),
    /// Two joints have the same name.
    #[error("two joints are named \"{0}\"")]
    Duplicate(String),
    /// The hands and feet are not four joints, or one carries another.
    #[error("the skeleton's hands and feet are no four joints of their own")]
    Ends,
    /// The joints of the file are no tree that the skeleton is a part of.
    #[error("the skeleton is no part of its file's joints")]
    File,
    /// An offset is NaN or longer than [`Skeleton::FURTHEST`].
    #[error("joint \"{0}\" has an offset that is not finite or longer than {max} m", max = Skeleton::FURTHEST)]
    NotFinite(String),
}

impl Skeleton {
    /// Maximum number of joints.
    pub const MAX_JOINTS: usize = 4096;

    /// Maximum length of an offset and distance of a position in a clip, in metres. It keeps sums
    /// over all joints, and their squares, finite.
    pub const FURTHEST: f32 = 1e6;

    /// Whether a position is finite and at most [`Skeleton::FURTHEST`] from the origin.
    pub fn is_near(place: Vec3) -> bool {
        place.is_finite() && place.length() <= Self::FURTHEST
    }

    /// Creates a skeleton after checking that `joints` form a tree with parents before children.
    ///
    /// # Errors
    /// The first invalid joint, by name.
    pub fn new(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        if joints.is_empty() {
            return Err(SkeletonError::Empty);
        }
        if joints.len() > Self::MAX_JOINTS {
            return Err(SkeletonError::TooMany(joints.len()));
        }
        let mut names = std::collections::HashSet::new();
        for (index, joint) in joints.iter().enumerate() {
            let name = || joint.name.clone();
            if (index == 0) != joint.parent.is_none() {
                return Err(SkeletonError::Root(name()));
            }
            if joint.parent.is_some_and(|parent| parent.index() >= index) {
                return Err(SkeletonError::Order(name()));
            }
            if !Self::is_near(joint.offset) {
                return Err(SkeletonError::NotFinite(name()));
            }
            if !names.insert(joint.name.as_str()) {
                return Err(SkeletonError::Duplicate(name()));
            }
        }
        Ok(Self {
            joints,
            ends: None,
            twins: Vec::new(),
            file: None,
        })
    }

    /// The skeleton with left and right hand, left and right foot, whatever its joints are called. `None` if they are not four joints of it
    /// of which none carries another.
    #[must_use]
    pub fn with_ends(mut self, ends: [JointId; 4]) -> Option<Self> {
        let known = ends.iter().all(|end| end.index() < self.len());
        let pairs = || ends.iter().flat_map(|&a| ends.iter().map(move |&b| (a, b)));
        let meeting = pairs()
            .filter(|&(a, b)| known && self.carries(a, b))
            .count();
        if !known || meeting != ends.len() {
            return None;
        }
        let mut twins = vec![None; self.len()];
        let mut pair = |a: JointId, b: JointId| {
            twins[a.index()] = Some((Side::Left, b));
            twins[b.index()] = Some((Side::Right, a));
        };
        for [left, right] in [[ends[0], ends[1]], [ends[2], ends[3]]] {
            let own = |end: JointId, other: JointId| -> Vec<JointId> {
                let mut own: Vec<JointId> = self
                    .ancestry(end)
                    .take_while(|&joint| !self.carries(joint, other))
                    .collect();
                own.reverse();
                own
            };
            let (lefts, rights) = (own(left, right), own(right, left));
            if lefts.len() == rights.len() {
                lefts.iter().zip(&rights).for_each(|(&a, &b)| pair(a, b));
            } else {
                pair(lefts[0], rights[0]);
                pair(left, right);
            }
            let mut open = vec![(left, right)];
            while let Some((a, b)) = open.pop() {
                let [a, b] = [a, b].map(|end| self.children(end).collect::<Vec<_>>());
                if a.len() == b.len() {
                    a.iter().zip(&b).for_each(|(&a, &b)| pair(a, b));
                    open.extend(a.into_iter().zip(b));
                }
            }
        }
        (self.ends, self.twins) = (Some(ends), twins);
        Some(self)
    }

    /// The ends of [`Skeleton::with_ends`].
    pub fn ends(&self) -> Option<[JointId; 4]> {
        self.ends
    }

    /// The skeleton with the joints of the file that it is a part of. `None` if it is no part of them.
    #[must_use]
    pub fn with_file(mut self, file: FileJoints) -> Option<Self> {
        let are_around = file.are_around(&self);
        self.file = Some(Box::new(file));
        are_around.then_some(self)
    }

    /// The joints of the file that it is a part of, if that has others.
    pub fn file_joints(&self) -> Option<&FileJoints> {
        self.file.as_deref()
    }

    /// All joints, parents before children.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of joints, including end sites.
    #[allow(
        clippy::len_without_is_empty,
        reason = "a skeleton has at least its root"
    )]
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Ids of all joints, parents before children.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = JointId> + use<> {
        (0..self.joints.len() as u16).map(JointId)
    }

    /// The joint with an id.
    pub fn joint(&self, id: JointId) -> &Joint {
        &self.joints[id.index()]
    }

    /// Id of the joint with a name.
    pub fn find(&self, name: &str) -> Option<JointId> {
        self.ids().find(|&id| self.joint(id).name == name)
    }

    /// Children of `id`.
    pub fn children(&self, id: JointId) -> impl Iterator<Item = JointId> + '_ {
        self.ids()
            .filter(move |&child| self.joint(child).parent == Some(id))
    }

    /// Joints from `id` up to the root, both included.
    pub fn ancestry(&self, id: JointId) -> impl Iterator<Item = JointId> + '_ {
        std::iter::successors(Some(id), |&joint| self.joint(joint).parent)
    }

    /// Whether `id` is the joint `above` or a descendant of it.
    pub fn carries(&self, above: JointId, id: JointId) -> bool {
        self.ancestry(id).any(|joint| joint == above)
    }

    /// Length of the bones from the root to `id`, in metres.
    pub fn chain_length(&self, id: JointId) -> f32 {
        self.ancestry(id)
            .filter(|&joint| joint != JointId::ROOT)
            .map(|joint| self.joint(joint).offset.length())
            .sum()
    }

    /// Mirrored joint on the other side of the body, if joint names identify it: `LeftHand` ↔
    /// `RightHand`, `hand.l` ↔ `hand.r`, `Bip01 L Hand` ↔ `Bip01 R Hand`.
    pub fn mirror(&self, id: JointId) -> Option<JointId> {
        self.sided(id).map(|(_, twin)| twin)
    }

    /// Whether the joint's name can be read as one of a side of the body.
    pub fn names_side(&self, id: JointId) -> bool {
        readings(&self.joint(id).name).next().is_some()
    }

    /// Side of a joint and its mirrored joint, if joint names identify them.
    pub(super) fn sided(&self, id: JointId) -> Option<(Side, JointId)> {
        if let Some(twin) = self.twins.get(id.index()) {
            return *twin;
        }
        let name = &self.joint(id).name;
        let mut all = readings(name).chain(loose_reading(name));
        all.find_map(|(side, twin)| Some((side, self.find(&twin)?)))
    }

    /// Compares the joint trees of two skeletons and returns the names that differ. The list is
    /// empty if both have the same joints in the same tree.
    ///
    /// Offsets may differ, because captures of one person differ by calibration.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let parent_name =
            |skeleton: &Self, joint: &Joint| joint.parent.map(|p| skeleton.joint(p).name.clone());
        let missing = |from: &Self, to: &Self| -> Vec<String> {
            from.joints
                .iter()
                .filter(|joint| {
                    to.find(&joint.name).is_none_or(|twin| {
                        let twin = to.joint(twin);
                        parent_name(from, joint) != parent_name(to, twin) || joint.kind != twin.kind
                    })
                })
                .map(|joint| joint.name.clone())
                .collect()
        };
        let mut names = missing(self, other);
        names.extend(missing(other, self));
        names.sort();
        names.dedup();
        if names.is_empty() {
            let pairs = self.joints.iter().zip(&other.joints);
            let moved = pairs.filter(|(a, b)| a.name != b.name);
            names = moved.map(|(a, _)| a.name.clone()).collect();
        }
        names
    }
}

impl TryFrom<StoredSkeleton> for Skeleton {
    type Error = SkeletonError;
    fn try_from(stored: StoredSkeleton) -> Result<Self, SkeletonError> {
        let mut skeleton = Self::new(stored.joints)?;
        if let Some(ends) = stored.ends {
            skeleton = skeleton.with_ends(ends).ok_or(SkeletonError::Ends)?;
        }
        match stored.file {
            Some(file) => skeleton.with_file(*file).ok_or(SkeletonError::File),
            None => Ok(skeleton),
        }
    }
}

impl From<Skeleton> for StoredSkeleton {
    fn from(skeleton: Skeleton) -> Self {
        Self {
            joints: skeleton.joints,
            ends: skeleton.ends,
            file: skeleton.file,
        }
    }
}
