//! The exact test: the smallest distance between an attack and the body.
//!
//! Source: Masaoka & Oshita, section 5.4, V_d: the smallest distance between any sphere of the body and any sphere of the attack at
//! equal times. Differs: the distance is also measured between samples. The body's spheres are sampled at [`SAMPLE_RATE`] and move
//! in straight lines between samples; the attack's spheres move in straight lines between keys. The smallest distance of two such
//! spheres has a closed form.
//!
//! The body comes from one of two sources. On any motion it is posed sample by sample. From an evasion's start on, a baked body
//! track has the samples, relative to the start; then the attack is moved into the track's frame, and nothing is posed.
//!
//! [`SAMPLE_RATE`]: super::SAMPLE_RATE

use super::body_samples::TimeWindow;
use super::extent::{Extent, Sampling};
use super::posed_body::{MotionBody, SampledMotion};
use super::result::Clearance;
use super::sweep::Sweep;
use super::tracked_body::TrackedBody;
use crate::graph::Motion;
use crate::maps::{BakedGraph, BodyTrack};
use crate::math::Rigid2;
use crate::query::attack::Attack;
use crate::query::entry_candidate::EntryCandidate;

/// A test of one attack.
#[derive(Clone, Copy, Debug)]
pub struct ExactTest<'a> {
    /// The graph of the motions.
    pub baked: &'a BakedGraph,
    /// Attack, in the world of the motions; its clock starts with them.
    pub attack: &'a Attack,
    /// Range in which distances are exact. Default: [`Extent::WHOLE`].
    pub extent: Extent,
    /// The samples of a posed motion. Default: [`Sampling::Each`].
    pub sampling: Sampling,
}

/// An evasion that a character performs.
#[derive(Clone, Copy, Debug)]
pub struct PlacedEvasion<'a> {
    /// Body track from the evasion's start on.
    pub track: &'a BodyTrack,
    /// The character's frame at the evasion's start, in the world.
    pub placement: Rigid2,
    /// Time from the query to the evasion's start, in seconds.
    pub start: f32,
}

impl<'a> ExactTest<'a> {
    /// Creates a test that finds the exact smallest distance over the whole attack, at every sample.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, attack: &'a Attack) -> Self {
        Self {
            baked,
            attack,
            extent: Extent::WHOLE,
            sampling: Sampling::Each,
        }
    }

    /// The smallest distance on a motion, which must last as long as the attack. `scratch` is kept from one test to the next.
    pub fn on_motion(&self, motion: &Motion, scratch: &mut MotionBody) -> Clearance {
        let Some(parts) = scratch.parts() else {
            return self.too_late();
        };
        let mut body = parts.posed.on(parts.poses, self.sampled(motion));
        let mut sweep = Sweep::new(self.attack, self.extent, parts.sweep);
        sweep.run(&mut body, TimeWindow::of_motion(0.0, f32::INFINITY));
        sweep.nearest()
    }

    /// The result after the deadline of a [`MotionBody`]: a touch, so that nothing else is searched for.
    fn too_late(&self) -> Clearance {
        Clearance {
            metres: 0.0,
            ..Clearance::none(self.attack.start())
        }
    }

    /// A motion with the samples of the test.
    fn sampled<'m>(&self, motion: &'m Motion) -> SampledMotion<'m>
    where
        'a: 'm,
    {
        SampledMotion {
            baked: self.baked,
            motion,
            sampling: self.sampling,
        }
    }

    /// Like [`ExactTest::on_motion`], for a motion that `build` writes to the memory of `scratch`.
    pub(in crate::query) fn on_built_motion(
        &self,
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        let Some(parts) = scratch.parts() else {
            return self.too_late();
        };
        build(parts.motion);
        let mut body = parts.posed.on(parts.poses, self.sampled(parts.motion));
        let mut sweep = Sweep::new(self.attack, self.extent, parts.sweep);
        sweep.run(&mut body, TimeWindow::of_motion(0.0, f32::INFINITY));
        sweep.nearest()
    }

    /// The smallest distance on a motion that leads to an evasion. This costs a fraction of a test of the posed motion.
    ///
    /// `build` writes the motion. It is called only if the attack begins before the evasion or ends after its track, and the
    /// distance on the track does not decide the result. The posed part takes every sample.
    pub fn on_track(
        &self,
        evasion: &PlacedEvasion<'_>,
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        let (start, end) = (evasion.start, evasion.start + evasion.track.seconds());
        let is_covered = self.attack.start() >= start && self.attack.end() <= end;
        let Some(parts) = scratch.parts() else {
            return self.too_late();
        };
        let mut sweep = Sweep::new(self.attack, self.extent, parts.sweep);
        let mut body = TrackedBody::new(self.baked, evasion.track);
        sweep.run(
            &mut body,
            TimeWindow {
                from: start,
                to: end,
                origin: start,
                rate: 1.0,
                placement: evasion.placement.inverse(),
            },
        );
        if !is_covered && !sweep.is_over() {
            build(parts.motion);
            let each = SampledMotion {
                sampling: Sampling::Each,
                ..self.sampled(parts.motion)
            };
            let mut body = parts.posed.on(parts.poses, each);
            sweep.run(&mut body, TimeWindow::of_motion(0.0, start));
            sweep.run(&mut body, TimeWindow::of_motion(end, f32::INFINITY));
        }
        sweep.nearest()
    }

    /// The smallest distance on a motion that enters an evasion. From the end of the blend to the end of the evasion's track it is tested on the
    /// track, before and after on posed samples. `build` writes the motion if it is needed. The posed part is sampled as the test says.
    pub(in crate::query) fn on_entry(
        &self,
        candidate: &EntryCandidate,
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        let Some(parts) = scratch.parts() else {
            return self.too_late();
        };
        let mut sweep = Sweep::new(self.attack, self.extent, parts.sweep);
        let (delay, rate) = (candidate.delay, candidate.entry.rate);
        let (mut from, mut to) = (f32::INFINITY, f32::INFINITY);
        if let Some(entered) = self.baked.entry_track(candidate.evasion) {
            let last = match rate {
                1.0 => entered.track.seconds() - candidate.ahead,
                // The rate applies until the evasion's end.
                _ => candidate.left / rate,
            };
            (from, to) = (delay + candidate.entry.blend, delay + last);
            let window = TimeWindow {
                from,
                to,
                origin: delay - candidate.ahead / rate,
                rate,
                placement: candidate.placement.inverse(),
            };
            let mut body = TrackedBody::new(self.baked, &entered.track);
            sweep.run(&mut body, window);
        }
        let is_covered = self.attack.start() >= from && self.attack.end() <= to;
        if !is_covered && !sweep.is_over() {
            build(parts.motion);
            let mut body = parts.posed.on(parts.poses, self.sampled(parts.motion));
            sweep.run(&mut body, TimeWindow::of_motion(0.0, from));
            sweep.run(&mut body, TimeWindow::of_motion(to, f32::INFINITY));
        }
        sweep.nearest()
    }
}
