//! Rotations as four signed 16-bit numbers, quantised from the root down.
//!
//! Each key is rounded against what its parent has become, not against what it was: the error of a
//! joint's rotation in model space stays that of one rounding, however long the chain.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::lod::{LevelMotion, LevelTrack, Translations};

/// What 1 becomes.
pub(super) const ONE: f32 = 32767.0;

/// Two keys are never further apart than this, radians: along the straight line between them the
/// rotation then lags behind slerp by less than 3.3e-5 rad (angle^3 / 249). Clips of slower frame
/// rates get keys between.
pub(super) const WIDEST: f32 = 0.2;

/// A joint's keys, as they are stored.
#[derive(Clone, Debug, Default)]
pub(super) struct Keys {
    /// Components times [`ONE`]; neighbours lie in the same half of the sphere.
    pub(super) rotations: Vec<[i16; 4]>,
    /// One for each key, or one for all.
    pub(super) places: Vec<Vec3>,
}

/// The keys of a motion, joint by joint.
pub(super) struct Quantised {
    pub(super) joints: Vec<Keys>,
    pub(super) keys: usize,
}

/// Where a joint is in model space.
#[derive(Clone, Copy)]
struct At {
    turn: DQuat,
    place: DVec3,
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

/// With so many keys for each frame.
pub(super) fn quantise(motion: &LevelMotion, per_frame: usize) -> Quantised {
    let keys = (motion.frames - 1) * per_frame + 1;
    let mut joints = vec![Keys::default(); motion.tracks.len()];
    // Each joint as it is, and as it is played.
    let mut poses = vec![(At::ORIGIN, At::ORIGIN); motion.tracks.len()];
    for key in 0..keys {
        let moment = (key / per_frame, (key % per_frame) as f64 / per_frame as f64);
        for (index, track) in motion.tracks.iter().enumerate() {
            let above = motion.parents[index].map(|parent| poses[usize::from(parent)]);
            let above = above.unwrap_or((At::ORIGIN, At::ORIGIN));
            poses[index] = joints[index].push(track, moment, above);
        }
    }
    Quantised { joints, keys }
}

impl Keys {
    fn push(
        &mut self,
        track: &LevelTrack,
        (frame, share): (usize, f64),
        (wanted_above, played_above): (At, At),
    ) -> (At, At) {
        let place = place_at(&track.translations, frame, share);
        let wanted = wanted_above.then(rotation_at(&track.rotations, frame, share), place);
        let own = round(
            played_above.turn.inverse() * wanted.turn,
            self.rotations.last(),
        );
        let place = match track.translations {
            Translations::Fixed(place) => {
                self.places = vec![place];
                place
            }
            Translations::Moving(_) => {
                // What came of the rotations above is taken back.
                let place = played_above.turn.inverse() * (wanted.place - played_above.place);
                self.places.push(place.as_vec3());
                place.as_vec3()
            }
        };
        self.rotations.push(own);
        let turn = DQuat::from_array(own.map(f64::from)).normalize();
        (wanted, played_above.then(turn, place.as_dvec3()))
    }
}

/// The nearest key, on the side where the one before lies.
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

/// As many as it takes for no two neighbours to be further apart than [`WIDEST`].
pub(super) fn keys_per_frame(motion: &LevelMotion) -> usize {
    let pairs = motion
        .tracks
        .iter()
        .flat_map(|track| track.rotations.windows(2));
    let widest = pairs
        .map(|pair| pair[0].angle_between(pair[1]))
        .fold(0.0, f32::max);
    (widest / WIDEST).ceil().max(1.0) as usize
}

fn rotation_at(rotations: &[Quat], frame: usize, share: f64) -> DQuat {
    let here = rotations[frame].as_dquat().normalize();
    match rotations.get(frame + 1) {
        Some(next) if share > 0.0 => here.slerp(next.as_dquat().normalize(), share),
        _ => here,
    }
}

fn place_at(translations: &Translations, frame: usize, share: f64) -> DVec3 {
    let here = translations.at(frame).as_dvec3();
    match translations {
        Translations::Moving(places) if share > 0.0 => {
            here.lerp(places[frame + 1].as_dvec3(), share)
        }
        _ => here,
    }
}
