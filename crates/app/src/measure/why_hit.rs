//! Why an attack was not avoided.

use sabaki::maps::BakedGraph;
use sabaki::query::Answer;

use super::limbs::{LEGS, limb_of};
use sabaki_fixtures::throw::Throw;

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
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoEntry => "no plausible entry",
            Self::NoTime => "no time",
            Self::Leg => "feet",
            Self::Short => "too short",
        }
    }

    /// The cause of an answer that is a hit.
    #[must_use]
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

/// The causes of many hits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Causes {
    /// Number of hits by each cause, in the order of [`Cause::ALL`].
    pub counts: [u32; 4],
    /// Sum of the depths of the hits by [`Cause::Leg`] and [`Cause::Short`], metres.
    depth: f64,
}

impl Causes {
    /// Adds the hit of an answer.
    pub fn add(&mut self, cause: Cause, answer: &Answer) {
        self.counts[cause as usize] += 1;
        if matches!(cause, Cause::Leg | Cause::Short) {
            self.depth -= f64::from(answer.clearance().metres);
        }
    }

    /// Mean length by which the displacement falls short, over the hits by a leg or by too short a displacement, in metres.
    #[must_use]
    pub fn short_by(&self) -> Option<f64> {
        let count = self.counts[Cause::Leg as usize] + self.counts[Cause::Short as usize];
        (count > 0).then(|| self.depth / f64::from(count))
    }
}

impl std::ops::AddAssign for Causes {
    fn add_assign(&mut self, other: Self) {
        for (mine, theirs) in self.counts.iter_mut().zip(other.counts) {
            *mine += theirs;
        }
        self.depth += other.depth;
    }
}
