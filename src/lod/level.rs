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

/// One level of detail: the joints that are kept, of whom each hangs, and where the others are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Parents first, breadth-first; the root is the first.
    pub kept: Vec<JointId>,
    /// Of each kept joint the nearest kept one above it, as an index into `kept`; `None` for the
    /// root alone.
    pub parents: Vec<Option<u16>>,
    /// The joint that this level has lost against the one before; `None` at level 0.
    pub removed: Option<JointId>,
    /// The energy that `removed` had when it was taken out, joules; 0 at level 0.
    pub energy: f32,
    /// Of each joint of the skeleton, the kept joint that it is drawn with: a kept one with itself.
    pub seats: Vec<Seated>,
    /// What this level does to the body.
    pub error: LevelError,
}

/// Where a joint of the full skeleton is drawn on a level: rigidly on a kept joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seated {
    /// The kept joint, as an index into [`Level::kept`].
    pub carrier: u16,
    /// The joint's frame in the carrier's; the identity for a kept joint.
    pub offset: JointTransform,
}

/// The levels of a skeleton: each has one joint less than the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// The first keeps all joints.
    pub levels: Vec<Level>,
    /// Of each joint of the skeleton its energy before any was removed, joules; empty where none was taken.
    pub energies: Vec<f32>,
    /// From the body's lowest joint to its highest, the median over frames, metres; 0 where no clip was looked at.
    pub height: f32,
    /// From the root to the body's farthest point, metres; 0 where no clip was looked at.
    pub reach: f32,
    /// How thick the body is around its bones, metres: [`super::LevelSettings::skin`].
    pub skin: f32,
}

impl Level {
    /// The level of `skeleton` that keeps the joints for which `keeps` is true; the root stays in any case. Removed joints are drawn as in the rest
    /// pose.
    pub(super) fn of(skeleton: &Skeleton, keeps: &[bool]) -> Self {
        let is_kept = |id: JointId| id == JointId::ROOT || keeps[id.index()];
        let mut children: Vec<Vec<JointId>> = vec![Vec::new(); skeleton.len()];
        let mut seats: Vec<(JointId, Place)> = Vec::with_capacity(skeleton.len());
        for id in skeleton.ids() {
            let joint = skeleton.joint(id);
            let above = joint.parent.map(|parent| seats[parent.index()]);
            seats.push(match above {
                Some((carrier, seat)) if !is_kept(id) => {
                    let translation = seat.translation + joint.offset.as_dvec3();
                    (
                        carrier,
                        Place {
                            translation,
                            ..seat
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
            seats: Vec::new(),
            error: LevelError::default(),
        };
        level.sit(&seats);
        level
    }

    /// Draws each joint of the skeleton on the kept one that is named.
    pub(super) fn sit(&mut self, seats: &[(JointId, Place)]) {
        let places = self.places(seats.len());
        let seated = |&(carrier, offset): &(JointId, Place)| Seated {
            carrier: places[carrier.index()].unwrap_or(0) as u16,
            offset: JointTransform {
                rotation: offset.rotation.as_quat(),
                translation: offset.translation.as_vec3(),
            },
        };
        self.seats = seats.iter().map(seated).collect();
    }

    /// Whether it is a tree of joints of this skeleton, each below its parent.
    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), LodError> {
        for (index, &id) in self.kept.iter().enumerate() {
            let parent = match self.parents.get(index) {
                Some(&parent) => parent.map(usize::from),
                None => return Err(LodError::Level(id.0)),
            };
            let fits = match parent {
                None => index == 0 && id == JointId::ROOT,
                Some(parent) => {
                    id.index() < skeleton.len() && parent < index && {
                        skeleton.ancestry(id).skip(1)
                    }
                    .any(|above| above == self.kept[parent])
                }
            };
            if !fits {
                return Err(LodError::Level(id.0));
            }
        }
        let seats = self.seats.iter().zip(skeleton.ids());
        let wrong = { seats }.find(|(seat, _)| usize::from(seat.carrier) >= self.kept.len());
        match wrong {
            Some((_, id)) => Err(LodError::Level(id.0)),
            None if self.seats.len() == skeleton.len() => Ok(()),
            None => Err(LodError::Level(self.seats.len() as u16)),
        }
    }

    /// Of each of the skeleton's `joints`, where it stands in `kept`.
    pub(super) fn places(&self, joints: usize) -> Vec<Option<usize>> {
        let mut places = vec![None; joints];
        for (index, id) in self.kept.iter().enumerate() {
            places[id.index()] = Some(index);
        }
        places
    }

    /// Every joint but the root with its parent, as indices into `kept`.
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

    /// Where a joint stands in `kept`.
    #[must_use]
    pub fn index_of(&self, joint: JointId) -> Option<usize> {
        self.kept.iter().position(|&kept| kept == joint)
    }
}

impl Levels {
    /// The levels that come of removing joints in this order, each joint with its energy in joules. Removed joints are drawn as in the
    /// rest pose, on the nearest kept joint above; nothing is measured.
    ///
    /// # Errors
    /// A joint that is the root, none of the skeleton, or named twice.
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
