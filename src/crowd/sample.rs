//! A clip read at the moments of a register's characters.

use glam::{Quat, Vec3};

use super::bank::{Bank, BankJoint, Place, Span};
use super::quantise::ONE;
use crate::math::{Lanes, Line};

/// A rotation for each lane, of any length.
#[derive(Clone, Copy)]
pub(super) struct Turn<L> {
    pub(super) x: L,
    pub(super) y: L,
    pub(super) z: L,
    pub(super) w: L,
}

impl<L: Lanes> Turn<L> {
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
}

/// A joint's motion under its parent, for each lane.
#[derive(Clone, Copy)]
pub(super) struct Local<L> {
    pub(super) turn: Turn<L>,
    pub(super) place: [L; 3],
}

impl<L: Lanes> Local<L> {
    /// The same for all.
    #[inline(always)]
    pub(super) fn splat(turn: Quat, place: Vec3) -> Self {
        Self {
            turn: Turn {
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
    fn next(&mut self, joint: &BankJoint) -> Local<L>;
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
    pub(super) fn of(span: &Span) -> Self {
        let length = span.intervals as f32;
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
    fn next(&mut self) -> L::Words;
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
    pub(super) fn new(span: &Span, interval: L) -> Option<Self> {
        // From the lane that is furthest behind; the first lane is only near it.
        let first = interval.first();
        let half = L::splat((span.intervals / 2) as f32);
        let ahead = Cycle::of(span).wrapped_whole(interval - L::splat(first) + half);
        let least = ahead.least();
        let places = ahead - L::splat(least);
        if !places.all_below(L::REACH as f32) {
            return None;
        }
        let start = first as usize + least as usize + span.intervals - span.intervals / 2;
        let start = if start < span.intervals {
            start
        } else {
            start - span.intervals
        };
        Some(Self {
            start: start.min(span.intervals - 1),
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
    pub(super) fn new(bank: &'a Bank, span: &Span, near: Near<L>) -> Self {
        Self {
            words: &bank.words,
            start: bank.base(span) + near.start,
            stride: span.stride(),
            places: near.places,
        }
    }
}

impl<L: Lanes> Columns<L> for Window<'_, L> {
    #[inline(always)]
    fn next(&mut self) -> L::Words {
        let start = self.start;
        self.start += self.stride;
        L::window(self.words, start, self.places)
    }
}

/// Columns that were made of sixteen rows.
pub(super) struct Turned<'a> {
    pub(super) lines: std::slice::Iter<'a, Line>,
    pub(super) part: usize,
}

impl<L: Lanes> Columns<L> for Turned<'_> {
    #[inline(always)]
    fn next(&mut self) -> L::Words {
        match self.lines.next() {
            Some(line) => L::load_words(line, self.part),
            None => L::splat_words(0),
        }
    }
}

/// The rows of sixteen characters who may be anywhere in any clip become columns.
#[inline(always)]
pub(super) fn turn_rows<L: Lanes>(bank: &Bank, rows: &[u32; Line::LANES], columns: &mut [Line]) {
    let length = bank.row_lines;
    let mut sixteen: [&[Line]; Line::LANES] = [&[]; Line::LANES];
    for lane in 0..Line::LANES {
        sixteen[lane] = &bank.rows[rows[lane] as usize * length..][..length];
    }
    for (index, columns) in columns
        .chunks_exact_mut(Line::LANES)
        .take(length)
        .enumerate()
    {
        let mut lines = [&Line::ZERO; Line::LANES];
        for lane in 0..Line::LANES {
            lines[lane] = &sixteen[lane][index];
        }
        columns.copy_from_slice(&L::transpose(lines));
    }
}

/// One clip.
pub(super) struct Playing<L: Lanes, C> {
    columns: C,
    /// Of the key before and the key after, as 16-bit numbers whose sum is [`ONE`].
    weights: L::Words,
    share: L,
}

impl<L: Lanes, C> Playing<L, C> {
    #[inline(always)]
    pub(super) fn new(columns: C, share: L) -> Self {
        let after = (share * L::splat(ONE) + L::splat(0.5)).floor();
        let before = L::splat(ONE) - after;
        Self {
            columns,
            weights: L::pair(before.truncated(), after.truncated()),
            share,
        }
    }
}

impl<L: Lanes, C: Columns<L>> Playing<L, C> {
    /// What 16-bit keys become, times [`ONE`].
    #[inline(always)]
    fn mixed(&mut self) -> L {
        L::dot_pairs(self.columns.next(), self.weights)
    }

    /// One coordinate of a place that goes far.
    #[inline(always)]
    fn coordinate(&mut self) -> L {
        let start = L::from_bits(self.columns.next());
        let way = L::from_bits(self.columns.next());
        way.mul_add(self.share, start)
    }
}

impl<L: Lanes, C: Columns<L>> Source<L> for Playing<L, C> {
    #[inline(always)]
    fn next(&mut self, joint: &BankJoint) -> Local<L> {
        let turn = Turn {
            x: self.mixed(),
            y: self.mixed(),
            z: self.mixed(),
            w: self.mixed(),
        };
        let place = match joint.place {
            Place::Fixed(place) => [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
            Place::Narrow(middle, unit) => [
                L::splat(unit.x).mul_add(self.mixed(), L::splat(middle.x)),
                L::splat(unit.y).mul_add(self.mixed(), L::splat(middle.y)),
                L::splat(unit.z).mul_add(self.mixed(), L::splat(middle.z)),
            ],
            Place::Wide => [self.coordinate(), self.coordinate(), self.coordinate()],
        };
        Local { turn, place }
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
    fn next(&mut self, joint: &BankJoint) -> Local<L> {
        let (a, b) = (self.first.next(joint), self.second.next(joint));
        let (turn_a, turn_b) = (a.turn.normalized(), b.turn.normalized());
        let turn = turn_a.towards(turn_b, self.weight);
        let ([ax, ay, az], [bx, by, bz]) = (a.place, b.place);
        let place = [
            (bx - ax).mul_add(self.weight, ax),
            (by - ay).mul_add(self.weight, ay),
            (bz - az).mul_add(self.weight, az),
        ];
        Local { turn, place }
    }
}
