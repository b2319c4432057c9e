//! The smallest displacement that satisfies linear conditions and bounds.
//!
//! Source: Boyle & Dykstra, "A Method for Finding Projections onto the Intersection of Convex Sets" (1986): the point of the
//! intersection that is nearest to the origin. The correction of a half space is stored as one number (Hildreth 1957).

use glam::Vec3;

use crate::anim::{Bend, Rig};
use crate::math::Isa;

/// Number of parameters of a [`Bend`] (spine, pelvis, four ends and time), padded to whole vectors. The padding is 0.
pub(super) const N: usize = (TIME + 1).next_multiple_of(LANES);

/// Index of the parameter of time.
const TIME: usize = 3 * GROUPS;

/// Number of three-dimensional vectors among the parameters.
const GROUPS: usize = 2 + Rig::LIMBS;

/// Number of products that are summed together.
const LANES: usize = 8;

/// Parameters of a bend as shares of their bounds, or derivatives with respect to these shares.
pub(super) type Numbers = [f32; N];

/// Bounds of the parameters for one motion, which scale them. 0 for parts that must not move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Scales {
    /// Bound of the spine, in radians.
    pub spine: f32,
    /// Bound of the pelvis, in metres.
    pub pelvis: f32,
    /// Bounds of feet and hands, in metres, in the order of [`Rig::limbs`].
    pub ends: [f32; Rig::LIMBS],
    /// Bound of the offset in time, in seconds.
    pub ahead: f32,
}

/// A condition: the dot product of `slope` and the parameters is at least `least`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub slope: Numbers,
    pub least: f32,
}

impl Row {
    /// The condition that the same dot product is at most `least`.
    pub(super) fn reversed(&self) -> Self {
        Self {
            slope: self.slope.map(|number| -number),
            least: -self.least,
        }
    }
}

/// Derivatives of a quantity with respect to each part of a bend.
pub(super) type Gradient = Bend;

/// Derivatives with respect to shares of the bounds.
pub(super) fn scaled(gradient: &Gradient, scales: &Scales) -> Numbers {
    let mut numbers = [0.0; N];
    let mut vectors = [Vec3::ZERO; GROUPS];
    vectors[0] = gradient.spine * scales.spine;
    vectors[1] = gradient.pelvis * scales.pelvis;
    for (limb, &end) in gradient.ends.iter().enumerate() {
        vectors[2 + limb] = end * scales.ends[limb];
    }
    for (part, vector) in numbers.chunks_exact_mut(3).zip(vectors) {
        part.copy_from_slice(&vector.to_array());
    }
    numbers[TIME] = gradient.ahead * scales.ahead;
    numbers
}

pub(super) fn bend_from(numbers: &Numbers, scales: &Scales) -> Bend {
    let vector = |group: usize| Vec3::from_slice(&numbers[3 * group..]);
    Bend {
        spine: vector(0) * scales.spine,
        pelvis: vector(1) * scales.pelvis,
        ends: std::array::from_fn(|limb| vector(2 + limb) * scales.ends[limb]),
        ahead: numbers[TIME] * scales.ahead,
    }
}

#[inline(always)]
pub(super) fn dot(a: &Numbers, b: &Numbers) -> f32 {
    let [a, b] = [a, b].map(|numbers| numbers.as_chunks::<LANES>().0);
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}

/// The current correction of a row, and the inverse of its slope's squared length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    value: f32,
    /// Inverse of the squared length of the slope. 0 for a row without a slope, which is ignored.
    inverse: f32,
}

impl Factor {
    fn new(row: &Row) -> Self {
        let squared = dot(&row.slope, &row.slope);
        let inverse = if squared > 1e-12 { 1.0 / squared } else { 0.0 };
        Self {
            value: 0.0,
            inverse,
        }
    }
}

/// The parameters with the smallest sum of squares for which each vector has a length of at most 1 and all rows are satisfied. If no
/// parameters satisfy all rows, the result nearly satisfies them. `factors` is scratch.
pub(super) fn least_numbers(rows: &[Row], factors: &mut Vec<Factor>) -> Numbers {
    factors.clear();
    factors.extend(rows.iter().map(Factor::new));
    Isa::best().run(
        #[inline(always)]
        || project(rows, factors),
    )
}

