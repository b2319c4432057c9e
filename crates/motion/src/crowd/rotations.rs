//! Joints as rotations and positions.

use super::joint_math::{JointMath, cross, load, store};
use super::level_joint::LevelJoint;
use super::quat_lanes::{Local, QuatLanes};
use super::sampling::Source;
use crate::math::{F32x16, Lanes};

/// Unit quaternions (x, y, z, w) and positions (x, y, z).
pub(super) struct Rotations;

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
