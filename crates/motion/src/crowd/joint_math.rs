//! The computation of a joint: as a matrix, or as a rotation and a position.

use bytemuck::Pod;

use super::level_joint::LevelJoint;
use super::quat_lanes::Local;
use super::sampling::Source;
use crate::math::{F32x16, Lanes};

/// How joints are computed from their parents, and which numbers are written.
pub(super) trait JointMath {
    /// A joint of sixteen characters: one [`F32x16`] for each of its numbers.
    type Model: Pod + AsRef<[F32x16]>;

    /// Numbers of a joint.
    const NUMBERS: usize = size_of::<Self::Model>() / size_of::<F32x16>();
    /// Numbers of a joint in a character's row: a divisor of the numbers of a whole number of `F32x16`s.
    const ROW: usize;
    /// Number of joints that a group's memory has beyond the last one, so that the last `F32x16` of a row can be read whole.
    const SPARE: usize = 2;

    /// A joint's motion under its parent, ready to be composed.
    type Ready<L: Lanes>: Copy;

    /// The next joint, as far as it can be computed without its parent.
    fn next<L: Lanes, S: Source<L>>(source: &mut S, joint: &LevelJoint) -> Self::Ready<L>;

    /// Prepares a motion whose rotation has length 1.
    fn ready<L: Lanes>(local: Local<L>) -> Self::Ready<L>;

    /// Computes a joint without a parent from its character's placement: cosine and sine of the heading, then the position.
    fn stand<L: Lanes>(at: [L; 5], ready: Self::Ready<L>, model: &mut Self::Model, part: usize);

    /// Computes a joint from its parent and its motion relative to it.
    fn compose<L: Lanes>(
        above: &Self::Model,
        ready: Self::Ready<L>,
        model: &mut Self::Model,
        part: usize,
    );

    /// Computes a joint from its carrier, which may have been [blended](JointMath::approach).
    fn compose_blended<L: Lanes>(
        above: &Self::Model,
        ready: Self::Ready<L>,
        model: &mut Self::Model,
        part: usize,
    );

    /// Blends a joint towards another one: weight 0 keeps it, weight 1 gives the other.
    fn approach<L: Lanes>(model: &mut Self::Model, other: &Self::Model, weight: L, part: usize);
}

// Loops and plain functions instead of closures that the standard library calls: those are not
// compiled for the instruction set at hand.

#[inline(always)]
pub(super) fn load<L: Lanes, const N: usize>(lines: &[F32x16], part: usize) -> [L; N] {
    let lines = &lines[..N];
    let mut values = [L::splat(0.0); N];
    for index in 0..N {
        values[index] = L::load(&lines[index], part);
    }
    values
}

#[inline(always)]
pub(super) fn store<L: Lanes, const N: usize>(values: [L; N], lines: &mut [F32x16], part: usize) {
    let lines = &mut lines[..N];
    for index in 0..N {
        values[index].store(&mut lines[index], part);
    }
}

#[inline(always)]
pub(super) fn cross<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [
        c.neg_mul_add(y, b * z),
        a.neg_mul_add(z, c * x),
        b.neg_mul_add(x, a * y),
    ]
}
