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

use std::time::Instant;

use glam::{Vec2, Vec3Swizzles};

use super::bodies::{PlayedTrack, PosedSamples, TrackedBody};
use super::extent::{Clearance, Extent, ObstacleHit, SAMPLE_RATE, Sampling};
use super::obstacle_test::{ObstacleScratch, ObstacleTest};
use super::pose_cache::PoseCache;
use super::sweep::{Sweep, SweepScratch, TimeWindow};
use crate::graph::Motion;
use crate::maps::{BakedGraph, PUSH_WINDOW, acceleration};
use crate::query::attack::Attack;

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

/// Scratch of tests, with the poses that several motions have in common. Keep it from one test to the next.
#[derive(Clone, Debug, Default)]
pub struct MotionBody {
    poses: PoseCache,
    posed: PosedSamples,
    sweep: SweepScratch,
    /// A motion that is built for one test.
    pub(in crate::query) motion: Motion,
    obstacles: ObstacleScratch,
    /// A motion that is built for a test of obstacles.
    pub(in crate::query) among_obstacles: Motion,
    limit: WorkLimit,
    /// Work since the limit was set.
    work: usize,
    /// Whether the limit does not hold.
    has_grace: bool,
}

/// What tests may cost until nothing is tested any more.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WorkLimit {
    /// Time from which on nothing is tested; `None`: never.
    pub deadline: Option<Instant>,
    /// Number of poses, and of spheres of attacks that were tested against a motion; 0 for no limit.
    pub most: usize,
}

impl MotionBody {
    /// Sets the limit. Beyond it, tests end at once and call the motion hit.
    pub(crate) fn set_limit(&mut self, limit: WorkLimit) {
        (self.limit, self.work) = (limit, 0);
    }

    /// Sets whether tests go on beyond the limit: the last ones of a motion that was found.
    pub(crate) fn set_grace(&mut self, has_grace: bool) {
        self.has_grace = has_grace;
    }

    /// Whether the limit is reached.
    pub(crate) fn is_late(&self) -> bool {
        let WorkLimit { deadline, most } = self.limit;
        let is_over = most > 0 && self.work >= most;
        let is_late = || deadline.is_some_and(|deadline| Instant::now() >= deadline);
        !self.has_grace && (is_over || is_late())
    }

    /// Removes the poses of earlier motions, so that they take no memory.
    pub(crate) fn forget(&mut self) {
        self.poses.forget();
    }

    /// The largest horizontal acceleration of the body's centre of mass on a motion until `end`, or the first one above `limit`, in metres per
    /// second squared. The motion must last until then.
    pub(crate) fn push(
        &mut self,
        baked: &BakedGraph,
        motion: &Motion,
        end: f32,
        limit: f32,
    ) -> f32 {
        /// Number of centres in a window of [`PUSH_WINDOW`], and of samples from one centre to the next: the exact test has most of these poses.
        const CENTRES: usize = 2;
        const TICKS: usize = (PUSH_WINDOW * SAMPLE_RATE) as usize / CENTRES;
        let before = self.poses.count();
        self.poses.start(baked, motion);
        let (mut centres, mut most) = ([Vec2::ZERO; 2 * CENTRES + 1], 0.0);
        for index in 0.. {
            let seconds = (index * TICKS) as f32 / SAMPLE_RATE;
            if seconds > end || most > limit {
                break;
            }
            let number = self.poses.number(baked, motion.moment_at(seconds));
            centres.rotate_left(1);
            centres[2 * CENTRES] = self.poses.centre_of_mass(baked, number).xz();
            if index >= 2 * CENTRES {
                let way = [0, CENTRES, 2 * CENTRES].map(|at| centres[at]);
                most = acceleration(way).max(most);
            }
        }
        self.work += self.poses.count().saturating_sub(before);
        most
    }

    /// The worst entry of a motion into an obstacle; `None` if it enters none. The motion must last until the end of the tested part.
    pub fn worst_entry(&mut self, test: &ObstacleTest<'_>, motion: &Motion) -> Option<ObstacleHit> {
        if test.obstacles.is_empty() {
            return None;
        }
        if self.is_late() {
            return Some(ObstacleHit {
                harm: f32::MIN_POSITIVE,
                time: test.seconds.0,
                sphere: 0,
            });
        }
        let before = self.poses.count();
        let worst = test.worst_entry(motion, &mut self.poses, &mut self.obstacles);
        self.work += test.obstacles.len() + self.poses.count().saturating_sub(before);
        worst
    }
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
        if scratch.is_late() {
            return self.too_late();
        }
        let MotionBody {
            poses,
            posed,
            sweep,
            work,
            ..
        } = scratch;
        let before = poses.count();
        let mut body = posed.on(poses, self.baked, motion, self.sampling);
        let mut sweep = Sweep::new(self.attack, self.extent, sweep);
        sweep.run(&mut body, TimeWindow::on_motion(0.0, f32::INFINITY));
        let nearest = sweep.nearest();
        *work += self.attack.spheres().len() + poses.count().saturating_sub(before);
        nearest
    }

    /// Like [`ExactTest::on_motion`], for a motion that `build` writes to the memory of `scratch`.
    pub(in crate::query) fn on_built_motion(
        &self,
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        if scratch.is_late() {
            return self.too_late();
        }
        let mut motion = std::mem::take(&mut scratch.motion);
        build(&mut motion);
        let clearance = self.on_motion(&motion, scratch);
        scratch.motion = motion;
        clearance
    }

    /// The smallest distance on a motion of which a part is a baked track. This costs a fraction of a test of the posed motion.
    ///
    /// `build` writes the motion. It is called only if the attack begins before that part or ends after it, and the distance on the track does
    /// not decide the result. The posed parts are sampled as the test says.
    pub fn on_track(
        &self,
        part: &PlayedTrack<'_>,
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        if scratch.is_late() {
            return self.too_late();
        }
        let MotionBody {
            poses,
            posed,
            sweep,
            motion,
            work,
            ..
        } = scratch;
        let before = poses.count();
        let (from, to) = part.seconds;
        let is_covered = self.attack.start() >= from && self.attack.end() <= to;
        let mut sweep = Sweep::new(self.attack, self.extent, sweep);
        let mut body = TrackedBody {
            baked: self.baked,
            track: part.track,
        };
        let window = TimeWindow {
            from,
            to,
            origin: part.origin,
            rate: part.rate,
            placement: part.placement.inverse(),
        };
        sweep.run(&mut body, window);
        if !is_covered && !sweep.is_over() {
            build(motion);
            let mut body = posed.on(poses, self.baked, motion, self.sampling);
            sweep.run(&mut body, TimeWindow::on_motion(0.0, from));
            sweep.run(&mut body, TimeWindow::on_motion(to, f32::INFINITY));
        }
        let nearest = sweep.nearest();
        *work += self.attack.spheres().len() + poses.count().saturating_sub(before);
        nearest
    }

    /// The result beyond the limit of a [`MotionBody`]: a hit.
    fn too_late(&self) -> Clearance {
        Clearance {
            metres: -f32::MIN_POSITIVE,
            ..Clearance::none(self.attack.start())
        }
    }
}
