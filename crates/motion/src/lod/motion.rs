//! The motion of a clip on a level.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1: the children of a removed joint become children of its parent. Differs: they keep their
//! motion in model space, so their local motion includes that of the removed joint.

use glam::{Quat, Vec3};

use super::{Level, LodError};
use crate::anim::{Clip, JointId, Skeleton};

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

    fn of(places: Vec<Vec3>) -> Self {
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
    #[must_use]
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
        translations: Translations::of(places),
    }
}
