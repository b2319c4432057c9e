//! The tracks of all levels: how each joint moves under each of the parents that it has on some level. A joint that has
//! the same parent on several levels has one track for all of them.

use glam::Vec3;

use super::animation_set_desc::AnimationSetDesc;
use super::quantise::{Keys, ONE, TracksOfLevel, quantise};
use crate::anim::JointId;
use crate::lod::{LevelMotion, Translations};

/// Positions that stay within this distance of a middle, per axis, are kept in 16 bits, in metres: to 0.01 mm.
const NARROW: f32 = 0.65;

/// What a joint hangs from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TrackId {
    joint: JointId,
    parent: Option<JointId>,
}

/// The tracks of all levels and clips.
#[derive(Debug, Default)]
pub(super) struct Tracks {
    ids: Vec<TrackId>,
    /// Number of clips, which come before the additive layers.
    pub(super) clips: usize,
    /// The first and the last level that plays each track.
    pub(super) levels: Vec<[usize; 2]>,
    /// Of each level and joint, the track.
    pub(super) of_levels: Vec<Vec<usize>>,
    /// Of each clip or layer and track.
    pub(super) keys: Vec<Vec<Keys>>,
    /// Of each track.
    pub(super) places: Vec<Place>,
    /// Of each track in additive layers; as many columns.
    pub(super) layer_places: Vec<Place>,
}

/// A joint's position in its parent's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    Fixed(Vec3),
    /// Three columns.
    Narrow(PlaceRange),
    /// Six columns: three of whole multiples of [`Place::COARSE`] units, and three of the rest.
    Wide(PlaceRange),
}

/// What the keys of a position stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaceRange {
    /// The position of a key of 0, in metres.
    pub(super) middle: Vec3,
    /// What one unit of two mixed keys is, in metres: their weights' sum is [`ONE`].
    pub(super) unit: Vec3,
}

impl Place {
    /// Units of a step of the coarse columns of a wide range.
    pub(super) const COARSE: f32 = 32768.0;

    pub(super) fn columns(self) -> usize {
        3 * self.quads()
    }

    pub(super) fn quads(self) -> usize {
        match self {
            Self::Fixed(_) => 0,
            Self::Narrow(_) => 1,
            Self::Wide(_) => 2,
        }
    }

    /// The keys of a position, quad by quad; as many as there are [quads](Place::quads).
    pub(super) fn keys(self, place: Vec3) -> [[i16; 3]; 2] {
        let (range, is_wide) = match self {
            Self::Fixed(_) => return [[0; 3]; 2],
            Self::Narrow(range) => (range, false),
            Self::Wide(range) => (range, true),
        };
        let mut keys = [[0; 3]; 2];
        for axis in 0..3 {
            // A coordinate that stands still has no unit.
            let unit = (range.unit[axis] * ONE).max(f32::MIN_POSITIVE);
            let units = (f64::from(place[axis]) - f64::from(range.middle[axis])) / f64::from(unit);
            let units = units.round();
            if is_wide {
                let coarse = (units / f64::from(Self::COARSE)).round();
                keys[0][axis] = coarse as i16;
                // From -16384 to 16384.
                keys[1][axis] = (units - coarse * f64::from(Self::COARSE)) as i16;
            } else {
                keys[0][axis] = units as i16;
            }
        }
        keys
    }
}

impl Tracks {
    /// Finds the tracks of the levels; no clip has keys yet.
    pub(super) fn new(desc: &AnimationSetDesc<'_>) -> Self {
        let mut tracks = Self {
            clips: desc.clips.len(),
            ..Self::default()
        };
        let levels = desc.levels;
        for (number, level) in levels.iter().enumerate() {
            let joints = level.kept.iter().zip(&level.parents);
            let indices = joints.map(|(&joint, parent)| {
                let parent = parent.map(|parent| level.kept[usize::from(parent)]);
                tracks.track(TrackId { joint, parent }, number)
            });
            let indices = indices.collect();
            tracks.of_levels.push(indices);
        }
        let motions = desc.clips.len() + desc.layers.len();
        tracks.keys = vec![vec![Keys::default(); tracks.ids.len()]; motions];
        tracks
    }

    /// A track that a level plays.
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

    /// Number of tracks.
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Adds the keys of the tracks of which a level is the first. Levels are added in their order.
    pub(super) fn add(&mut self, level: usize, clip: usize, motion: &MotionKeys<'_>) {
        let of_level = TracksOfLevel {
            indices: &self.of_levels[level],
            keys_of_frames: motion.keys_of_frames,
        };
        quantise(motion.motion, &of_level, &mut self.keys[clip]);
    }

    /// Finds how positions are stored, once all clips have their keys.
    pub(super) fn store_places(&mut self) {
        let (clips, layers) = self.keys.split_at(self.clips);
        for track in 0..self.ids.len() {
            let places: Vec<Vec<Vec3>> = clips
                .iter()
                .map(|keys| keys[track].places.clone())
                .collect();
            let place = Place::fixed(&places).unwrap_or_else(|| Place::moving(&places));
            let added: Vec<Vec<Vec3>> = layers
                .iter()
                .map(|keys| keys[track].places.clone())
                .collect();
            let layer = match place {
                Place::Fixed(_) => Place::Fixed(Vec3::ZERO),
                Place::Narrow(_) => Place::Narrow(PlaceRange::of(&added)),
                Place::Wide(_) => Place::Wide(PlaceRange::of(&added).finer()),
            };
            self.places.push(place);
            self.layer_places.push(layer);
        }
    }
}

impl Place {
    /// A position is fixed where all clips have the same one.
    fn fixed(clips: &[Vec<Vec3>]) -> Option<Self> {
        let place = *clips.first()?.first()?;
        let is_same = |places: &Vec<Vec3>| match places[..] {
            [other] => (other - place).abs().max_element() <= Translations::SAME,
            _ => false,
        };
        clips.iter().all(is_same).then_some(Self::Fixed(place))
    }

    fn moving(clips: &[Vec<Vec3>]) -> Self {
        let range = PlaceRange::of(clips);
        let reach = range.unit.max_element() * ONE * ONE;
        if reach <= NARROW {
            Self::Narrow(range)
        } else {
            Self::Wide(range.finer())
        }
    }
}

impl PlaceRange {
    /// All positions, in three columns.
    fn of(clips: &[Vec<Vec3>]) -> Self {
        let ends = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let [low, high] = clips.iter().flatten().fold(ends, |[low, high], &place| {
            [low.min(place), high.max(place)]
        });
        if low.x > high.x {
            return Self {
                middle: Vec3::ZERO,
                unit: Vec3::ZERO,
            };
        }
        Self {
            middle: (low + high) * 0.5,
            unit: (high - low) * 0.5 / (ONE * ONE),
        }
    }

    /// The same in six columns.
    fn finer(self) -> Self {
        let unit = self.unit / Place::COARSE;
        Self { unit, ..self }
    }
}

/// A clip on one level.
#[derive(Clone, Copy)]
pub(super) struct MotionKeys<'a> {
    pub(super) motion: &'a LevelMotion,
    /// Keys from each frame to the next.
    pub(super) keys_of_frames: &'a [u32],
}
