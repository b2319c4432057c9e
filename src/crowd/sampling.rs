//! A clip read at the moments of a register's characters.

use glam::{Quat, Vec3};

use super::level_clips::{ClipRange, LevelClips, LevelJoint, Place};
use super::quantise::ONE;
use crate::math::{F32x16, Lanes};

/// A rotation for each lane, of any length.
#[derive(Clone, Copy)]
pub(super) struct QuatLanes<L> {
    pub(super) x: L,
    pub(super) y: L,
    pub(super) z: L,
    pub(super) w: L,
}

impl<L: Lanes> QuatLanes<L> {
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> L {
        // In two halves, which do not wait for each other.
        self.y.mul_add(other.y, self.x * other.x) + self.w.mul_add(other.w, self.z * other.z)
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: L) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
            w: self.w * factor,
        }
    }

    /// A part of the straight line to another one, both of length 1, along the shorter arc; of any length.
    #[inline(always)]
    pub(super) fn towards(self, other: Self, weight: L) -> Self {
        let to_other = weight.copy_sign(self.dot(other));
        let to_self = L::splat(1.0) - weight;
        Self {
            x: self.x.mul_add(to_self, other.x * to_other),
            y: self.y.mul_add(to_self, other.y * to_other),
            z: self.z.mul_add(to_self, other.z * to_other),
            w: self.w.mul_add(to_self, other.w * to_other),
        }
    }

    #[inline(always)]
    pub(super) fn normalized(self) -> Self {
        self.scaled(L::splat(1.0) / self.dot(self).sqrt())
    }

    /// The same of what stands between two keys, times [`ONE`] squared. With m the square of its length,
    /// 1 / √m = 15/8 - 5/4 m + 3/8 m² + 5/16 (1 - m)³ + …, of which the last is below 1e-8: keys are no further apart than
    /// [`WIDEST`](super::quantise::WIDEST). Written as a square and a rest, it takes two products.
    #[inline(always)]
    pub(super) fn between_keys_normalized(self) -> Self {
        const UNIT: f64 = ONE as f64;
        const ROOT: f64 = 0.612_372_435_695_794_5;
        const SLOPE: f64 = ROOT / (UNIT * UNIT * UNIT * UNIT * UNIT);
        const START: f64 = -ROOT * 5.0 / (3.0 * UNIT);
        const REST: f64 = 5.0 / (6.0 * UNIT * UNIT);
        let m = self.dot(self);
        let root = m.mul_add(L::splat(SLOPE as f32), L::splat(START as f32));
        self.scaled(root.mul_add(root, L::splat(REST as f32)))
    }
}

/// A joint's motion under its parent, for each lane.
#[derive(Clone, Copy)]
pub(super) struct Local<L> {
    pub(super) turn: QuatLanes<L>,
    pub(super) place: [L; 3],
}

impl<L: Lanes> Local<L> {
    /// The same for all.
    #[inline(always)]
    pub(super) fn splat(turn: Quat, place: Vec3) -> Self {
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
}

/// What gives the motion of one joint after the other, in the bank's order.
pub(super) trait Source<L: Lanes> {
    /// Its rotation has any length.
    fn next(&mut self, joint: &LevelJoint) -> Local<L>;

    /// The same, its rotation of length 1.
    fn next_unit(&mut self, joint: &LevelJoint) -> Local<L>;
}

/// The interval between keys that each lane is in, as a float, and how far in it, from 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct Moment<L> {
    pub(super) interval: L,
    pub(super) share: L,
}

/// How many intervals a clip has, for each lane.
#[derive(Clone, Copy)]
pub(super) struct Cycle<L> {
    length: L,
    /// One divided by it.
    inverse: L,
}

impl<L: Lanes> Cycle<L> {
    #[inline(always)]
    pub(super) fn new(length: L) -> Self {
        Self {
            length,
            inverse: L::splat(1.0) / length,
        }
    }

    /// Of one clip for all lanes.
    #[inline(always)]
    pub(super) fn of(range: &ClipRange) -> Self {
        let length = range.intervals as f32;
        Self {
            length: L::splat(length),
            inverse: L::splat(1.0 / length),
        }
    }

