//! The motions of all clips on one level, as the kernels read them.
//!
//! A motion is a list of columns, and a column has one word for each interval between two keys. A
//! rotation has four columns; a word holds the same component of both keys, 16 bits each, so that
//! one load fetches what one multiply-add needs. A place that moves within a narrow range has three
//! of the same kind, and one that goes further six: of each coordinate the number at the start and
//! the way to the end.
//!
//! The same words stand twice: column by column, for characters who are near each other in time and
//! share their loads, and interval by interval, a row of whole lines each, for those who are not.

use glam::Vec3;

use super::animation_set::AnimationSetError;
use super::quantise::{Keys, ONE, Quantised};
use crate::lod::{LevelMotion, Translations};
use crate::math::F32x16;

/// Words that a column repeats from its beginning after its end: a window that starts at the last
/// interval goes on at the first.
const SPARE: usize = F32x16::LANES;

/// A place that stays within so much of a middle is kept in 16 bits, metres: to 0.01 mm.
const NARROW: f32 = 0.65;

/// All clips on one level.
#[derive(Clone, Debug)]
pub(super) struct LevelClips {
    /// Parents first.
    pub(super) joints: Vec<LevelJoint>,
    /// The columns of all clips.
    pub(super) words: Vec<u32>,
    /// The rows of all clips.
    pub(super) rows: Vec<F32x16>,
    /// How many columns a motion has.
    columns: usize,
    /// Lines of a row.
    pub(super) row_lines: usize,
}

/// What all clips agree on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LevelJoint {
    /// `None` for the root alone.
    pub(super) parent: Option<u16>,
    pub(super) place: Place,
}

/// A joint's place in its parent's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    Fixed(Vec3),
    /// The middle, and what one unit of a word's mixed halves is, metres.
    Narrow(Vec3, Vec3),
    Wide,
}

/// A clip's intervals, on every level the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClipRange {
    /// Intervals of all clips before it.
    pub(super) row: usize,
    /// The same in columns, where each clip has some to spare.
    word: usize,
    /// Pieces between keys; at least one.
    pub(super) intervals: usize,
    /// Intervals per second.
    pub(super) rate: f64,
}

impl ClipRange {
    /// The clip after `before`, with so many frames per second and keys per frame.
    pub(super) fn after(
        before: Option<&Self>,
        motion: &LevelMotion,
        (frame_rate, per_frame): (f64, usize),
    ) -> Self {
        let end = |range: &Self| {
            let (row, word) = (range.row + range.intervals, range.word + range.stride());
            (row, word)
        };
        let (row, word) = before.map_or((0, 0), end);
        Self {
            row,
            word,
            intervals: ((motion.frames - 1) * per_frame).max(1),
            rate: frame_rate * per_frame as f64,
        }
    }

    /// Intervals in so many seconds.
    pub(super) fn per_second(&self, seconds: f32) -> f64 {
        f64::from(seconds) * self.rate
    }

    /// A position in intervals as a time, in seconds.
    pub(super) fn seconds(&self, at: f32) -> f32 {
        (f64::from(at) / self.rate) as f32
    }

    /// A position in intervals, wrapped into the clip; 0 for what is not finite.
    pub(super) fn wrapped(&self, at: f64) -> f32 {
        let length = self.intervals as f64;
        let rest = at - (at / length).floor() * length;
        if rest > 0.0 {
            rest.min(length) as f32
        } else {
            0.0
        }
    }

    /// Words from column to column.
    pub(super) fn stride(&self) -> usize {
        self.intervals + SPARE
    }
}

impl LevelClips {
    /// # Errors
    /// Motions that do not belong to one level, or are too much.
    pub(super) fn new(
        motions: &[LevelMotion],
        keys: &[Quantised],
        ranges: &[ClipRange],
    ) -> Result<Self, AnimationSetError> {
        let joints = shared_joints(motions, keys)?;
        let columns = joints.iter().map(|joint| 4 + joint.place.columns()).sum();
        let mut bank = Self {
            joints,
            words: Vec::new(),
            rows: Vec::new(),
            columns,
            row_lines: usize::div_ceil(columns, F32x16::LANES),
        };
        for (keys, range) in keys.iter().zip(ranges) {
            bank.add(keys, range);
            if bank.rows.len() > u32::MAX as usize {
                return Err(AnimationSetError::TooLarge);
            }
        }
        Ok(bank)
    }

