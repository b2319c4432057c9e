use super::LodError;
use super::displacement::LevelError;
use super::frames::Place;
use crate::anim::{JointId, JointTransform, Skeleton};

/// A level of detail by its index in [`Levels::levels`]: level 0 keeps all joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LevelId(pub u16);

impl LevelId {
    /// The index in [`Levels::levels`].
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// One level of detail: the kept joints with their parents, and the attachments of the removed joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The kept joints, breadth-first from the root: parents stand before their children.
    pub kept: Vec<JointId>,
    /// Nearest kept ancestor of each kept joint, as an index into `kept`; `None` for the root.
    pub parents: Vec<Option<u16>>,
    /// The joint that the next finer level keeps and this one does not; `None` at level 0.
    pub removed: Option<JointId>,
    /// Energy of `removed` on the next finer level, in joules; 0 at level 0.
    pub energy: f32,
    /// Attachment of each joint of the skeleton. A kept joint is attached to itself.
    #[doc(hidden)]
    pub attachments: Vec<Attachment>,
    /// Displacement of the body.
    pub error: LevelError,
}

/// The rigid attachment of a joint of the full skeleton to a kept joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// The kept joint, as an index into [`Level::kept`].
    pub carrier: u16,
    /// The joint's transform in the carrier's frame; the identity for a kept joint.
    pub offset: JointTransform,
}

/// The levels of a skeleton. Each keeps one joint less than the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// The levels, finest first. The first keeps all joints.
    pub levels: Vec<Level>,
    /// Energy of each joint of the full skeleton, in joules; empty for [`Levels::in_order`].
    pub energies: Vec<f32>,
    /// Median over frames of the height from the lowest joint to the highest, in metres; 0 for [`Levels::in_order`].
    pub height: f32,
    /// Largest distance of a point of the body from the root, in metres; 0 for [`Levels::in_order`].
    pub reach: f32,
    /// Thickness of the body around its bones, in metres: [`super::LevelSettings::skin`].
    pub skin: f32,
}

impl Level {
    /// The level that keeps the root and the joints for which `keeps` is true. Removed joints are attached as in the rest pose.
    pub(super) fn of(skeleton: &Skeleton, keeps: &[bool]) -> Self {
        let is_kept = |id: JointId| id == JointId::ROOT || keeps[id.index()];
        let mut children: Vec<Vec<JointId>> = vec![Vec::new(); skeleton.len()];
        let mut attachments: Vec<(JointId, Place)> = Vec::with_capacity(skeleton.len());
        for id in skeleton.ids() {
            let joint = skeleton.joint(id);
            let above = joint.parent.map(|parent| attachments[parent.index()]);
            attachments.push(match above {
                Some((carrier, attachment)) if !is_kept(id) => {
                    let translation = attachment.translation + joint.offset.as_dvec3();
                    (
                        carrier,
                        Place {
                            translation,
                            ..attachment
                        },
                    )
                }
                Some((parent, _)) => {
                    children[parent.index()].push(id);
                    (id, Place::IDENTITY)
                }
                None => (id, Place::IDENTITY),
            });
        }
        let (mut kept, mut parents) = (vec![JointId::ROOT], vec![None]);
        let mut next = 0;
        while next < kept.len() {
            for &child in &children[kept[next].index()] {
                kept.push(child);
                parents.push(Some(next as u16));
            }
            next += 1;
        }
        let mut level = Self {
            kept,
            parents,
            removed: None,
            energy: 0.0,
            attachments: Vec::new(),
            error: LevelError::default(),
        };
        level.attach(&attachments);
        level
    }

    /// Sets the attachments of all joints.
    pub(super) fn attach(&mut self, attachments: &[(JointId, Place)]) {
        let places = self.places(attachments.len());
        let attachment = |&(carrier, offset): &(JointId, Place)| Attachment {
            carrier: places[carrier.index()].unwrap_or(0) as u16,
            offset: JointTransform {
                rotation: offset.rotation.as_quat(),
                translation: offset.translation.as_vec3(),
            },
        };
        self.attachments = attachments.iter().map(attachment).collect();
    }

    /// Checks that the level is a tree of joints of this skeleton, each below its parent.
    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), LodError> {
        for (index, &id) in self.kept.iter().enumerate() {
            let parent = match self.parents.get(index) {
                Some(&parent) => parent.map(usize::from),
                None => return Err(LodError::Level(id.0)),
            };
            let fits = match parent {
                None => index == 0 && id == JointId::ROOT,
                Some(parent) => {
                    let is_above = |above: JointId| above == self.kept[parent];
                    id.index() < skeleton.len()
                        && parent < index
                        && skeleton.ancestry(id).skip(1).any(is_above)
                }
            };
            if !fits {
                return Err(LodError::Level(id.0));
            }
        }
        let mut attachments = self.attachments.iter().zip(skeleton.ids());
        let wrong =
            attachments.find(|(attachment, _)| usize::from(attachment.carrier) >= self.kept.len());
        match wrong {
            Some((_, id)) => Err(LodError::Level(id.0)),
            None if self.attachments.len() == skeleton.len() => Ok(()),
            None => Err(LodError::Level(self.attachments.len() as u16)),
        }
    }

    /// Position in `kept` of each of the skeleton's `joints`.
    pub(super) fn places(&self, joints: usize) -> Vec<Option<usize>> {
        let mut places = vec![None; joints];
        for (index, id) in self.kept.iter().enumerate() {
            places[id.index()] = Some(index);
        }
        places
    }

    /// Every kept joint except the root with its parent, as indices into `kept`.
    pub(super) fn bones(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let parents = self.parents.iter().enumerate();
        parents.filter_map(|(child, parent)| Some((child, usize::from((*parent)?))))
    }

    /// The parent of a kept joint, then its children, as indices into `kept`.
    pub(super) fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let parent = self.parents[index].map(usize::from);
        let children = self.bones().filter(move |&(_, parent)| parent == index);
        parent.into_iter().chain(children.map(|(child, _)| child))
    }

    /// Position of a joint in `kept`, or `None` for a removed joint.
    #[must_use]
    pub fn index_of(&self, joint: JointId) -> Option<usize> {
        self.kept.iter().position(|&kept| kept == joint)
    }
}

impl Levels {
    /// Levels by a given order of removal; each joint comes with its energy in joules. Removed joints are attached to their nearest kept
    /// ancestor as in the rest pose. Errors are not measured.
    ///
    /// # Errors
    /// A joint that is the root, unknown, or named twice.
    pub fn in_order(skeleton: &Skeleton, order: &[(JointId, f32)]) -> Result<Self, LodError> {
        let mut keeps = vec![true; skeleton.len()];
        let mut levels = vec![Level::of(skeleton, &keeps)];
        for &(joint, energy) in order {
            match keeps.get_mut(joint.index()) {
                Some(kept) if *kept && joint != JointId::ROOT => *kept = false,
                _ => return Err(LodError::NotRemovable(joint.0)),
            }
            levels.push(Level {
                removed: Some(joint),
                energy,
                ..Level::of(skeleton, &keeps)
            });
        }
        Ok(Self {
            levels,
            energies: Vec::new(),
            height: 0.0,
            reach: 0.0,
            skin: 0.0,
        })
    }
}