    /// Into `0..length`; what is no number becomes 0. Rounding may give `length` itself, or 0 for what is a little less.
    #[inline(always)]
    fn wrapped(self, value: L) -> L {
        let rest = value - (value * self.inverse).floor() * self.length;
        rest.max(L::splat(0.0)).min(self.length)
    }

    /// The same of a whole number of intervals, and without a rounding.
    #[inline(always)]
    fn wrapped_whole(self, value: L) -> L {
        // From half an interval away rounding reaches no other multiple of the length.
        let turns = ((value + L::splat(0.5)) * self.inverse).floor();
        value - turns * self.length
    }

    /// The moment at a time that is counted in intervals.
    ///
    /// No step is fused, so that all machines take the same interval.
    #[inline(always)]
    pub(super) fn moment(self, time: L) -> Moment<L> {
        let time = self.wrapped(time);
        let interval = time.floor().min(self.length - L::splat(1.0));
        Moment {
            interval,
            share: time - interval,
        }
    }
}

/// Words of one column after the other.
pub(super) trait Columns<L: Lanes> {
    /// Of the next so many.
    fn next<const N: usize>(&mut self) -> [L::Words; N];
}

/// Where lanes are that are near each other in time.
#[derive(Clone, Copy)]
pub(super) struct Near<L: Lanes> {
    /// The interval of the one that is furthest behind.
    start: usize,
    /// How much further each is.
    places: L::Words,
}

impl<L: Lanes> Near<L> {
    /// `None` where the lanes are not within [`Lanes::REACH`] intervals of each other.
    #[inline(always)]
    pub(super) fn new(range: &ClipRange, cycle: Cycle<L>, interval: L) -> Option<Self> {
        // From the lane that is furthest behind; the first lane is only near it.
        let first = interval.first();
        let half = (range.intervals / 2) as f32;
        let ahead = cycle.wrapped_whole(interval + L::splat(half - first));
        let least = ahead.least();
        let places = ahead - L::splat(least);
        if !places.all_below(L::REACH as f32) {
            return None;
        }
        let start = (first + least - half) as i32 as isize;
        let start = if start < 0 {
            start.wrapping_add_unsigned(range.intervals)
        } else {
            start
        };
        Some(Self {
            start: (start as usize).min(range.intervals - 1),
            places: places.truncated(),
        })
    }
}

/// Columns of lanes that are near each other in time: one load fetches what all of them need.
pub(super) struct Window<'a, L: Lanes> {
    words: &'a [u32],
    start: usize,
    stride: usize,
    places: L::Words,
}

impl<'a, L: Lanes> Window<'a, L> {
    #[inline(always)]
    pub(super) fn new(bank: &'a LevelClips, range: &ClipRange, near: Near<L>) -> Self {
        Self {
            words: &bank.words,
            start: bank.base(range) + near.start,
            stride: range.stride(),
            places: near.places,
        }
    }
}

impl<L: Lanes> Columns<L> for Window<'_, L> {
    #[inline(always)]
    fn next<const N: usize>(&mut self) -> [L::Words; N] {
        let start = self.start;
        self.start += N * self.stride;
        L::windows(self.words, (start, self.stride), self.places)
    }
}

/// Columns that were made of sixteen rows.
pub(super) struct Turned<'a> {
    pub(super) lines: std::slice::Iter<'a, F32x16>,
    pub(super) part: usize,
}

impl<L: Lanes> Columns<L> for Turned<'_> {
    #[inline(always)]
    fn next<const N: usize>(&mut self) -> [L::Words; N] {
        let mut words = [L::splat_words(0); N];
        for (words, line) in words.iter_mut().zip(&mut self.lines) {
            *words = L::load_words(line, self.part);
        }
        words
    }
}

/// The rows of sixteen characters who may be anywhere in any clip become columns.
#[inline(always)]
pub(super) fn gather_rows<L: Lanes>(
    bank: &LevelClips,
    rows: &[u32; F32x16::LANES],
    columns: &mut [F32x16],
) {
    let length = bank.row_lines;
    let mut sixteen: [&[F32x16]; F32x16::LANES] = [&[]; F32x16::LANES];
    for lane in 0..F32x16::LANES {
        sixteen[lane] = &bank.rows[rows[lane] as usize * length..][..length];
    }
    for (index, columns) in columns
        .chunks_exact_mut(F32x16::LANES)
        .take(length)
        .enumerate()
    {
        let mut lines = [&F32x16::ZERO; F32x16::LANES];
        for lane in 0..F32x16::LANES {
            lines[lane] = &sixteen[lane][index];
        }
        columns.copy_from_slice(&L::transpose(lines));
    }
}

