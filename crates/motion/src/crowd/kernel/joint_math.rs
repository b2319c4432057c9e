//! How a joint is computed from its parent: as a matrix, or as a rotation and a position. The loop over the joints is that of
//! `chain`.

use bytemuck::Pod;

use super::quat_lanes::{Local, QuatLanes};
use super::sampling::Source;
use crate::crowd::keys::level_clips::LevelJoint;
use crate::math::{F32x16, Lanes};

/// How joints are computed from their parents, and which numbers are written.
pub(crate) trait JointMath {
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
pub(crate) fn load<L: Lanes, const N: usize>(lines: &[F32x16], part: usize) -> [L; N] {
    let lines = &lines[..N];
    let mut values = [L::splat(0.0); N];
    for index in 0..N {
        values[index] = L::load(&lines[index], part);
    }
    values
}

#[inline(always)]
pub(crate) fn store<L: Lanes, const N: usize>(values: [L; N], lines: &mut [F32x16], part: usize) {
    let lines = &mut lines[..N];
    for index in 0..N {
        values[index].store(&mut lines[index], part);
    }
}

#[inline(always)]
pub(crate) fn cross<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [
        c.neg_mul_add(y, b * z),
        a.neg_mul_add(z, c * x),
        b.neg_mul_add(x, a * y),
    ]
}

/// 3 × 4 matrices, row by row.
pub(crate) struct Matrices;

#[inline(always)]
fn dot<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> L {
    c.mul_add(z, b.mul_add(y, a * x))
}

#[inline(always)]
fn dot_and<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3], sum: L) -> L {
    c.mul_add(z, b.mul_add(y, a.mul_add(x, sum)))
}

/// The first two columns of a rotation matrix. The quaternion may have any length: it is scaled by 2 / |q|², which no root
/// has to be taken for.
#[inline(always)]
fn columns<L: Lanes>(turn: QuatLanes<L>) -> [[L; 3]; 2] {
    let QuatLanes { x, y, z, w } = turn;
    let one = L::splat(1.0);
    let scale = L::splat(2.0) / turn.dot(turn);
    let (sx, sy, sz) = (x * scale, y * scale, z * scale);
    let (xy, wz) = (x * sy, w * sz);
    let not_z = z.neg_mul_add(sz, one);
    [
        [y.neg_mul_add(sy, not_z), xy + wz, w.neg_mul_add(sy, x * sz)],
        [xy - wz, x.neg_mul_add(sx, not_z), w.mul_add(sx, y * sz)],
    ]
}

impl JointMath for Matrices {
    type Model = [F32x16; 12];

    const ROW: usize = 12;

    /// Two columns of the rotation, and the position. The third column is the cross product of the two.
    type Ready<L: Lanes> = [[L; 3]; 3];

    #[inline(always)]
    fn next<L: Lanes, S: Source<L>>(source: &mut S, joint: &LevelJoint) -> [[L; 3]; 3] {
        // A rotation of any length is accepted.
        Self::ready(source.next(joint))
    }

    #[inline(always)]
    fn ready<L: Lanes>(local: Local<L>) -> [[L; 3]; 3] {
        let [first, second] = columns(local.turn);
        [first, second, local.place]
    }

    #[inline(always)]
    fn stand<L: Lanes>(
        [cos, sin, x, y, z]: [L; 5],
        [first, second, place]: [[L; 3]; 3],
        model: &mut Self::Model,
        part: usize,
    ) {
        let third = cross(first, second);
        let minus_sin = L::splat(0.0) - sin;
        let along_x = |[a, _, c]: [L; 3]| sin.mul_add(c, cos * a);
        let along_z = |[a, _, c]: [L; 3]| cos.mul_add(c, minus_sin * a);
        let [px, py, pz] = place;
        let rows = [
            [
                along_x(first),
                along_x(second),
                along_x(third),
                sin.mul_add(pz, cos.mul_add(px, x)),
            ],
            [first[1], second[1], third[1], py + y],
            [
                along_z(first),
                along_z(second),
                along_z(third),
                cos.mul_add(pz, minus_sin.mul_add(px, z)),
            ],
        ];
        store(rows[0], &mut model[..4], part);
        store(rows[1], &mut model[4..8], part);
        store(rows[2], &mut model[8..12], part);
    }

    #[inline(always)]
    fn compose<L: Lanes>(
        above: &Self::Model,
        [first, second, place]: [[L; 3]; 3],
        model: &mut Self::Model,
        part: usize,
    ) {
        let zero = L::splat(0.0);
        let mut turned = [[zero; 3]; 2];
        for row in 0..3 {
            let (above, model) = (&above[4 * row..][..4], &mut model[4 * row..][..4]);
            let [a, b, c, at] = load(above, part);
            let row_above = [a, b, c];
            turned[0][row] = dot(row_above, first);
            turned[1][row] = dot(row_above, second);
            turned[0][row].store(&mut model[0], part);
            turned[1][row].store(&mut model[1], part);
            dot_and(row_above, place, at).store(&mut model[3], part);
        }
        // Six products. Computed from the parent's frame, it would take nine, and three more for the joint's own third
        // column.
        let third = cross(turned[0], turned[1]);
        for row in 0..3 {
            third[row].store(&mut model[4 * row + 2], part);
        }
    }

    #[inline(always)]
    fn compose_blended<L: Lanes>(
        above: &Self::Model,
        [first, second, place]: [[L; 3]; 3],
        model: &mut Self::Model,
        part: usize,
    ) {
        let third = cross(first, second);
        for row in 0..3 {
            let (above, model) = (&above[4 * row..][..4], &mut model[4 * row..][..4]);
            let [a, b, c, at] = load(above, part);
            let row = [a, b, c];
            let values = [
                dot(row, first),
                dot(row, second),
                dot(row, third),
                dot_and(row, place, at),
            ];
            store(values, model, part);
        }
    }

