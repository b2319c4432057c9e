//! What is computed of a joint: a matrix, or a rotation and a place.

use bytemuck::Pod;

use super::level_joint::LevelJoint;
use super::quat_lanes::Local;
use super::sampling::Source;
use crate::math::{F32x16, Lanes};

/// How joints follow from their parents, and what is written of them.
pub(super) trait JointMath {
    /// A joint of sixteen characters: a line of each of its numbers.
    type Model: Pod + AsRef<[F32x16]>;

    /// Numbers of a joint.
    const NUMBERS: usize = size_of::<Self::Model>() / size_of::<F32x16>();
    /// Numbers of a joint in a row of its character's own: a divisor of a whole number of lines.
    const ROW: usize;
    /// Joints that memory of a group has behind the last one, so that a row's last line can be read whole.
    const SPARE: usize = 2;

    /// A joint's motion under its parent, ready to be composed.
    type Ready<L: Lanes>: Copy;

    /// The next joint, as far as it can be computed without its parent.
    fn next<L: Lanes, S: Source<L>>(source: &mut S, joint: &LevelJoint) -> Self::Ready<L>;

    /// The same of a motion whose rotation has length 1.
    fn ready<L: Lanes>(local: Local<L>) -> Self::Ready<L>;

    /// A joint that has no parent, from where its character is placed: turned by a heading, whose cosine and sine come
    /// first, then moved.
    fn stand<L: Lanes>(at: [L; 5], ready: Self::Ready<L>, model: &mut Self::Model, part: usize);

    /// A joint from its parent and its motion under it.
    fn compose<L: Lanes>(
        above: &Self::Model,
        ready: Self::Ready<L>,
        model: &mut Self::Model,
        part: usize,
    );

    /// The same from what may have [gone a part of the way](JointMath::approach).
    fn ride<L: Lanes>(
        above: &Self::Model,
        ready: Self::Ready<L>,
        model: &mut Self::Model,
        part: usize,
    );

    /// Goes a part of the way to another one, 0 none of it and 1 all of it.
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
