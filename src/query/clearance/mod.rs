//! How near does an attack come? The exact answer, on which the final word rests.
//!
//! Source: Masaoka & Oshita, section 5.4, V_d: the smallest distance between any sphere of the body
//! and any of the attack at equal times. Differs: not at sampled times but between them as well.
//! The body's spheres are taken at [`SAMPLE_RATE`] and go in straight lines in between, the
//! attack's go in straight lines between their keys; the smallest distance of two such spheres is
//! found in closed form.
//!
//! The body comes from one of two places. On any motion it is posed sample by sample
//! ([`on_motion`]). From an evasion's start on it is known beforehand, relative to that start
//! ([`on_track`]): then it is the attack that is moved, and nothing is posed.

mod balls;
mod closest;
mod motion_body;
mod nearest;
mod sweep;

use serde::{Deserialize, Serialize};

pub use closest::closest;
pub use motion_body::MotionBody;

use super::attack::Attack;
use crate::graph::Motion;
use crate::maps::{BakedGraph, BodyTrack};
use crate::math::Rigid2;
use sweep::{Course, Sweep};

/// The body's spheres are taken this many times a second.
pub const SAMPLE_RATE: f32 = BodyTrack::RATE;

/// How much of an attack is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Distances from here on are of no interest, metres: they are not told from this one.
    pub below: f32,
    /// Where something is nearer than this, nothing nearer is looked for, metres: the distance is then no more than is said.
    pub enough: f32,
}

impl Extent {
    /// All of it: the smallest distance, however deep.
    pub const WHOLE: Self = Self {
        below: f32::INFINITY,
        enough: f32::NEG_INFINITY,
    };

    /// Up to the first hit that is found: whether there is one. It may go deeper than is said.
    pub const UNTIL_HIT: Self = Self {
        enough: 0.0,
        ..Self::WHOLE
    };
}

/// How a motion is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampling {
    /// At each sample that the attack may be near.
    #[default]
    Each,
    /// At every fourth one first, and at those between where it is near then. What it calls a hit is
    /// one; a body that leaves the straight way between two of these by more than 2.5 cm may be taken
    /// for cleaner than it is.
    CoarseFirst,
}

impl Sampling {
    /// From one sample that is always taken to the next.
    fn stretch(self) -> usize {
        match self {
            Self::Each => 1,
            Self::CoarseFirst => BodyTrack::STRETCH,
        }
    }
}

/// The smallest distance over an attack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clearance {
    /// Between surfaces, metres; negative where they meet.
    pub metres: f32,
    /// When, seconds since the query.
    pub time: f32,
    /// Which of the body's spheres.
    pub body_sphere: usize,
}

impl Clearance {
    /// Nothing is near yet.
    #[must_use]
    pub fn none(time: f32) -> Self {
        Self {
            metres: f32::INFINITY,
            time,
            body_sphere: 0,
        }
    }

    /// Whether the attack is avoided.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.metres >= 0.0
    }
}

/// The smallest distance between `attack` and the body on `motion`, both in one world; both clocks
/// start with the motion, which must last as long as the attack. `scratch` is kept from one motion
/// to the next.
pub fn on_motion(
    baked: &BakedGraph,
    (motion, sampling): (&Motion, Sampling),
    (attack, extent): (&Attack, Extent),
    scratch: &mut MotionBody,
) -> Clearance {
    scratch.forget();
    on_one_motion(baked, (motion, sampling), (attack, extent), scratch)
}

/// The same for one motion of several in a graph: poses that they share are made once.
pub(in crate::query) fn on_one_motion(
    baked: &BakedGraph,
    (motion, sampling): (&Motion, Sampling),
    (attack, extent): (&Attack, Extent),
    scratch: &mut MotionBody,
) -> Clearance {
    let (posed, stretches, _) = scratch.parts();
    let mut body = posed.on(baked, motion, sampling);
    let mut sweep = Sweep::new(attack, extent, stretches);
    sweep.part(&mut body, Course::of_motion((0.0, f32::INFINITY)));
    sweep.nearest()
}

/// The same for a motion that is built for the test alone, in the memory of `scratch`.
pub(in crate::query) fn on_built_motion(
    baked: &BakedGraph,
    (build, sampling): (impl FnOnce(&mut Motion), Sampling),
    (attack, extent): (&Attack, Extent),
    scratch: &mut MotionBody,
) -> Clearance {
    let (posed, stretches, motion) = scratch.parts();
    build(motion);
    let mut body = posed.on(baked, motion, sampling);
    let mut sweep = Sweep::new(attack, extent, stretches);
    sweep.part(&mut body, Course::of_motion((0.0, f32::INFINITY)));
    sweep.nearest()
}

/// An evasion that a character performs.
#[derive(Clone, Copy, Debug)]
pub struct PlacedEvasion<'a> {
    /// The body from the evasion's start on.
    pub track: &'a BodyTrack,
    /// The character's frame then, in the world.
    pub placement: Rigid2,
    /// When it starts, seconds since the query.
    pub start: f32,
}

/// The same for a motion that comes to an evasion, at a fraction of the cost: `motion` is asked for
/// only when the attack begins before the evasion does or outlasts what is known of it, and what is known
/// does not answer.
pub fn on_track(
    baked: &BakedGraph,
    evasion: &PlacedEvasion<'_>,
    (attack, extent): (&Attack, Extent),
    scratch: &mut MotionBody,
    motion: impl FnOnce(&mut Motion),
) -> Clearance {
    let known = (evasion.start, evasion.start + evasion.track.seconds());
    let is_known = attack.start() >= known.0 && attack.end() <= known.1;
    let (posed, stretches, path) = scratch.parts();
    let mut sweep = Sweep::new(attack, extent, stretches);
    sweep.part(
        &mut baked.of_track(evasion.track),
        Course {
            known,
            origin: evasion.start,
            placement: evasion.placement.inverse(),
        },
    );
    if !is_known && !sweep.is_over() {
        motion(path);
        let mut body = posed.on(baked, path, Sampling::Each);
        sweep.part(&mut body, Course::of_motion((0.0, known.0)));
        sweep.part(&mut body, Course::of_motion((known.1, f32::INFINITY)));
    }
    sweep.nearest()
}
