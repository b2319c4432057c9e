//! Interpolates the rotations of a whole skeleton between two poses, 16 joints at a time.
//!
//! Source: D. Eberly, "A Fast and Accurate Algorithm for Computing SLERP" (2011). sin(tθ) / sin(θ)
//! is a series in cos(θ) - 1 whose coefficients depend only on t, so no lane needs an angle.
//! Differs: t is the same for all joints. The result is normalised, which removes the error of the
//! truncated series.

use glam::Quat;

use crate::math::code_rows::{Vectors, unit};

/// Number of joints in a block.
pub(super) const LANES: usize = 16;

/// Rotations of several joints: rows of x, y, z and w.
pub(super) type Rows<const N: usize> = Vectors<N>;

/// Rotations of 16 joints.
pub(crate) type Block = Rows<LANES>;

/// The rotations of at most 16 joints. Unused lanes hold the identity.
#[inline(always)]
pub(super) fn block(rotations: &[Quat]) -> Block {
    let mut block = [[0.0; LANES], [0.0; LANES], [0.0; LANES], [1.0; LANES]];
    for (lane, rotation) in rotations.iter().enumerate() {
        for (row, value) in block.iter_mut().zip(rotation.to_array()) {
            row[lane] = value;
        }
    }
    block
}

/// Writes the first rotations of a block to `rotations`.
#[inline(always)]
pub(super) fn unpack([x, y, z, w]: &Block, rotations: &mut [Quat]) {
    for (lane, rotation) in rotations.iter_mut().take(LANES).enumerate() {
        *rotation = Quat::from_xyzw(x[lane], y[lane], z[lane], w[lane]);
    }
}

/// Normalised linear interpolation along the shorter arc, lane by lane.
#[inline(always)]
pub(super) fn nlerp(a: &Block, b: &Block, weight: f32) -> Block {
    let mut out = *a;
    for lane in 0..LANES {
        let weight = if dot(a, b, lane) < 0.0 {
            -weight
        } else {
            weight
        };
        // Weights of a, and of b with the sign that makes it closer to a.
        let rest = 1.0 - weight.abs();
        for row in 0..4 {
            out[row][lane] = a[row][lane] * rest + b[row][lane] * weight;
        }
    }
    unit(&out)
}

/// Slerp along the shorter arc, with one weight for all lanes.
pub(super) struct Slerp {
    series: [Series; 2],
}

impl Slerp {
    /// Weight 0 gives the first rotation, weight 1 the second. It is not inlined, so that the
    /// compiler computes the coefficients with vector divisions.
    #[inline(never)]
    pub(super) fn new(weight: f32) -> Self {
        Self {
            series: [Series::new(1.0 - weight), Series::new(weight)],
        }
    }

    /// Interpolates lane by lane. The error is at most a thousandth of a degree between rotations
    /// that differ by a quarter turn.
    #[inline(always)]
    pub(super) fn between<const N: usize>(&self, a: &Rows<N>, b: &Rows<N>) -> Rows<N> {
        let mut out = *a;
        for lane in 0..N {
            let cosine = dot(a, b, lane);
            let below = cosine.abs() - 1.0;
            let [of_a, of_b] = [self.series[0].at(below), self.series[1].at(below)];
            let of_b = if cosine < 0.0 { -of_b } else { of_b };
            for row in 0..4 {
                out[row][lane] = a[row][lane] * of_a + b[row][lane] * of_b;
            }
        }
        unit(&out)
    }
}

/// Series of sin(tθ) / sin(θ) for one t.
struct Series {
    t: f32,
    factors: [f32; LANES],
}

/// Number of terms. The remainder is below single precision for unit quaternions at a right angle,
/// whose rotations differ by half a turn.
const TERMS: usize = 12;

/// Factor of the last term that accounts for the omitted terms.
const REMAINDER: f32 = 1.895;

impl Series {
    #[inline(always)]
    fn new(t: f32) -> Self {
        let mut factors = [0.0; LANES];
        // Coefficients beyond the terms are unused. They are computed so that whole vectors are
        // divided.
        for (index, factor) in factors.iter_mut().enumerate() {
            let i = (index + 1) as f32;
            *factor = (t * t / i - i) / (2.0 * i + 1.0);
        }
        factors[TERMS - 1] *= REMAINDER;
        Self { t, factors }
    }

    /// `below` is cos(θ) - 1, from -1 to 0.
    #[inline(always)]
    fn at(&self, below: f32) -> f32 {
        let mut sum = 1.0;
        for factor in self.factors[..TERMS].iter().rev() {
            sum = 1.0 + factor * below * sum;
        }
        self.t * sum
    }
}

#[inline(always)]
fn dot<const N: usize>(a: &Rows<N>, b: &Rows<N>, lane: usize) -> f32 {
    let part = |row: usize| a[row][lane] * b[row][lane];
    (part(0) + part(1)) + (part(2) + part(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, Vec3};
    use proptest::prelude::*;

    fn turns() -> impl Strategy<Value = Vec<Quat>> {
        let turn = prop::array::uniform3(-2.0f32..2.0);
        prop::collection::vec(
            turn.prop_map(|v| Quat::from_scaled_axis(Vec3::from(v))),
            LANES,
        )
    }

    fn unpacked(block: &Block) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; LANES];
        unpack(block, &mut rotations);
        rotations
    }

    proptest! {
        #[test]
        fn slerp_is_that_of_double_precision(a in turns(), b in turns(), weight in 0.0f32..=1.0) {
            let found = unpacked(&Slerp::new(weight).between(&block(&a), &block(&b)));
            for ((a, b), found) in a.iter().zip(&b).zip(found) {
                let (a, b) = (a.as_dquat().normalize(), b.as_dquat().normalize());
                let b = if a.dot(b) < 0.0 { -b } else { b };
                let exact: DQuat = a.slerp(b, f64::from(weight));
                let apart = (exact - found.as_dquat()).length();
                prop_assert!(apart.min((exact + found.as_dquat()).length()) < 2e-6, "{apart}");
            }
        }

        #[test]
        fn the_ends_are_the_ends(a in turns(), b in turns()) {
            for (weight, end) in [(0.0, &a), (1.0, &b)] {
                for found in [Slerp::new(weight).between(&block(&a), &block(&b)), nlerp(&block(&a), &block(&b), weight)] {
                    for (found, end) in unpacked(&found).iter().zip(end) {
                        prop_assert!(1.0 - found.dot(*end).abs() < 1e-6);
                    }
                }
            }
        }

        #[test]
        fn nlerp_is_that_of_one_joint(a in turns(), b in turns(), weight in 0.0f32..=1.0) {
            let found = unpacked(&nlerp(&block(&a), &block(&b), weight));
            for ((a, b), found) in a.iter().zip(&b).zip(found) {
                let one = super::super::pose::nlerp(*a, *b, weight);
                prop_assert!(one.abs_diff_eq(found, 1e-6));
            }
        }
    }

    #[test]
    fn blocks_are_padded_with_what_does_not_turn() {
        let rotations: Vec<Quat> = (1..4)
            .map(|i| Quat::from_rotation_x(i as f32 * 0.1))
            .collect();
        let all = unpacked(&block(&rotations));
        assert_eq!(all[..3], rotations);
        assert!(all[3..].iter().all(|&turn| turn == Quat::IDENTITY));
    }
}