/// How much of the key before and of the key after.
#[derive(Clone, Copy)]
pub(super) struct Weights<L: Lanes> {
    /// As 16-bit numbers whose sum is [`ONE`].
    pair: L::Words,
    /// Of the key after.
    share: L,
}

impl<L: Lanes> Weights<L> {
    #[inline(always)]
    pub(super) fn new(share: L) -> Self {
        let after = (share * L::splat(ONE) + L::splat(0.5)).floor();
        let before = L::splat(ONE) - after;
        Self {
            pair: L::pair(before.truncated(), after.truncated()),
            share,
        }
    }
}

/// One clip.
pub(super) struct Playing<L: Lanes, C> {
    columns: C,
    weights: Weights<L>,
}

impl<L: Lanes, C> Playing<L, C> {
    #[inline(always)]
    pub(super) fn new(columns: C, weights: Weights<L>) -> Self {
        Self { columns, weights }
    }
}

impl<L: Lanes, C: Columns<L>> Playing<L, C> {
    /// What 16-bit keys become, times [`ONE`].
    #[inline(always)]
    fn mixed<const N: usize>(&mut self) -> [L; N] {
        let words = self.columns.next::<N>();
        let mut mixed = [L::splat(0.0); N];
        for index in 0..N {
            mixed[index] = L::dot_pairs(words[index], self.weights.pair);
        }
        mixed
    }

    /// A place that goes far.
    #[inline(always)]
    fn far(&mut self) -> [L; 3] {
        let words = self.columns.next::<6>();
        let mut place = [L::splat(0.0); 3];
        for axis in 0..3 {
            let (start, way) = (words[2 * axis], words[2 * axis + 1]);
            place[axis] = L::from_bits(way).mul_add(self.weights.share, L::from_bits(start));
        }
        place
    }
}

impl<L: Lanes, C: Columns<L>> Source<L> for Playing<L, C> {
    #[inline(always)]
    fn next(&mut self, joint: &LevelJoint) -> Local<L> {
        let [x, y, z, w] = self.mixed();
        let turn = QuatLanes { x, y, z, w };
        let place = match joint.place {
            Place::Fixed(place) => [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
            Place::Narrow(middle, unit) => {
                let [x, y, z] = self.mixed();
                [
                    L::splat(unit.x).mul_add(x, L::splat(middle.x)),
                    L::splat(unit.y).mul_add(y, L::splat(middle.y)),
                    L::splat(unit.z).mul_add(z, L::splat(middle.z)),
                ]
            }
            Place::Wide => self.far(),
        };
        Local { turn, place }
    }

    #[inline(always)]
    fn next_unit(&mut self, joint: &LevelJoint) -> Local<L> {
        let local = self.next(joint);
        Local {
            turn: local.turn.between_keys_normalized(),
            ..local
        }
    }
}

/// Two clips, mixed.
pub(super) struct Mixed<L, A, B> {
    pub(super) first: A,
    pub(super) second: B,
    /// Of the second.
    pub(super) weight: L,
}

impl<L: Lanes, A: Source<L>, B: Source<L>> Source<L> for Mixed<L, A, B> {
    #[inline(always)]
    fn next(&mut self, joint: &LevelJoint) -> Local<L> {
        let (a, b) = (self.first.next_unit(joint), self.second.next_unit(joint));
        let turn = a.turn.towards(b.turn, self.weight);
        let ([ax, ay, az], [bx, by, bz]) = (a.place, b.place);
        let place = [
            (bx - ax).mul_add(self.weight, ax),
            (by - ay).mul_add(self.weight, ay),
            (bz - az).mul_add(self.weight, az),
        ];
        Local { turn, place }
    }

    #[inline(always)]
    fn next_unit(&mut self, joint: &LevelJoint) -> Local<L> {
        let local = self.next(joint);
        Local {
            turn: local.turn.normalized(),
            ..local
        }
    }
}
