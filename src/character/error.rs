use std::ops::RangeInclusive;

use glam::Vec3;
use thiserror::Error;

use super::event::ThreatId;
use super::kind::KindId;
use crate::crowd::CrowdError;
use crate::query::QuerySettingsError;

/// Why a call to [`Characters`](super::Characters) is refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CharacterError {
    /// The character does not exist, or no longer.
    #[error("there is no character {index} of generation {generation}")]
    NoSuchCharacter {
        /// Index of its place.
        index: u32,
        /// Number of characters that had this place before it.
        generation: u32,
    },
    /// The threat does not exist, or no longer.
    #[error("there is no threat {}", .0.0)]
    NoSuchThreat(ThreatId),
    /// The kind does not exist.
    #[error("there is no kind of character {}", .0.0)]
    NoSuchKind(KindId),
    /// There are 65,536 kinds of character.
    #[error("there are too many kinds of character")]
    TooManyKinds,
    /// The graph has no moment without a labelled event.
    #[error("the graph has no moment without an event, in which a character could stand")]
    NothingToPlay,
    /// A character cannot strike itself, nor by attacks that the graph does not have.
    #[error("the graph has no such attack, or the character would strike itself")]
    CannotStrike,
    /// A number is not finite or out of range.
    #[error("{name} is {value}; it must be {}", range_in_words(*least, *most))]
    Value {
        /// Name of the number.
        name: &'static str,
        /// The number.
        value: f32,
        /// Smallest value that is taken.
        least: f32,
        /// Largest value that is taken.
        most: f32,
    },
    /// A setting of the queries is out of range.
    #[error(transparent)]
    Query(#[from] QuerySettingsError),
    /// A saved state that is damaged or belongs to another graph.
    #[error("the saved state {0}")]
    Saved(&'static str),
    /// A buffer or a pose has another number of joints than the skeleton.
    #[error("{found} joints are given; the skeleton has {needed}")]
    Joints {
        /// Number of joints of the skeleton.
        needed: usize,
        /// Length of the buffer.
        found: usize,
    },
    /// [`Characters::use_crowd`](super::Characters::use_crowd) was not called.
    #[error("there is no crowd that poses all characters: call use_crowd first")]
    NoCrowd,
    /// The last [`Characters::pose_all`](super::Characters::pose_all) did not pose the character.
    #[error("the character was not there when all were posed")]
    NotPosed,
    /// The crowd that poses all characters.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
}

fn range_in_words(least: f32, most: f32) -> String {
    match (least > f32::MIN, most < f32::MAX) {
        (false, _) => "finite".to_owned(),
        (true, false) => format!("at least {least}"),
        (true, true) => format!("{least} to {most}"),
    }
}

/// Largest distance of places, points and threats from the origin, in metres.
pub(super) const FURTHEST: f32 = 5_000.0;

/// The range of what only has to be finite.
pub(super) const ANY: RangeInclusive<f32> = f32::MIN..=f32::MAX;

/// Refuses a number that is not within a range, or not a number.
pub(super) fn within(
    name: &'static str,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), CharacterError> {
    match range.contains(&value) {
        true => Ok(()),
        false => Err(CharacterError::Value {
            name,
            value,
            least: *range.start(),
            most: *range.end(),
        }),
    }
}

/// Refuses a vector that is longer than `most`, or has a number that is not finite. `name` is that of its length.
pub(super) fn shorter(name: &'static str, vector: Vec3, most: f32) -> Result<(), CharacterError> {
    within(name, vector.length(), 0.0..=most)
}
