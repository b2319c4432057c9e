//! Numbers that callers give, and what they may be.

use std::ops::RangeInclusive;

use glam::Vec3;

use super::error::CharacterError;

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
