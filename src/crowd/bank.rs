//! The motions of all clips on one level, as the kernels read them.
//!
//! A motion is a list of columns, and a column has one word for each interval between two keys. A
//! rotation has four columns; a word holds the same component of both keys, 16 bits each, so that
//! one load fetches what one multiply-add needs. A place that moves has six: of each coordinate the
//! number at the start and the way to the end. Columns stand in the order in which they are read.

use glam::Vec3;

use super::quantise::{self, Keys, Quantised};
use super::repertoire::RepertoireError;
use crate::lod::{LevelMotion, Translations};
use crate::math::Line;

/// Words that a column repeats from its beginning after its end: a window that starts at the last
/// interval goes on at the first.
const SPARE: usize = Line::LANES;

/// All clips on one level.
#[derive(Clone, Debug)]
pub(super) struct Bank {
    /// Parents first.
    pub(super) joints: Vec<BankJoint>,
    /// The columns of all clips.
    pub(super) words: Vec<u32>,
    /// One for each clip.
    pub(super) spans: Vec<Span>,
}

/// What all clips agree on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BankJoint {
    /// `None` for the root alone.
    pub(super) parent: Option<u16>,
    /// Its place in its parent's frame; `None` where a clip moves it.
    pub(super) place: Option<Vec3>,
}

/// Where a clip's columns are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    /// Of the first column's first word.
    pub(super) base: usize,
    /// From column to column.
    pub(super) stride: usize,
    /// Pieces between keys; at least one.
    pub(super) intervals: usize,
    /// Intervals per second.
    pub(super) rate: f32,
}

impl Bank {
    /// # Errors
    /// Motions that do not belong to one level, or are too much.
    pub(super) fn new(motions: &[LevelMotion]) -> Result<Self, RepertoireError> {
        let joints = shared_joints(motions)?;
        let mut bank = Self {
            joints,
            words: Vec::new(),
            spans: Vec::with_capacity(motions.len()),
        };
        for motion in motions {
            bank.add(motion);
            if bank.words.len() > i32::MAX as usize {
                return Err(RepertoireError::TooLarge);
            }
        }
        Ok(bank)
    }

    fn add(&mut self, motion: &LevelMotion) {
        let Quantised {
            joints: keys,
            keys: count,
            per_frame,
        } = quantise::quantise(motion);
        let intervals = (count - 1).max(1);
        self.spans.push(Span {
            base: self.words.len(),
            stride: intervals + SPARE,
            intervals,
            rate: motion.frame_rate * per_frame as f32,
        });
        for (joint, keys) in self.joints.iter().zip(&keys) {
            let mut column = |word: &dyn Fn(usize, usize) -> u32| {
                let starts = (0..intervals + SPARE).map(|place| place % intervals);
                let pairs = starts.map(|start| word(start, (start + 1).min(count - 1)));
                self.words.extend(pairs);
            };
            for component in 0..4 {
                column(&|start, end| keys.pair(component, start, end));
            }
            if joint.place.is_none() {
                for axis in 0..3 {
                    column(&|start, _| keys.place(start)[axis].to_bits());
                    column(&|start, end| (keys.place(end) - keys.place(start))[axis].to_bits());
                }
            }
        }
    }
}

impl Keys {
    fn pair(&self, component: usize, start: usize, end: usize) -> u32 {
        let half = |key: usize| u32::from(self.rotations[key][component] as u16);
        half(end) << 16 | half(start)
    }

    fn place(&self, key: usize) -> Vec3 {
        self.places[key.min(self.places.len() - 1)]
    }
}

/// The joints of a level. A place is fixed where all clips have the same one.
fn shared_joints(motions: &[LevelMotion]) -> Result<Vec<BankJoint>, RepertoireError> {
    let Some(first) = motions.first() else {
        return Err(RepertoireError::NoClip);
    };
    if motions.iter().any(|motion| motion.parents != first.parents) {
        return Err(RepertoireError::Differ);
    }
    let place = |index: usize| {
        let Translations::Fixed(place) = first.tracks[index].translations else {
            return None;
        };
        let same = |motion: &LevelMotion| match motion.tracks[index].translations {
            Translations::Fixed(other) => (other - place).abs().max_element() <= Translations::SAME,
            Translations::Moving(_) => false,
        };
        motions.iter().all(same).then_some(place)
    };
    let joints = first.parents.iter().enumerate();
    Ok(joints
        .map(|(index, &parent)| BankJoint {
            parent,
            place: place(index),
        })
        .collect())
}
