//! How much warning does a dodge need? The share of avoided balls by the time from the query to the contact.

use super::{LEGS, limb_of, wilson};
use sabaki::maps::BakedGraph;
use sabaki::query::Answer;
use sabaki_fixtures::balls::TimedThrow;
use sabaki_fixtures::throw::Throw;

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
    pub fn value(self) -> f64 {
        f64::from(self.avoided) / f64::from(self.attacks.max(1))
    }

    /// 95% confidence interval of the share.
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
    /// Number of hits by each cause, in the order of [`Cause::ALL`].
    pub causes: [u32; 4],
    /// Sum of the depths of the hits by [`Cause::Leg`] and [`Cause::Short`], metres.
    pub depth: f64,
}

impl TimeRow {
    /// Notes what became of a ball.
    pub fn add(&mut self, baked: &BakedGraph, throw: &TimedThrow, answer: &Answer) {
        let avoided = answer.avoided;
        if !avoided {
            let cause = Cause::of(baked, &throw.throw, answer);
            self.causes[cause as usize] += 1;
            if matches!(cause, Cause::Leg | Cause::Short) {
                self.depth -= f64::from(answer.clearance().metres);
            }
        }
        self.all.add(avoided);
        self.parts[throw.part as usize].add(avoided);
        if throw.walks {
            self.walking.add(avoided);
            let is_layered = answer.chosen().layer.is_some();
            self.walking_on.add(avoided && is_layered);
        }
    }

    /// Mean length by which the displacement falls short, over the hits by a leg or by too short a displacement, in metres.
    pub fn short_by(&self) -> Option<f64> {
        let count = self.causes[Cause::Leg as usize] + self.causes[Cause::Short as usize];
        (count > 0).then(|| self.depth / f64::from(count))
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
        self.depth += other.depth;
        for (mine, theirs) in self.causes.iter_mut().zip(other.causes) {
            *mine += theirs;
        }
        for (mine, theirs) in self.parts.iter_mut().zip(other.parts) {
            *mine += theirs;
        }
    }
}

/// The reason for a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// No evasion can be entered plausibly from where the character is, and no edge leads to one in time.
    NoEntry,
    /// Evasions can be entered, but none is far enough under way at the contact.
    NoTime,
    /// Evasions are under way at the contact. The one that comes nearest leaves a foot or knee where it is hit.
    Leg,
    /// Evasions are under way at the contact. The one that comes nearest does not move the rest of the body far enough.
    Short,
}

impl Cause {
    /// All causes, in the order of a table.
    pub const ALL: [Self; 4] = [Self::NoEntry, Self::NoTime, Self::Leg, Self::Short];

    /// Name of the cause: a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoEntry => "no plausible entry",
            Self::NoTime => "no time",
            Self::Leg => "feet",
            Self::Short => "too short",
        }
    }

    /// The cause of an answer that is a hit.
    pub fn of(baked: &BakedGraph, throw: &Throw, answer: &Answer) -> Self {
        if answer.counts.with_evasion == 0 {
            return match baked.has_entries_at(throw.playhead) {
                true => Self::NoTime,
                false => Self::NoEntry,
            };
        }
        let hit = baked.body().spheres[answer.clearance().body_sphere].joint;
        match limb_of(baked.graph(), hit).is_some_and(|limb| limb < LEGS) {
            true => Self::Leg,
            false => Self::Short,
        }
    }
}
