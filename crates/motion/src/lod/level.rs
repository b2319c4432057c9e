//! Levels of detail: the joints that each keeps, their motion, and what is drawn in place of the joints that it has removed.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1: the children of a removed joint become children of its parent. Differs: they keep their
//! motion in model space, so their local motion includes that of the removed joint.
//!
//! **Skin.** A vertex is skinned by the matrix of a joint of the full skeleton, times the joint's inverse bind matrix. On a level
//! where that joint is removed, its matrix is the carrier's times the attachment's offset ([`Level::attachments`]). So a renderer draws
//! every level with one mesh: it multiplies the offsets and the inverse bind matrices once for each level.
//!
//! **Blending.** The paper leaves the transitions between levels to future work (4.2: a bent joint becomes straight when it is
//! removed). All other joints are equal on both levels, and joints attached to the removed one follow it. So one matrix is the whole
//! difference. It is blended after the finer level has been posed, when no other joint depends on it.

use glam::{Affine3A, Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::LodError;
use crate::anim::{
    Clip, ClipDesc, JointId, JointKind, JointTransform, Place, Pose, Skeleton, place_all,
};

/// A level of detail by its index in [`Levels::levels`]: level 0 keeps all joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LevelId(pub u16);

impl LevelId {
    /// The index in [`Levels::levels`].
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
    pub attachments: Vec<Attachment>,
    /// Displacement of the body.
    pub error: LevelError,
}

/// Displacement of the body by a level, over all frames.
///
/// The points of a joint are the joint itself, the far ends of its bones, and the corners of boxes that contain everything within
/// [`super::LevelSettings::skin`] of the bones. So no part of the body is displaced further than the maximum. Points of kept joints are
/// not displaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LevelError {
    /// Mean displacement of the points of removed joints, in metres.
    pub mean: f32,
    /// Largest displacement of any point in any frame, in metres.
    pub max: f32,
    /// Mean displacement of the points of all joints, in metres.
    pub body_mean: f32,
    /// Largest distance between a point on this level and on the next finer one in the same frame, in metres.
    pub step: f32,
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
    pub(super) fn keeping(skeleton: &Skeleton, keeps: &[bool]) -> Self {
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
        let mut levels = vec![Level::keeping(skeleton, &keeps)];
        for &(joint, energy) in order {
            match keeps.get_mut(joint.index()) {
                Some(kept) if *kept && joint != JointId::ROOT => *kept = false,
                _ => return Err(LodError::NotRemovable(joint.0)),
            }
            levels.push(Level {
                removed: Some(joint),
                energy,
                ..Level::keeping(skeleton, &keeps)
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

impl Level {
    /// Converts the clip to what this level draws, on the full skeleton: kept joints move as before, removed joints follow their
    /// carriers. The result plays wherever clips play.
    ///
    /// # Errors
    /// A clip or a level of another skeleton, or positions out of range.
    pub fn drawn(&self, skeleton: &Skeleton, clip: &Clip) -> Result<Clip, LodError> {
        check(skeleton, clip)?;
        self.check(skeleton)?;
        let mut places = Vec::new();
        let pose = |frame: usize, pose: &mut Pose| {
            pose.root = clip.root(frame);
            pose.rotations.clear();
            pose.translations.clear();
            place_all(skeleton, clip.at(frame as f32), &mut places);
            let drawn: Vec<Place> = self
                .attachments
                .iter()
                .map(|attachment| {
                    let carrier = places[self.kept[usize::from(attachment.carrier)].index()];
                    carrier.after(&Place {
                        rotation: attachment.offset.rotation.as_dquat(),
                        translation: attachment.offset.translation.as_dvec3(),
                    })
                })
                .collect();
            for (joint, place) in skeleton.joints().iter().zip(&drawn) {
                let local = match joint.parent {
                    Some(parent) => drawn[parent.index()].sees(place),
                    None => *place,
                };
                // An end site has a position only.
                pose.rotations.push(match joint.kind {
                    JointKind::EndSite => Quat::IDENTITY,
                    JointKind::Moving => local.rotation.as_quat(),
                });
                pose.translations.push(match joint.parent {
                    Some(_) => local.translation.as_vec3(),
                    None => Vec3::ZERO,
                });
            }
        };
        let desc = ClipDesc::of_poses(clip.name(), clip.frame_rate(), clip.frames(), pose);
        Ok(Clip::new(skeleton, desc)?)
    }
}

/// Local motion of a [`Level`]'s joints.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelMotion {
    /// Frames per second.
    pub frame_rate: f32,
    /// Number of frames, at least 1.
    pub frames: usize,
    /// [`Level::parents`].
    pub parents: Vec<Option<u16>>,
    /// One track for each kept joint, in the level's order.
    pub tracks: Vec<LevelTrack>,
}

/// Motion of one joint in the frame of its parent in the level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelTrack {
    /// One rotation for each frame. Neighbouring quaternions have a positive dot product, so that a linear interpolation takes the shorter
    /// arc.
    pub rotations: Vec<Quat>,
    /// Positions; the root's are in model space.
    pub translations: Translations,
}

/// Positions of a joint in its parent's frame, in metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Translations {
    /// One position for all frames.
    Fixed(Vec3),
    /// One position for each frame: of the root, of children of removed joints, and of joints that the clip translates.
    Moving(Vec<Vec3>),
}

impl Translations {
    /// Positions that differ by less count as equal, in metres.
    pub const SAME: f32 = 1e-6;

    fn from_places(places: Vec<Vec3>) -> Self {
        let first = places.first().copied().unwrap_or(Vec3::ZERO);
        if places
            .iter()
            .all(|place| (*place - first).abs().max_element() <= Self::SAME)
        {
            Self::Fixed(first)
        } else {
            Self::Moving(places)
        }
    }

    /// The position in one frame.
    pub fn at(&self, frame: usize) -> Vec3 {
        match self {
            Self::Fixed(place) => *place,
            Self::Moving(places) => places[frame],
        }
    }
}

impl LevelMotion {
    /// The local motion of `clip` on `level`. In model space every kept joint moves as in the clip, up to rounding.
    ///
    /// # Errors
    /// A clip or a level of another skeleton.
    pub fn new(skeleton: &Skeleton, clip: &Clip, level: &Level) -> Result<Self, LodError> {
        check(skeleton, clip)?;
        level.check(skeleton)?;
        let tracks = level.kept.iter().zip(&level.parents).map(|(&id, parent)| {
            let above = parent.map(|parent| level.kept[usize::from(parent)]);
            let upwards = skeleton
                .ancestry(id)
                .take_while(|&joint| Some(joint) != above);
            let chain: Vec<JointId> = upwards.collect();
            track(skeleton, clip, &chain)
        });
        Ok(Self {
            frame_rate: clip.frame_rate() as f32,
            frames: clip.frames(),
            parents: level.parents.clone(),
            tracks: tracks.collect(),
        })
    }
}

pub(super) fn check(skeleton: &Skeleton, clip: &Clip) -> Result<(), LodError> {
    let found = clip.joints();
    if found == skeleton.len() {
        return Ok(());
    }
    Err(LodError::Joints {
        clip: clip.name().to_owned(),
        found,
        expected: skeleton.len(),
    })
}

/// The motion of the first joint of `chain` in the frame of the last one's parent. Each joint of the chain is the parent of the one
/// before it.
fn track(skeleton: &Skeleton, clip: &Clip, chain: &[JointId]) -> LevelTrack {
    let mut rotations: Vec<Quat> = Vec::with_capacity(clip.frames());
    let mut places = Vec::with_capacity(clip.frames());
    for frame in 0..clip.frames() {
        let moment = clip.at(frame as f32);
        let (mut rotation, mut place) = (Quat::IDENTITY, Vec3::ZERO);
        for &joint in chain {
            let (turn, offset) = moment.local(skeleton, joint);
            rotation = turn * rotation;
            place = offset + turn * place;
        }
        let rotation = rotation.normalize();
        let turned_away = rotations
            .last()
            .is_some_and(|last| last.dot(rotation) < 0.0);
        rotations.push(if turned_away { -rotation } else { rotation });
        places.push(place);
    }
    LevelTrack {
        rotations,
        translations: Translations::from_places(places),
    }
}

/// The difference between a level and the next coarser one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// The joint that the coarser level has lost, as an index into the finer level's [`super::Level::kept`].
    pub joint: u16,
    /// The joint that carries it on the coarser level, as an index into the finer level's `kept`.
    pub carrier: u16,
    /// The joint's transform in the carrier's frame.
    pub offset: JointTransform,
}

impl Levels {
    /// The blend from a level to the next coarser one, or `None` for the last level.
    pub fn blend(&self, level: LevelId) -> Option<Blend> {
        let finer = self.levels.get(level.index())?;
        let coarser = self.levels.get(level.index() + 1)?;
        Blend::to_carrier(finer, coarser, coarser.removed?)
    }
}

impl Blend {
    /// The blend of a joint of `posed` to where `coarser`, which has lost it, draws it.
    pub(crate) fn to_carrier(posed: &Level, coarser: &Level, joint: JointId) -> Option<Self> {
        let attachment = coarser.attachments.get(joint.index())?;
        let carrier = *coarser.kept.get(usize::from(attachment.carrier))?;
        Some(Self {
            joint: posed.index_of(joint)? as u16,
            carrier: posed.index_of(carrier)? as u16,
            offset: attachment.offset,
        })
    }

    /// Blends the joint's matrix linearly. `matrices` are those of the finer level, in model space; at weight 0 the joint keeps its own
    /// motion, at 1 it follows the carrier.
    pub fn apply(&self, weight: f32, matrices: &mut [Affine3A]) {
        let carrier = matrices[usize::from(self.carrier)];
        let riding = carrier * affine(&self.offset);
        let joint = &mut matrices[usize::from(self.joint)];
        joint.matrix3 = joint.matrix3 * (1.0 - weight) + riding.matrix3 * weight;
        joint.translation = joint.translation.lerp(riding.translation, weight);
    }
}

/// Converts a joint's transform to a matrix.
pub fn affine(transform: &JointTransform) -> Affine3A {
    Affine3A::from_rotation_translation(transform.rotation, transform.translation)
}
