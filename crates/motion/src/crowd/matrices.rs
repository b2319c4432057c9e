//! Joints as matrices.

use super::joint_math::{JointMath, cross, load, store};
use super::level_joint::LevelJoint;
use super::quat_lanes::{Local, QuatLanes};
use super::sampling::Source;
use crate::math::{F32x16, Lanes};

/// 3 × 4 matrices, row by row.
pub(super) struct Matrices;

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
