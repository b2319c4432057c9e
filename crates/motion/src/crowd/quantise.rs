//! Quantises rotations to four signed 16-bit numbers, parents first.
//!
//! The method is ours. A joint's key is computed relative to its parent as the parent's keys play it, not as the clip has it.
//! The error of a joint's rotation in model space is therefore that of one rounding, however long the chain is. A track that
//! several levels share is rounded on the finest of them. On the other levels its error is added to the difference of its
//! parent's errors on the two levels, which is the same for all joints below one parent.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::lod::{LevelMotion, LevelTrack, Translations};

/// The 16-bit number that stands for 1.
pub(super) const ONE: f32 = 32767.0;

/// Greatest angle between two neighbouring keys, in radians. Linear interpolation then differs from slerp by less than 3.3e-5 rad
/// (angle^3 / 249). Frames that are further apart get more keys between them.
pub(super) const WIDEST: f32 = 0.2;

/// The keys of one joint under one parent.
#[derive(Clone, Debug, Default)]
pub(super) struct Keys {
    /// Quaternions (x, y, z, w) times [`ONE`]. Neighbours have a positive dot product.
    pub(super) rotations: Vec<[i16; 4]>,
    /// Positions in the parent's frame, in metres: one for each key, or one for all keys.
    pub(super) places: Vec<Vec3>,
}

/// A joint's frame in model space.
#[derive(Clone, Copy)]
struct At {
    turn: DQuat,
    place: DVec3,
}

/// A joint's frame in the clip, and the frame that its keys give.
#[derive(Clone, Copy)]
struct WantedAndPlayed {
    wanted: At,
    played: At,
}

/// A moment between two frames of a clip.
#[derive(Clone, Copy)]
struct BetweenFrames {
    frame: usize,
    share: f64,
}

impl At {
    const ORIGIN: Self = Self {
        turn: DQuat::IDENTITY,
        place: DVec3::ZERO,
    };

    fn then(self, turn: DQuat, place: DVec3) -> Self {
        Self {
            turn: self.turn * turn,
            place: self.place + self.turn * place,
        }
    }
}

impl WantedAndPlayed {
    const ORIGIN: Self = Self {
        wanted: At::ORIGIN,
        played: At::ORIGIN,
    };
}

/// Adds the keys of the tracks that have none yet. `tracks` has the index in `keys` of each joint's track.
pub(super) fn quantise(motion: &LevelMotion, tracks: &TracksOfLevel<'_>, keys: &mut [Keys]) {
    let is_new = |&track: &usize| keys[track].rotations.is_empty();
    let is_new: Vec<bool> = tracks.indices.iter().map(is_new).collect();
    if !is_new.contains(&true) {
        return;
    }
    let mut poses = vec![WantedAndPlayed::ORIGIN; motion.tracks.len()];
    for (key, moment) in key_moments(tracks.keys_of_frames).enumerate() {
        for (index, track) in motion.tracks.iter().enumerate() {
            let above = motion.parents[index].map(|parent| poses[usize::from(parent)]);
            let above = above.unwrap_or(WantedAndPlayed::ORIGIN);
            let place = place_at(&track.translations, moment);
            let turn = rotation_at(&track.rotations, moment);
            let wanted = above.wanted.then(turn, place);
            let keys = &mut keys[tracks.indices[index]];
            if is_new[index] {
                keys.push(track, WantedAndPlayed { wanted, ..above });
            }
            poses[index] = WantedAndPlayed {
                wanted,
                played: keys.after(above.played, key),
            };
        }
    }
}

/// Tracks of a level's joints.
#[derive(Clone, Copy)]
pub(super) struct TracksOfLevel<'a> {
    /// Index of each joint's track, in the level's order.
    pub(super) indices: &'a [usize],
    /// Number of keys from each frame of the clip to the next.
    pub(super) keys_of_frames: &'a [u32],
}

impl Keys {
    /// The position of one key.
    pub(super) fn place(&self, key: usize) -> Vec3 {
        self.places[key.min(self.places.len() - 1)]
    }

    /// Appends a key. `at` has the joint's frame in the clip, and the frame that the keys give its parent.
    fn push(&mut self, track: &LevelTrack, at: WantedAndPlayed) {
        let to_parent = at.played.turn.inverse();
        let own = round(to_parent * at.wanted.turn, self.rotations.last());
        self.rotations.push(own);
        match track.translations {
            Translations::Fixed(place) => self.places = vec![place],
            Translations::Moving(_) => {
                // Compensates for the errors of the rotations above.
                let place = to_parent * (at.wanted.place - at.played.place);
                self.places.push(place.as_vec3());
            }
        }
    }

    /// Frame of the joint at a key, below its parent's frame `above`.
    fn after(&self, above: At, key: usize) -> At {
        let turn = DQuat::from_array(self.rotations[key].map(f64::from)).normalize();
        above.then(turn, self.place(key).as_dvec3())
    }
}

/// The nearest key to a rotation, with the sign that makes it closer to the key before.
fn round(turn: DQuat, before: Option<&[i16; 4]>) -> [i16; 4] {
    let turned_away = before.is_some_and(|before| {
        let before = DQuat::from_array(before.map(f64::from));
        before.dot(turn) < 0.0
    });
    let turn = if turned_away { -turn } else { turn };
    turn.normalize()
        .to_array()
        .map(|component| (component * f64::from(ONE)).round() as i16)
}

/// Raises the number of keys from each frame to the next until no two neighbours are further apart than [`WIDEST`].
pub(super) fn count_keys(motion: &LevelMotion, keys_of_frames: &mut [u32]) {
    for track in &motion.tracks {
        for (pair, keys) in track.rotations.windows(2).zip(&mut *keys_of_frames) {
            let needed = (pair[0].angle_between(pair[1]) / WIDEST).ceil() as u32;
            *keys = needed.max(*keys);
        }
    }
}

/// Moments of a clip's keys. The last key is the last frame.
fn key_moments(keys_of_frames: &[u32]) -> impl Iterator<Item = BetweenFrames> {
    let last = BetweenFrames {
        frame: keys_of_frames.len(),
        share: 0.0,
    };
    let between = keys_of_frames
        .iter()
        .enumerate()
        .flat_map(|(frame, &keys)| {
            (0..keys).map(move |key| BetweenFrames {
                frame,
                share: f64::from(key) / f64::from(keys),
            })
        });
    between.chain([last])
}

fn rotation_at(rotations: &[Quat], at: BetweenFrames) -> DQuat {
    let here = rotations[at.frame].as_dquat().normalize();
    match rotations.get(at.frame + 1) {
        Some(next) if at.share > 0.0 => here.slerp(next.as_dquat().normalize(), at.share),
        _ => here,
    }
}

fn place_at(translations: &Translations, at: BetweenFrames) -> DVec3 {
    let here = translations.at(at.frame).as_dvec3();
    match translations {
        Translations::Moving(places) if at.share > 0.0 => {
            here.lerp(places[at.frame + 1].as_dvec3(), at.share)
        }
        _ => here,
    }
}