/// The sweeps of [`least_numbers`].
#[inline(always)]
fn project(rows: &[Row], factors: &mut [Factor]) -> Numbers {
    const SWEEPS: usize = 60;
    const STILL: f32 = 1e-5;
    let mut numbers = [0.0; N];
    let mut beyond = [0.0; N];
    for _ in 0..SWEEPS {
        let before = numbers;
        for (row, factor) in rows.iter().zip(factors.iter_mut()) {
            let more = (row.least - dot(&row.slope, &numbers)) * factor.inverse;
            let next = (factor.value + more).max(0.0);
            let change = next - factor.value;
            if change != 0.0 {
                for (number, slope) in numbers.iter_mut().zip(&row.slope) {
                    *number += change * slope;
                }
                factor.value = next;
            }
        }
        for (part, beyond) in numbers.chunks_mut(3).zip(beyond.chunks_mut(3)) {
            bound(part, beyond);
        }
        let change = numbers.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if change.fold(0.0, f32::max) < STILL {
            break;
        }
    }
    numbers
}

/// Projects onto the unit ball.
#[inline(always)]
fn bound(part: &mut [f32], beyond: &mut [f32]) {
    for (number, beyond) in part.iter_mut().zip(beyond.iter()) {
        *number += beyond;
    }
    let length = part
        .iter()
        .map(|number| number * number)
        .sum::<f32>()
        .sqrt();
    let share = if length > 1.0 { 1.0 / length } else { 1.0 };
    for (number, beyond) in part.iter_mut().zip(beyond.iter_mut()) {
        *beyond = *number * (1.0 - share);
        *number *= share;
    }
}

/// Largest violation of a row; 0 or less if all are satisfied.
pub(super) fn worst(rows: &[Row], numbers: &Numbers) -> f32 {
    let missed = rows.iter().map(|row| row.least - dot(&row.slope, numbers));
    missed.fold(f32::NEG_INFINITY, f32::max)
}

/// A lower bound of the largest violation over all parameters within their bounds, computed for each row alone.
pub(super) fn least_violation(rows: &[Row]) -> f32 {
    let most = |row: &Row| -> f32 {
        let parts = row.slope.chunks(3);
        parts
            .map(|part| part.iter().map(|n| n * n).sum::<f32>().sqrt())
            .sum()
    };
    let missed = rows.iter().map(|row| row.least - most(row));
    missed.fold(f32::NEG_INFINITY, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn numbers() -> impl Strategy<Value = Numbers> {
        prop::array::uniform24(-1.0f32..1.0)
    }

    proptest! {
        #[test]
        fn the_smallest_that_keeps_all_is_found(known in numbers(), slopes in prop::collection::vec(numbers(), 1..6), slack in 0.0f32..0.2) {
            // `known` satisfies all rows. The result must satisfy them too, and must not be larger.
            let mut known = known;
            let mut none = [0.0; N];
            for (part, beyond) in known.chunks_mut(3).zip(none.chunks_mut(3)) {
                bound(part, beyond);
            }
            let rows: Vec<Row> = slopes.iter().map(|slope| Row { slope: *slope, least: dot(slope, &known) - slack }).collect();
            let found = least_numbers(&rows, &mut Vec::new());
            prop_assert!(worst(&rows, &found) < 0.02, "{}", worst(&rows, &found));
            prop_assert!(least_violation(&rows) <= worst(&rows, &known) + 1e-4);
            prop_assert!(dot(&found, &found) <= dot(&known, &known) + 0.05);
            for part in found.chunks(3) {
                prop_assert!(part.iter().map(|n| n * n).sum::<f32>() <= 1.0 + 1e-5);
            }
        }

        #[test]
        fn one_row_is_violated_by_at_least_the_bound(slope in numbers(), least in -30.0f32..30.0) {
            let row = Row { slope, least };
            let mut best = slope.map(|number| number * 1e3);
            let mut none = [0.0; N];
            for (part, beyond) in best.chunks_mut(3).zip(none.chunks_mut(3)) {
                bound(part, beyond);
            }
            prop_assert!((least_violation(&[row]) - worst(&[row], &best)).abs() < 1e-2);
        }

        #[test]
        fn of_one_row_it_is_the_foot_of_the_perpendicular(slope in numbers(), least in -0.3f32..0.3) {
            let squared = dot(&slope, &slope);
            prop_assume!(squared > 1.0);
            let found = least_numbers(&[Row { slope, least }], &mut Vec::new());
            for (found, slope) in found.iter().zip(&slope) {
                prop_assert!((found - slope * least.max(0.0) / squared).abs() < 1e-4);
            }
        }
    }
}
