//! How much warning does a dodge need? The share of avoided balls by the time from the query to the contact.

use super::interval::wilson;
use super::why_hit::{Cause, Causes};
use sabaki::maps::BakedGraph;
use sabaki::query::Answer;
use sabaki_fixtures::balls::TimedThrow;

/// Times from the query to the contact, in seconds.
pub const CONTACTS: [f32; 8] = [0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.5, 2.0];

/// Attacks and how many of them were avoided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AvoidedCount {
    /// Number of attacks.
    pub attacks: u32,
    /// Number of attacks that were avoided.
    pub avoided: u32,
}

impl AvoidedCount {
    /// Adds an attack.
    pub fn add(&mut self, avoided: bool) {
        self.attacks += 1;
        self.avoided += u32::from(avoided);
    }

    /// Share of the attacks that were avoided; 0 if there are none.
    #[must_use]
    pub fn value(self) -> f64 {
        f64::from(self.avoided) / f64::from(self.attacks.max(1))
    }

    /// 95% confidence interval of the share.
    #[must_use]
    pub fn interval(self) -> [f64; 2] {
        wilson(self.avoided, self.attacks)
    }
}

/// Number of avoided balls with one time of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimeRow {
    /// Time of the contact, in seconds from the query.
    pub contact: f32,
    /// All.
    pub all: AvoidedCount,
    /// Balls at each [`Part`](sabaki_fixtures::balls::Part), in the order of [`Part::ALL`](sabaki_fixtures::balls::Part::ALL).
    pub parts: [AvoidedCount; 4],
    /// Balls that come while the character walks.
    pub walking: AvoidedCount,
    /// Balls that come while the character walks; only those count as avoided that it avoids by a layered evasion, so that
    /// it walks on.
    pub walking_on: AvoidedCount,
    /// Why the others hit.
    pub causes: Causes,
}

impl TimeRow {
    /// Notes what became of a ball.
    pub fn add(&mut self, baked: &BakedGraph, throw: &TimedThrow, answer: &Answer) {
        let avoided = answer.avoided;
        if !avoided {
            let cause = Cause::of(baked, &throw.throw, answer);
            self.causes.add(cause, answer);
        }
        self.all.add(avoided);
        self.parts[throw.part as usize].add(avoided);
        if throw.walks {
            self.walking.add(avoided);
            let is_layered = answer.chosen().layer.is_some();
            self.walking_on.add(avoided && is_layered);
        }
    }
}

impl std::ops::AddAssign for AvoidedCount {
    fn add_assign(&mut self, other: Self) {
        self.attacks += other.attacks;
        self.avoided += other.avoided;
    }
}

impl std::ops::AddAssign for TimeRow {
    fn add_assign(&mut self, other: Self) {
        self.all += other.all;
        self.walking += other.walking;
        self.walking_on += other.walking_on;
        self.causes += other.causes;
        for (mine, theirs) in self.parts.iter_mut().zip(other.parts) {
            *mine += theirs;
        }
    }
}
