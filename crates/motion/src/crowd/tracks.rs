//! The tracks of all levels: the motion of a joint relative to each of the parents that it has on some level. A joint that
//! has the same parent on several levels has one track for all of them.

use glam::Vec3;

use super::animation_set_desc::AnimationSetDesc;
use super::quantise::{Keys, ONE, TracksOfLevel, quantise};
use crate::anim::JointId;
use crate::lod::{LevelMotion, Translations};

/// Largest distance of a position from the middle of its range, per axis, for which positions are stored in 16 bits, in
/// metres. They are then accurate to 0.01 mm.
const NARROW: f32 = 0.65;

/// A joint and its parent on some level.
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
    /// The finest and the coarsest level that play each track.
    pub(super) levels: Vec<[usize; 2]>,
    /// The track of each joint of each level, `[level][joint]`.
    pub(super) of_levels: Vec<Vec<usize>>,
    /// Keys of each track in each clip or layer, `[clip][track]`.
    pub(super) keys: Vec<Vec<Keys>>,
    /// Storage of the positions of each track in clips.
    pub(super) places: Vec<Place>,
    /// Storage of the positions of each track in additive layers. It has as many columns as in clips.
    pub(super) layer_places: Vec<Place>,
}

/// How positions of a joint in its parent's frame are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    Fixed(Vec3),
    /// Three columns of 16-bit keys.
    Narrow(PlaceRange),
    /// Six columns: three with multiples of [`Place::COARSE`] units, and three with the remainders.
    Wide(PlaceRange),
}

/// Conversion of a position's keys to metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaceRange {
    /// Position of a key of 0, in metres.
    pub(super) middle: Vec3,
    /// Size of a unit of two interpolated keys, in metres. The sum of their weights is [`ONE`].
    pub(super) unit: Vec3,
}

impl Place {
    /// Number of units in a step of the coarse columns of [`Place::Wide`].
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

    /// The keys of a position, one array for each [quad](Place::quads); unused ones are 0.
    pub(super) fn keys(self, place: Vec3) -> [[i16; 3]; 2] {
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

    /// Number of tracks.
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    /// Adds a clip's keys of the tracks whose first level is `level`. Levels must be added in their order.
    pub(super) fn add(&mut self, level: usize, clip: usize, motion: &MotionKeys<'_>) {
        let of_level = TracksOfLevel {
            indices: &self.of_levels[level],
            keys_of_frames: motion.keys_of_frames,
        };
        quantise(motion.motion, &of_level, &mut self.keys[clip]);
    }

    /// Decides how positions are stored, after all clips have their keys.
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
    /// The range of all positions, for three columns.
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

    /// The same range for six columns.
    fn finer(self) -> Self {
        let unit = self.unit / Place::COARSE;
        Self { unit, ..self }
    }
}

/// A clip's motion on one level.
#[derive(Clone, Copy)]
pub(super) struct MotionKeys<'a> {
    pub(super) motion: &'a LevelMotion,
    /// Number of keys from each frame to the next.
    pub(super) keys_of_frames: &'a [u32],
}
