//! A clip read at the moments of a register's characters.

use super::bank::{BankJoint, Span};
use super::quantise::ONE;
use crate::math::Lanes;

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

/// What gives the motion of one joint after the other, in the bank's order.
pub(super) trait Source<L: Lanes> {
    fn next(&mut self, words: &[u32], joint: &BankJoint) -> Local<L>;
}

/// The interval between keys that each lane is in, as a float, and how far in it, from 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct Moment<L> {
    pub(super) interval: L,
    pub(super) share: L,
}

/// Into `0..length`; what is no number becomes 0. Rounding may give `length` itself.
#[inline(always)]
fn wrapped<L: Lanes>(value: L, length: L) -> L {
    let rest = value - (value / length).floor() * length;
    rest.max(L::splat(0.0)).min(length)
}

impl<L: Lanes> Moment<L> {
    /// Of a time that is counted in intervals.
    ///
    /// No step is fused, so that all machines take the same interval.
    #[inline(always)]
    pub(super) fn of(time: L, length: L) -> Self {
        let time = wrapped(time, length);
        let interval = time.floor().min(length - L::splat(1.0));
        Self {
            interval,
            share: time - interval,
        }
    }
}

/// Words of one column after the other.
pub(super) trait Columns<L: Lanes> {
    fn next(&mut self, words: &[u32]) -> L::Words;
}

/// Lanes that are near each other in time: one load fetches what all of them need.
#[derive(Clone, Copy)]
pub(super) struct Window<L: Lanes> {
    start: usize,
    stride: usize,
    places: L::Words,
}

impl<L: Lanes> Window<L> {
    /// `None` where the lanes are not within [`Lanes::COUNT`] intervals of each other.
    #[inline(always)]
    pub(super) fn new(span: &Span, interval: L) -> Option<Self> {
        // From the lane that is furthest behind; the first lane is only near it.
        let length = L::splat(span.intervals as f32);
        let first = interval.first();
        let half = L::splat((span.intervals / 2) as f32);
        let ahead = wrapped(interval - L::splat(first) + half, length);
        let least = ahead.least();
        let places = ahead - L::splat(least);
        if !places.all_below(L::COUNT as f32) {
            return None;
        }
        let start = first as usize + least as usize + span.intervals - span.intervals / 2;
        let start = if start < span.intervals {
            start
        } else {
            start - span.intervals
        };
        Some(Self {
            start: span.base + start.min(span.intervals - 1),
            stride: span.stride,
            places: places.truncated(),
        })
    }
}

impl<L: Lanes> Columns<L> for Window<L> {
    #[inline(always)]
    fn next(&mut self, words: &[u32]) -> L::Words {
        let start = self.start;
        self.start += self.stride;
        L::window(words, start, self.places)
    }
}

/// Lanes that are anywhere in any clip.
#[derive(Clone, Copy)]
pub(super) struct Scattered<L: Lanes> {
    pub(super) places: L::Words,
    pub(super) stride: L::Words,
}

impl<L: Lanes> Scattered<L> {
    #[inline(always)]
    pub(super) fn new(span: &Span, interval: L) -> Self {
        Self {
            places: L::sum(L::splat_words(span.base as u32), interval.truncated()),
            stride: L::splat_words(span.stride as u32),
        }
    }
}

impl<L: Lanes> Columns<L> for Scattered<L> {
    #[inline(always)]
    fn next(&mut self, words: &[u32]) -> L::Words {
        let places = self.places;
        self.places = L::sum(places, self.stride);
        L::gather(words, places)
    }
}

/// One clip.
#[derive(Clone, Copy)]
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
    /// One component of a rotation.
    #[inline(always)]
    fn component(&mut self, words: &[u32]) -> L {
        L::dot_pairs(self.columns.next(words), self.weights)
    }

    /// One coordinate of a place.
    #[inline(always)]
    fn coordinate(&mut self, words: &[u32]) -> L {
        let start = L::from_bits(self.columns.next(words));
        let way = L::from_bits(self.columns.next(words));
        way.mul_add(self.share, start)
    }
}

impl<L: Lanes, C: Columns<L>> Source<L> for Playing<L, C> {
    #[inline(always)]
    fn next(&mut self, words: &[u32], joint: &BankJoint) -> Local<L> {
        let turn = Turn {
            x: self.component(words),
            y: self.component(words),
            z: self.component(words),
            w: self.component(words),
        };
        let place = match joint.place {
            Some(place) => [L::splat(place.x), L::splat(place.y), L::splat(place.z)],
            None => [
                self.coordinate(words),
                self.coordinate(words),
                self.coordinate(words),
            ],
        };
        Local { turn, place }
    }
}

/// Two clips, mixed.
#[derive(Clone, Copy)]
pub(super) struct Mixed<L, A, B> {
    pub(super) first: A,
    pub(super) second: B,
    /// Of the second.
    pub(super) weight: L,
}

impl<L: Lanes, A: Source<L>, B: Source<L>> Source<L> for Mixed<L, A, B> {
    #[inline(always)]
    fn next(&mut self, words: &[u32], joint: &BankJoint) -> Local<L> {
        let (a, b) = (
            self.first.next(words, joint),
            self.second.next(words, joint),
        );
        let (turn_a, turn_b) = (a.turn.normalized(), b.turn.normalized());
        // Along the shorter arc.
        let to_b = self.weight.copy_sign(turn_a.dot(turn_b));
        let to_a = L::splat(1.0) - self.weight;
        let turn = Turn {
            x: turn_a.x.mul_add(to_a, turn_b.x * to_b),
            y: turn_a.y.mul_add(to_a, turn_b.y * to_b),
            z: turn_a.z.mul_add(to_a, turn_b.z * to_b),
            w: turn_a.w.mul_add(to_a, turn_b.w * to_b),
        };
        let ([ax, ay, az], [bx, by, bz]) = (a.place, b.place);
        let place = [
            (bx - ax).mul_add(self.weight, ax),
            (by - ay).mul_add(self.weight, ay),
            (bz - az).mul_add(self.weight, az),
        ];
        Local { turn, place }
    }
}
