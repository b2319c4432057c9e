//! A clip as a level plays it.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.1: a removed joint's children hang from its parent. Differs:
//! they keep their motion in model space, so what the removed joint did is in their own motion now.

use glam::{Quat, Vec3};

use super::{Level, LodError};
use crate::anim::{Clip, JointId, Skeleton};

/// The motion of a [`Level`]'s joints, each under its parent in the level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelMotion {
    /// Frames per second.
    pub frame_rate: f32,
    /// How many frames, at least one.
    pub frames: usize,
    /// As in the level.
    pub parents: Vec<Option<u16>>,
    /// One for each kept joint, in the level's order.
    pub tracks: Vec<LevelTrack>,
}

/// How one joint moves under its parent in the level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelTrack {
    /// One for each frame; neighbours lie in the same half of the sphere, so that their straight
    /// line is the shorter arc.
    pub rotations: Vec<Quat>,
    /// Its place in its parent's frame; the root's in the space of the motion.
    pub translations: Translations,
}

/// Places of a joint in its parent's frame, metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Translations {
    /// The same in every frame.
    Fixed(Vec3),
    /// One for each frame: the root, joints that hang in place of a removed one, and joints that the
    /// clip itself moves.
    Moving(Vec<Vec3>),
}

impl Translations {
    /// Places that differ by less are one, metres.
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

    /// The place in one frame.
    #[must_use]
    pub fn at(&self, frame: usize) -> Vec3 {
        match self {
            Self::Fixed(place) => *place,
            Self::Moving(places) => places[frame],
        }
    }
}

/// The motion of `clip` on `level`: every kept joint is where it is in the clip, up to rounding.
///
/// # Errors
/// A clip or a level that is not of this skeleton.
pub fn rehang(skeleton: &Skeleton, clip: &Clip, level: &Level) -> Result<LevelMotion, LodError> {
    check(skeleton, clip)?;
    level.check(skeleton)?;
    let tracks = level.kept.iter().zip(&level.parents).map(|(&id, parent)| {
        let above = parent.map(|parent| level.kept[usize::from(parent)]);
        track(skeleton, clip, (id, above))
    });
    Ok(LevelMotion {
        frame_rate: clip.frame_rate() as f32,
        frames: clip.frames(),
        parents: level.parents.clone(),
        tracks: tracks.collect(),
    })
}

pub(super) fn check(skeleton: &Skeleton, clip: &Clip) -> Result<(), LodError> {
    let found = clip.desc().rotations.len() / clip.frames();
    if found == skeleton.len() {
        return Ok(());
    }
    Err(LodError::Joints {
        clip: clip.name().to_owned(),
        found,
        expected: skeleton.len(),
    })
}

/// The motion of `id` under `above`, which stands somewhere above it.
fn track(skeleton: &Skeleton, clip: &Clip, (id, above): (JointId, Option<JointId>)) -> LevelTrack {
    // From the joint up, without the one that it hangs from.
    let chain: Vec<JointId> = skeleton
        .ancestry(id)
        .take_while(|&joint| Some(joint) != above)
        .collect();
    let mut rotations: Vec<Quat> = Vec::with_capacity(clip.frames());
    let mut places = Vec::with_capacity(clip.frames());
    for frame in 0..clip.frames() {
        let moment = clip.at(frame as f32);
        let (mut rotation, mut place) = (Quat::IDENTITY, Vec3::ZERO);
        for &joint in &chain {
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