    /// Where the first column of a clip starts.
    pub(super) fn base(&self, range: &ClipRange) -> usize {
        range.word * self.columns
    }

    fn add(&mut self, keys: &Quantised, range: &ClipRange) {
        let rows = self.rows.len();
        let lines = range.intervals * self.row_lines;
        self.rows.resize(rows + lines, F32x16::ZERO);
        let mut index = 0;
        let (words, rows) = (&mut self.words, &mut self.rows[rows..]);
        let row_lines = self.row_lines;
        let mut column = |word: &dyn Fn(usize, usize) -> u32| {
            let of = |start: usize| word(start, (start + 1).min(keys.keys - 1));
            let starts = (0..range.stride()).map(|place| place % range.intervals);
            words.extend(starts.map(of));
            for (start, row) in rows.chunks_exact_mut(row_lines).enumerate() {
                row[index / F32x16::LANES].0[index % F32x16::LANES] = f32::from_bits(of(start));
            }
            index += 1;
        };
        for (joint, keys) in self.joints.iter().zip(&keys.joints) {
            for component in 0..4 {
                let half = |key: usize| keys.rotations[key][component];
                column(&|start, end| pair(half(start), half(end)));
            }
            for axis in 0..3 {
                let at = |key: usize| keys.place(key)[axis];
                match joint.place {
                    Place::Fixed(_) => {}
                    Place::Narrow(middle, unit) => {
                        // A coordinate that stands still has no unit.
                        let unit = (unit[axis] * ONE).max(f32::MIN_POSITIVE);
                        let half = |key: usize| ((at(key) - middle[axis]) / unit).round() as i16;
                        column(&|start, end| pair(half(start), half(end)));
                    }
                    Place::Wide => {
                        column(&|start, _| at(start).to_bits());
                        column(&|start, end| (at(end) - at(start)).to_bits());
                    }
                }
            }
        }
    }
}

impl Place {
    fn columns(self) -> usize {
        match self {
            Self::Fixed(_) => 0,
            Self::Narrow(..) => 3,
            Self::Wide => 6,
        }
    }
}

/// The key before in the lower half, the one after in the upper.
fn pair(start: i16, end: i16) -> u32 {
    u32::from(end as u16) << 16 | u32::from(start as u16)
}

impl Keys {
    fn place(&self, key: usize) -> Vec3 {
        self.places[key.min(self.places.len() - 1)]
    }
}

/// The joints of a level. A place is fixed where all clips have the same one.
fn shared_joints(
    motions: &[LevelMotion],
    keys: &[Quantised],
) -> Result<Vec<LevelJoint>, AnimationSetError> {
    let Some(first) = motions.first() else {
        return Err(AnimationSetError::NoClip);
    };
    if motions.iter().any(|motion| motion.parents != first.parents) {
        return Err(AnimationSetError::Differ);
    }
    let fixed = |index: usize| {
        let Translations::Fixed(place) = first.tracks[index].translations else {
            return None;
        };
        let same = |motion: &LevelMotion| match motion.tracks[index].translations {
            Translations::Fixed(other) => (other - place).abs().max_element() <= Translations::SAME,
            Translations::Moving(_) => false,
        };
        motions.iter().all(same).then_some(place)
    };
    let moving = |index: usize| {
        let places = keys.iter().flat_map(|clip| &clip.joints[index].places);
        let ends = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = places.fold(ends, |(low, high), place| {
            (low.min(*place), high.max(*place))
        });
        let (middle, reach) = ((low + high) * 0.5, (high - low) * 0.5);
        if reach.max_element() <= NARROW {
            Place::Narrow(middle, reach / (ONE * ONE))
        } else {
            Place::Wide
        }
    };
    let joints = first.parents.iter().enumerate();
    Ok(joints
        .map(|(index, &parent)| LevelJoint {
            parent,
            place: fixed(index).map_or_else(|| moving(index), Place::Fixed),
        })
        .collect())
}
