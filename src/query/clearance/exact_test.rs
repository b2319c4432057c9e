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
use super::pose_cache::{AdditiveLayer, PoseCache};
use super::sweep::{Sweep, SweepScratch, TimeWindow};
use crate::graph::push::{PUSH_WINDOW, acceleration};
use crate::graph::{Motion, Played};
use crate::maps::BakedGraph;
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
    /// Radii of the spheres in one test.
    radii: Vec<f32>,
    /// A motion that is built for one test.
    pub(in crate::query) motion: Motion,
    obstacles: ObstacleScratch,
    /// A motion that is built for a test of obstacles.
    pub(in crate::query) among_obstacles: Motion,
    limit: WorkLimit,
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

    pub(crate) fn is_late(&self) -> bool {
        let most = self.limit.most;
        let is_over = most > 0 && self.work >= most;
        let is_late = || self.deadline().is_some_and(|it| Instant::now() >= it);
        !self.has_grace && (is_over || is_late())
    }

    /// Time from which on nothing is tested, if there is one now.
    fn deadline(&self) -> Option<Instant> {
        self.limit.deadline.filter(|_| !self.has_grace)
    }

    /// Adds a layer to all motions that are tested from now on.
    pub(crate) fn set_additive(&mut self, additive: &AdditiveLayer) {
        self.poses.set_additive(additive);
    }

    /// Removes the poses of earlier motions, so that they take no memory.
    pub(crate) fn forget(&mut self) {
        self.poses.clear();
    }

    /// The largest horizontal acceleration of the body's centre of mass on a motion until `end`, or the first one above `limit`, in metres per
    /// second squared; infinite beyond the limit of work. The motion must last until then. The first windows reach into what was `played` before,
    /// if it is given.
    pub(crate) fn push(
        &mut self,
        baked: &BakedGraph,
        played: Option<Played<'_>>,
        motion: &Motion,
        end: f32,
        limit: f32,
    ) -> f32 {
        /// Number of centres in a window of [`PUSH_WINDOW`], and of samples from one centre to the next: the exact test has most of these poses.
        const CENTRES: usize = 2;
        const TICKS: usize = (PUSH_WINDOW * SAMPLE_RATE) as usize / CENTRES;
        const STEP: f32 = TICKS as f32 / SAMPLE_RATE;
        let before = self.poses.count;
        let (mut centres, mut most) = ([Vec2::ZERO; 2 * CENTRES + 1], 0.0);
        let known = played.map_or(0, |it| (it.seconds / (it.rate * STEP)) as usize);
        let known = known.min(2 * CENTRES);
        for index in 0.. {
            let seconds = (index as f32 - known as f32) * STEP;
            if seconds > end || most > limit {
                break;
            }
            if self.is_late() {
                most = f32::INFINITY;
                break;
            }
            let moment = match played.filter(|_| index < known) {
                Some(it) => it.motion.moment_at(it.seconds + seconds * it.rate),
                None => motion.moment_at(seconds),
            };
            if index == 0 || index == known {
                self.poses.start(baked, moment.motion);
            }
            let number = self.poses.number(baked, moment);
            centres.rotate_left(1);
            centres[2 * CENTRES] = self.poses.centre_of_mass(baked, number).xz();
            if index >= 2 * CENTRES {
                let way = [0, CENTRES, 2 * CENTRES].map(|at| centres[at]);
                most = acceleration(way).max(most);
            }
        }
        self.work += self.poses.count.saturating_sub(before);
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
        let before = self.poses.count;
        let worst = test.worst_entry(motion, &mut self.poses, &mut self.obstacles);
        self.work += test.obstacles.len() + self.poses.count.saturating_sub(before);
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
        let deadline = scratch.deadline();
        let (poses, posed) = (&mut scratch.poses, &mut scratch.posed);
        let before = poses.count;
        let mut body = posed.on(poses, self.baked, motion, self.sampling);
        let mut sweep = Sweep::new(self.attack, self.extent, deadline, &mut scratch.sweep);
        sweep.run(&mut body, TimeWindow::on_motion(0.0, f32::INFINITY));
        let nearest = sweep.nearest();
        scratch.work += self.attack.spheres().len() + poses.count.saturating_sub(before);
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
        self.on_track_with_held_feet(part, (0.0, 0.0), scratch, build)
    }

    /// Like [`ExactTest::on_track`], for a body with feet that are held up to `moved` metres from where the track has them, until a time in seconds.
    /// If the attack may then come nearer to the legs than to the rest of the body, the motion is posed.
    pub(in crate::query) fn on_track_with_held_feet(
        &self,
        part: &PlayedTrack<'_>,
        (moved, until): (f32, f32),
        scratch: &mut MotionBody,
        build: impl FnOnce(&mut Motion),
    ) -> Clearance {
        if scratch.is_late() {
            return self.too_late();
        }
        if !scratch.poses.additive.is_empty() {
            // The track is that of a body without it.
            return self.on_built_motion(scratch, build);
        }
        let deadline = scratch.deadline();
        let (poses, posed) = (&mut scratch.poses, &mut scratch.posed);
        let (memory, radii) = (&mut scratch.sweep, &mut scratch.radii);
        let before = poses.count;
        let (from, to) = part.seconds;
        let is_covered = self.attack.start() >= from && self.attack.end() <= to;
        let rows = self.baked.body_rows();
        let spheres = || rows.radii().iter().zip(rows.knee_shares());
        let wider = knee_moved(moved);
        // Without an offset the body is that of the track from the start on.
        let until = if wider > 0.0 { until.min(to) } else { from };
        let until = until.max(from);
        let [held, free] = [(from, until), (until, to)].map(|(from, to)| TimeWindow {
            from,
            to,
            ..part.window()
        });
        let mut is_open = false;
        let mut sweep = Sweep::new(self.attack, self.extent, deadline, memory);
        if wider > 0.0 {
            radii.clear();
            radii.extend(spheres().map(|(radius, share)| radius + share * wider));
            sweep.run(&mut self.tracked(part, radii, wider), held);
            let found = sweep.nearest();
            let is_leg = rows.knee_shares().get(found.body_sphere) > Some(&0.0);
            is_open = is_leg && found.metres < self.extent.below;
        }
        if is_open {
            radii.clear();
            radii.extend(spheres().map(|(radius, share)| match *share > 0.0 {
                true => f32::NEG_INFINITY,
                false => *radius,
            }));
            sweep = Sweep::new(self.attack, self.extent, deadline, memory);
            sweep.run(&mut self.tracked(part, radii, 0.0), held);
        }
        sweep.run(&mut self.tracked(part, rows.radii(), 0.0), free);
        if !sweep.is_over() && (is_open || !is_covered) {
            build(&mut scratch.motion);
            let mut body = posed.on(poses, self.baked, &scratch.motion, self.sampling);
            let posed_to = if is_open { until } else { from };
            sweep.run(&mut body, TimeWindow::on_motion(0.0, posed_to));
            if self.attack.end() > to {
                sweep.run(&mut body, TimeWindow::on_motion(to, f32::INFINITY));
            }
        }
        let nearest = sweep.nearest();
        scratch.work += self.attack.spheres().len() + poses.count.saturating_sub(before);
        nearest
    }

    /// The body on a track, whose radii are wider by `wider` metres at most.
    fn tracked<'t>(&self, part: &PlayedTrack<'t>, radii: &'t [f32], wider: f32) -> TrackedBody<'t>
    where
        'a: 't,
    {
        TrackedBody {
            baked: self.baked,
            track: part.track,
            radii,
            wider,
        }
    }

    /// The result beyond the limit of a [`MotionBody`]: a hit.
    fn too_late(&self) -> Clearance {
        Clearance {
            metres: -f32::MIN_POSITIVE,
            ..Clearance::none(self.attack.start())
        }
    }
}