    /// Interpolates matrices linearly: every point moves along a straight line.
    #[inline(always)]
    fn approach<L: Lanes>(model: &mut Self::Model, other: &Self::Model, weight: L, part: usize) {
        let (own, other): ([L; 12], [L; 12]) = (load(model, part), load(other, part));
        let mut values = own;
        for index in 0..12 {
            values[index] = (other[index] - own[index]).mul_add(weight, own[index]);
        }
        store(values, model, part);
    }
}

/// Unit quaternions (x, y, z, w) and positions (x, y, z).
pub(crate) struct Rotations;

#[inline(always)]
fn turn_of<L: Lanes>([x, y, z, w, ..]: [L; 7]) -> QuatLanes<L> {
    QuatLanes { x, y, z, w }
}

impl JointMath for Rotations {
    type Model = [F32x16; 7];

    const ROW: usize = 8;

    /// A motion whose rotation has length 1.
    type Ready<L: Lanes> = Local<L>;

    #[inline(always)]
    fn next<L: Lanes, S: Source<L>>(source: &mut S, joint: &LevelJoint) -> Local<L> {
        source.next_unit(joint)
    }

    #[inline(always)]
    fn ready<L: Lanes>(local: Local<L>) -> Local<L> {
        local
    }

    #[inline(always)]
    fn stand<L: Lanes>(
        [cos, sin, x, y, z]: [L; 5],
        Local { turn: q, place }: Local<L>,
        model: &mut Self::Model,
        part: usize,
    ) {
        let (zero, one, half, two) = (L::splat(0.0), L::splat(1.0), L::splat(0.5), L::splat(2.0));
        // Cosine and sine of half the heading. The heading is from -π to π, so this cosine is not negative. The larger of
        // the two is computed by a square root, the other from the heading's sine: a square root would lose small headings.
        let (cos_size, sin_size) = (cos.max(zero - cos), sin.max(zero - sin));
        let larger = ((one + cos_size) * half).sqrt();
        let other = sin_size / (larger * two);
        // 1 where the cosine is the larger one, otherwise 0: sums with 0 are exact.
        let is_cos = one.copy_sign(cos).max(zero);
        let is_sin = one - is_cos;
        let c = larger * is_cos + other * is_sin;
        let s = (larger * is_sin + other * is_cos).copy_sign(sin);
        let turn = [
            s.mul_add(q.z, c * q.x),
            s.mul_add(q.w, c * q.y),
            s.neg_mul_add(q.x, c * q.z),
            s.neg_mul_add(q.y, c * q.w),
        ];
        let [px, py, pz] = place;
        // The product of `compose`, with u = (0, s, 0).
        let (cross_x, cross_z) = (s * pz * two, (zero - s * px) * two);
        let place = [
            s.mul_add(cross_z, c.mul_add(cross_x, px + x)),
            py + y,
            s.neg_mul_add(cross_x, c.mul_add(cross_z, pz + z)),
        ];
        store(turn, &mut model[..4], part);
        store(place, &mut model[4..], part);
    }

    #[inline(always)]
    fn compose<L: Lanes>(
        above: &Self::Model,
        Local { turn: q, place }: Local<L>,
        model: &mut Self::Model,
        part: usize,
    ) {
        let [x, y, z, w, at_x, at_y, at_z]: [L; 7] = load(above, part);
        let turn = [
            z.neg_mul_add(q.y, y.mul_add(q.z, x.mul_add(q.w, w * q.x))),
            x.neg_mul_add(q.z, z.mul_add(q.x, y.mul_add(q.w, w * q.y))),
            y.neg_mul_add(q.x, x.mul_add(q.y, z.mul_add(q.w, w * q.z))),
            z.neg_mul_add(q.z, y.neg_mul_add(q.y, x.neg_mul_add(q.x, w * q.w))),
        ];
        // v + 2w(u × v) + 2u × (u × v)
        let [px, py, pz] = place;
        let cross = cross([x + x, y + y, z + z], place);
        let place = [
            z.neg_mul_add(
                cross[1],
                y.mul_add(cross[2], w.mul_add(cross[0], px + at_x)),
            ),
            x.neg_mul_add(
                cross[2],
                z.mul_add(cross[0], w.mul_add(cross[1], py + at_y)),
            ),
            y.neg_mul_add(
                cross[0],
                x.mul_add(cross[1], w.mul_add(cross[2], pz + at_z)),
            ),
        ];
        store(turn, &mut model[..4], part);
        store(place, &mut model[4..], part);
    }

    #[inline(always)]
    fn compose_blended<L: Lanes>(
        above: &Self::Model,
        ready: Local<L>,
        model: &mut Self::Model,
        part: usize,
    ) {
        Self::compose(above, ready, model, part);
    }

    /// Interpolates rotations along the shorter arc, and positions linearly.
    #[inline(always)]
    fn approach<L: Lanes>(model: &mut Self::Model, other: &Self::Model, weight: L, part: usize) {
        let (own, other): ([L; 7], [L; 7]) = (load(model, part), load(other, part));
        let turn = turn_of(own).towards(turn_of(other), weight).normalized();
        let mut values = [turn.x, turn.y, turn.z, turn.w, own[4], own[5], own[6]];
        for index in 4..7 {
            values[index] = (other[index] - own[index]).mul_add(weight, own[index]);
        }
        store(values, model, part);
    }
}
