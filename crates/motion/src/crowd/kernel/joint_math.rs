//! How a joint is computed from its parent: 3 × 4 matrices, row by row. The loop over the joints is that of `chain`.

use crate::anim::JointTransform;
use crate::crowd::keys::tracks::ONE;
use crate::math::{F32x16, Lanes};

/// Numbers of a joint: a matrix of 3 rows and 4 columns.
pub(crate) const NUMBERS: usize = 12;

/// Number of joints that a group's memory has beyond the last one, so that the last `F32x16` of a row can be read whole.
pub(crate) const SPARE: usize = 2;

/// A joint of sixteen characters: one [`F32x16`] for each of its numbers.
pub(crate) type Model = [F32x16; NUMBERS];

/// A joint's motion under its parent, ready to be composed: two columns of the rotation, and the position. The third column
/// is the cross product of the two.
pub(crate) type Ready<L> = [[L; 3]; 3];

/// A rotation for each lane, of any length.
#[derive(Clone, Copy)]
pub(crate) struct QuatLanes<L> {
    pub(crate) x: L,
    pub(crate) y: L,
    pub(crate) z: L,
    pub(crate) w: L,
}

impl<L: Lanes> QuatLanes<L> {
    #[inline(always)]
    fn dot(self, other: Self) -> L {
        // In two halves, which do not wait for each other.
        self.y.mul_add(other.y, self.x * other.x) + self.w.mul_add(other.w, self.z * other.z)
    }

    /// Linear interpolation along the shorter arc of two rotations interpolated between keys, which are scaled by [`ONE`]
    /// squared; the result has any length. `other` is scaled to the length of this one: with squares of lengths m and n next
    /// to 1, √(m / n) = 1 + (m - n) / 2 with an error below 4e-6.
    #[inline(always)]
    pub(crate) fn towards_between_keys(self, other: Self, weight: L) -> Self {
        const HALF: f32 = 0.5 / (ONE * ONE * ONE * ONE);
        let apart = self.dot(self) - other.dot(other);
        let ratio = apart.mul_add(L::splat(HALF), L::splat(1.0));
        let to_other = (weight * ratio).copy_sign(self.dot(other));
        let to_self = L::splat(1.0) - weight;
        Self {
            x: self.x.mul_add(to_self, other.x * to_other),
            y: self.y.mul_add(to_self, other.y * to_other),
            z: self.z.mul_add(to_self, other.z * to_other),
            w: self.w.mul_add(to_self, other.w * to_other),
        }
    }
}

/// A joint's motion under its parent, for each lane.
#[derive(Clone, Copy)]
pub(crate) struct Local<L> {
    pub(crate) turn: QuatLanes<L>,
    pub(crate) place: [L; 3],
}

impl<L: Lanes> Local<L> {
    /// The same rotation and position in all lanes.
    #[inline(always)]
    pub(crate) fn splat(transform: &JointTransform) -> Self {
        let (turn, place) = (transform.rotation, transform.translation);
        Self {
            turn: QuatLanes {
                x: L::splat(turn.x),
                y: L::splat(turn.y),
                z: L::splat(turn.z),
                w: L::splat(turn.w),
            },
            place: [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
        }
    }

    #[inline(always)]
    pub(crate) fn ready(self) -> Ready<L> {
        let [first, second] = columns(self.turn);
        [first, second, self.place]
    }
}

// Loops and plain functions instead of closures that the standard library calls: those are not
// compiled for the instruction set at hand.

#[inline(always)]
fn load<L: Lanes, const N: usize>(lines: &[F32x16], part: usize) -> [L; N] {
    let lines = &lines[..N];
    let mut values = [L::splat(0.0); N];
    for index in 0..N {
        values[index] = L::load(&lines[index], part);
    }
    values
}

#[inline(always)]
fn store<L: Lanes, const N: usize>(values: [L; N], lines: &mut [F32x16], part: usize) {
    let lines = &mut lines[..N];
    for index in 0..N {
        values[index].store(&mut lines[index], part);
    }
}

#[inline(always)]
fn cross<L: Lanes>([a, b, c]: [L; 3], [x, y, z]: [L; 3]) -> [L; 3] {
    [
        c.neg_mul_add(y, b * z),
        a.neg_mul_add(z, c * x),
        b.neg_mul_add(x, a * y),
    ]
}

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

/// Computes a joint without a parent from its character's placement: cosine and sine of the heading, then the position.
#[inline(always)]
pub(crate) fn stand<L: Lanes>(
    [cos, sin, x, y, z]: [L; 5],
    [first, second, place]: Ready<L>,
    model: &mut Model,
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

/// Computes a joint from its parent and its motion relative to it.
#[inline(always)]
pub(crate) fn compose<L: Lanes>(
    above: &Model,
    [first, second, place]: Ready<L>,
    model: &mut Model,
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

/// Computes a joint from its carrier, which may have been [blended](approach).
#[inline(always)]
pub(crate) fn compose_blended<L: Lanes>(
    above: &Model,
    [first, second, place]: Ready<L>,
    model: &mut Model,
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

/// Blends a joint towards another one: weight 0 keeps it, weight 1 gives the other. Matrices are interpolated linearly, so that
/// every point moves along a straight line.
#[inline(always)]
pub(crate) fn approach<L: Lanes>(model: &mut Model, other: &Model, weight: L, part: usize) {
    let (own, other): ([L; 12], [L; 12]) = (load(model, part), load(other, part));
    let mut values = own;
    for index in 0..12 {
        values[index] = (other[index] - own[index]).mul_add(weight, own[index]);
    }
    store(values, model, part);
}
