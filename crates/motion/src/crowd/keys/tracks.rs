//! The tracks of all levels, and their keys: rotations as four signed 16-bit numbers, parents first.
//!
//! A track is the motion of a joint relative to one of the parents that it has on some level. A joint that has the same parent on
//! several levels has one track for all of them.
//!
//! The quantisation is ours. A joint's key is computed relative to its parent as the parent's keys play it, not as the clip has it.
//! The error of a joint's rotation in model space is therefore that of one rounding, however long the chain is. A track that
//! several levels share is rounded on the finest of them. On the other levels its error is added to the difference of its
//! parent's errors on the two levels, which is the same for all joints below one parent.
//!
//! ```text
//! for each level, the finest first, and each key:
//!     for each joint, parents first:
//!         wanted = the joint's frame in the clip
//!         if its track has no keys yet:  key = round(played parent's frame⁻¹ * wanted)
//!         played = played parent's frame * key
//! ```

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::anim::{JointId, Place as JointPlace};
use crate::lod::{Level, LevelMotion, LevelTrack, Translations};

/// The 16-bit number that stands for 1.
pub(crate) const ONE: f32 = 32767.0;

/// Greatest angle between two neighbouring keys, in radians. Linear interpolation then differs from slerp by less than 3.3e-5 rad
/// (angle^3 / 249). Frames that are further apart get more keys between them.
pub(crate) const WIDEST: f32 = 0.2;

/// The keys of one joint under one parent.
#[derive(Clone, Debug, Default)]
pub(crate) struct Keys {
    /// Quaternions (x, y, z, w) times [`ONE`]. Neighbours have a positive dot product.
    pub(crate) rotations: Vec<[i16; 4]>,
    /// Positions in the parent's frame, in metres: one for each key, or one for all keys.
    pub(crate) places: Vec<Vec3>,
}

/// A joint's frame in the clip, and the frame that its keys give.
#[derive(Clone, Copy)]
struct WantedAndPlayed {
    wanted: JointPlace,
    played: JointPlace,
}

/// A moment between two frames of a clip.
#[derive(Clone, Copy)]
struct BetweenFrames {
    frame: usize,
    share: f64,
}

/// The frame of a joint below its parent's.
fn below(above: JointPlace, turn: DQuat, place: DVec3) -> JointPlace {
    JointPlace {
        rotation: above.rotation * turn,
        translation: above.point(place),
    }
}

impl WantedAndPlayed {
    const ORIGIN: Self = Self {
        wanted: JointPlace::IDENTITY,
        played: JointPlace::IDENTITY,
    };
}