/// Estimated distance by which a knee moves if the foot is moved by d, in metres: half as far with the line from hip to foot, and away from
/// that line. It is r from the line where a leg of two bones of length b is 2 √(b² - r²) long, and √(r² + d b) where that is shorter by d.
///
/// A chosen motion is tested as it is posed. What this estimate misses costs time only.
fn knee_moved(foot: f32) -> f32 {
    /// Length of a bone, and distance of the knee of a leg that stands, in metres.
    const BONE: f32 = 0.5;
    const STANDING: f32 = 0.05;
    0.5 * foot + (STANDING * STANDING + foot * BONE).sqrt() - STANDING
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use glam::Vec3;
    use sabaki_fixtures::random::Random;

    use super::*;
    use crate::graph::Played;
    use crate::maps::SphereKey;
    use crate::math::Rigid2;
    use crate::query::fixture::baked;

    /// Balls at a body that plays an evasion while its feet stay where they stood in the motion before it, 5 cm beside.
    #[test]
    fn a_track_with_held_feet_is_as_near_as_the_posed_motion() {
        let (baked, graph) = (baked(), baked().graph());
        let track = baked.track(0);
        let start = baked.evasions()[0].playhead();
        let mut beside = Motion::new(graph, start, &[]);
        beside.transform(Rigid2::new(0.0, 0.05, 0.0));
        beside.extend(graph, 4.0);
        let mut before = Motion::new(graph, start, &[]);
        let played = Played {
            motion: &beside,
            seconds: 0.0,
            rate: 1.0,
        };
        before.blend_on_feet(graph, played, [0.2, 0.3], Vec2::ZERO, &[Some(3.0); 2]);
        let mut motion = Motion::new(graph, start, &[]);
        motion.continue_blend(&before, 0.5);
        motion.extend(graph, 3.0);
        let lifted = [Some(0.4); 2];
        motion.release_feet(&lifted);
        let moved = motion.held_feet_moved(0.0, &lifted);
        let moved = moved.unwrap();
        assert!(moved.0 > 0.04 && (0.4..0.8).contains(&moved.1), "{moved:?}");
        let part = PlayedTrack::new(track, Rigid2::IDENTITY, 0.0);
        let (mut random, mut body) = (Random::new(3), MotionBody::default());
        let (mut posed, mut hits, mut most) = (0, 0, 0.0f32);
        const BALLS: usize = 400;
        for number in 0..BALLS {
            let way = Rigid2::new(random.float(-3.0, 3.0), 0.0, 0.0);
            let height = random.float(0.1, 1.9);
            let aside = random.float(-0.5, 0.5);
            let key = |t: f32, z: f32| SphereKey {
                t,
                center: way.point(Vec3::new(aside, height, z)),
                radius: 0.1,
            };
            let attack = Attack::new(vec![vec![key(0.1, 3.5), key(0.95, -3.3)]]).unwrap();
            let whole = ExactTest::new(baked, &attack);
            let naive = whole.on_motion(&motion, &mut body);
            // Beyond `below` it is only known that the body is further.
            let extent = match number % 2 {
                0 => Extent::WHOLE,
                _ => Extent {
                    below: 0.1,
                    ..Extent::UNTIL_HIT
                },
            };
            let test = ExactTest { extent, ..whole };
            let mut is_posed = false;
            let found = test.on_track_with_held_feet(&part, moved, &mut body, |out| {
                is_posed = true;
                out.clone_from(&motion);
            });
            let whole = test.on_track(&part, &mut body, |_| ());
            let still = (0.0, f32::INFINITY);
            let held = test.on_track_with_held_feet(&part, still, &mut body, |_| ());
            assert_eq!(held, whole);
            posed += usize::from(is_posed);
            hits += usize::from(!naive.is_clean());
            let expected = naive.metres.min(extent.below);
            if found.is_clean() || extent == Extent::WHOLE {
                most = most.max((found.metres - expected).abs());
            } else {
                assert!(naive.metres < 0.004, "{found:?} {naive:?}");
            }
        }
        assert!(most < 0.004, "{most}");
        assert!(hits > BALLS / 8 && hits < BALLS, "{hits}");
        assert!(posed > 0 && posed < BALLS / 2, "{posed}");
    }
}