/// Adds the keys of the tracks that have none yet. `tracks` has the index in `keys` of each joint's track, `keys_of_frames`
/// the number of keys from each frame of the clip to the next.
fn quantise(motion: &LevelMotion, tracks: &[usize], keys_of_frames: &[u32], keys: &mut [Keys]) {
    let is_new = |&track: &usize| keys[track].rotations.is_empty();
    let is_new: Vec<bool> = tracks.iter().map(is_new).collect();
    if !is_new.contains(&true) {
        return;
    }
    let mut poses = vec![WantedAndPlayed::ORIGIN; motion.tracks.len()];
    for (key, moment) in key_moments(keys_of_frames).enumerate() {
        for (index, track) in motion.tracks.iter().enumerate() {
            let above = motion.parents[index].map(|parent| poses[usize::from(parent)]);
            let above = above.unwrap_or(WantedAndPlayed::ORIGIN);
            let place = place_at(&track.translations, moment);
            let turn = rotation_at(&track.rotations, moment);
            let wanted = below(above.wanted, turn, place);
            let keys = &mut keys[tracks[index]];
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

impl Keys {
    pub(crate) fn place(&self, key: usize) -> Vec3 {
        self.places[key.min(self.places.len() - 1)]
    }

    /// Appends a key. `at` has the joint's frame in the clip, and the frame that the keys give its parent.
    fn push(&mut self, track: &LevelTrack, at: WantedAndPlayed) {
        let to_parent = at.played.rotation.inverse();
        let own = round(to_parent * at.wanted.rotation, self.rotations.last());
        self.rotations.push(own);
        match track.translations {
            Translations::Fixed(place) => self.places = vec![place],
            Translations::Moving(_) => {
                // Compensates for the errors of the rotations above.
                let place = to_parent * (at.wanted.translation - at.played.translation);
                self.places.push(place.as_vec3());
            }
        }
    }

    /// Frame of the joint at a key, below its parent's frame `above`.
    fn after(&self, above: JointPlace, key: usize) -> JointPlace {
        let turn = DQuat::from_array(self.rotations[key].map(f64::from)).normalize();
        below(above, turn, self.place(key).as_dvec3())
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
pub(crate) fn count_keys(motion: &LevelMotion, keys_of_frames: &mut [u32]) {
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

/// Largest distance of a position from the middle of its range, per axis, for which positions are stored in 16 bits, in
/// metres. They are then accurate to 0.01 mm.
const NARROW: f32 = 0.65;

/// A joint and its parent on some level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TrackId {
    joint: JointId,
    parent: Option<JointId>,
}

#[derive(Debug, Default)]
pub(crate) struct Tracks {
    ids: Vec<TrackId>,
    /// The finest and the coarsest level that play each track.
    pub(crate) levels: Vec<[usize; 2]>,
    /// The track of each joint of each level, `[level][joint]`.
    pub(crate) of_levels: Vec<Vec<usize>>,
    /// Keys of each track in each clip, `[clip][track]`.
    pub(crate) keys: Vec<Vec<Keys>>,
    /// Storage of the positions of each track.
    pub(crate) places: Vec<Place>,
}

/// How positions of a joint in its parent's frame are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    Fixed(Vec3),
    /// Three columns of 16-bit keys.
    Narrow(PlaceRange),
    /// Six columns: three with multiples of [`Place::COARSE`] units, and three with the remainders.
    Wide(PlaceRange),
}

/// Conversion of a position's keys to metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlaceRange {
    /// Position of a key of 0, in metres.
    pub(crate) middle: Vec3,
    /// Size of a unit of two interpolated keys, in metres. The sum of their weights is [`ONE`].
    pub(crate) unit: Vec3,
}

impl Place {
    /// Number of units in a step of the coarse columns of [`Place::Wide`].
    pub(crate) const COARSE: f32 = 32768.0;

    pub(crate) fn columns(self) -> usize {
        3 * self.quads()
    }

    pub(crate) fn quads(self) -> usize {
        match self {
            Self::Fixed(_) => 0,
            Self::Narrow(_) => 1,
            Self::Wide(_) => 2,
        }
    }

    /// The keys of a position, one array for each [quad](Place::quads); unused ones are 0.
    pub(crate) fn keys(self, place: Vec3) -> [[i16; 3]; 2] {
        let (range, is_wide) = match self {
            Self::Fixed(_) => return [[0; 3]; 2],
            Self::Narrow(range) => (range, false),
            Self::Wide(range) => (range, true),
        };
        let mut keys = [[0; 3]; 2];
        for axis in 0..3 {
            // A coordinate that does not move has a unit of 0.
            let unit = (range.unit[axis] * ONE).max(f32::MIN_POSITIVE);
            let units = (f64::from(place[axis]) - f64::from(range.middle[axis])) / f64::from(unit);
            let units = units.round();
            if is_wide {
                let coarse = (units / f64::from(Self::COARSE)).round();
                keys[0][axis] = coarse as i16;
                // The value is from -16384 to 16384.
                keys[1][axis] = (units - coarse * f64::from(Self::COARSE)) as i16;
            } else {
                keys[0][axis] = units as i16;
            }
        }
        keys
    }
}

impl Tracks {
    /// Finds the tracks of the levels. Keys are added later.
    pub(crate) fn new(levels: &[Level], clips: usize) -> Self {
        let mut tracks = Self::default();
        for (number, level) in levels.iter().enumerate() {
            let joints = level.kept.iter().zip(&level.parents);
            let indices = joints.map(|(&joint, parent)| {
                let parent = parent.map(|parent| level.kept[usize::from(parent)]);
                tracks.track(TrackId { joint, parent }, number)
            });
            let indices = indices.collect();
            tracks.of_levels.push(indices);
        }
        tracks.keys = vec![vec![Keys::default(); tracks.ids.len()]; clips];
        tracks
    }

    /// Index of a track that `level` plays. Creates the track if it is new.
    fn track(&mut self, id: TrackId, level: usize) -> usize {
        match self.ids.iter().position(|&known| known == id) {
            Some(track) => {
                self.levels[track][1] = level;
                track
            }
            None => {
                self.ids.push(id);
                self.levels.push([level; 2]);
                self.ids.len() - 1
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Adds a clip's keys of the tracks whose first level is `level`. Levels must be added in their order.
    /// `keys_of_frames` has the number of keys from each frame to the next.
    pub(crate) fn add(
        &mut self,
        level: usize,
        clip: usize,
        motion: &LevelMotion,
        keys_of_frames: &[u32],
    ) {
        let tracks = &self.of_levels[level];
        quantise(motion, tracks, keys_of_frames, &mut self.keys[clip]);
    }

    /// Decides how positions are stored, after all clips have their keys.
    pub(crate) fn store_places(&mut self) {
        for track in 0..self.ids.len() {
            let places = self.keys.iter().map(|keys| keys[track].places.clone());
            let places: Vec<Vec<Vec3>> = places.collect();
            let place = Place::fixed(&places).unwrap_or_else(|| Place::moving(&places));
            self.places.push(place);
        }
    }
}

impl Place {
    /// Storage of a position that is the same in all clips, or `None` if it is not.
    fn fixed(clips: &[Vec<Vec3>]) -> Option<Self> {
        let place = *clips.first()?.first()?;
        let is_same = |places: &Vec<Vec3>| match places[..] {
            [other] => (other - place).abs().max_element() <= Translations::SAME,
            _ => false,
        };
        clips.iter().all(is_same).then_some(Self::Fixed(place))
    }

    fn moving(clips: &[Vec<Vec3>]) -> Self {
        let range = PlaceRange::around(clips);
        let reach = range.unit.max_element() * ONE * ONE;
        if reach <= NARROW {
            Self::Narrow(range)
        } else {
            Self::Wide(range.finer())
        }
    }
}

impl PlaceRange {
    /// The range of all positions, for three columns.
    fn around(clips: &[Vec<Vec3>]) -> Self {
        let ends = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let [low, high] = clips.iter().flatten().fold(ends, |[low, high], &place| {
            [low.min(place), high.max(place)]
        });
        Self {
            middle: (low + high) * 0.5,
            unit: (high - low) * 0.5 / (ONE * ONE),
        }
    }

    /// The same range for six columns.
    fn finer(self) -> Self {
        let unit = self.unit / Place::COARSE;
        Self { unit, ..self }
    }
}
