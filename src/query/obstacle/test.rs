//! The exact test of a motion against obstacles.
//!
//! Beyond the paper, whose characters stand in an empty plane. A motion is sampled at [`RATE`]. An obstacle that is further from the
//! root than the body reaches is skipped until root and obstacle have moved that far towards each other: most obstacles cost one
//! distance. At the samples that are left, those spheres of the body are tested that reach as far from the root as the obstacle is
//! (distances are 1-Lipschitz).

use glam::Vec3;

use super::Obstacle;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::Motion;
use crate::maps::BakedGraph;

/// Samples per second.
const RATE: f32 = 30.0;

/// Scratch of the test.
#[derive(Clone, Debug, Default)]
pub(crate) struct ObstacleScratch {
    pub(crate) motion: Motion,
    roots: Vec<Vec3>,
    /// Distance that the root has gone until each sample, in metres.
    gone: Vec<f32>,
    near: Vec<NearSample>,
    pose: Pose,
    joints: Vec<JointTransform>,
    centres: Vec<Vec3>,
    /// How far each sphere of the posed body reaches from the root, in metres.
    extents: Vec<f32>,
}

/// A sample at which an obstacle is within reach of the body.
#[derive(Clone, Copy, Debug)]
struct NearSample {
    tick: u32,
    obstacle: u32,
    /// Distance of the root from the obstacle, in metres.
    metres: f32,
}

/// A motion against obstacles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObstacleTest<'a> {
    pub baked: &'a BakedGraph,
    /// Where they are when the motion starts, and how they move.
    pub obstacles: &'a [Obstacle],
    /// The part of the motion that is tested, from its start, in seconds.
    pub seconds: (f32, f32),
    /// Whether the test ends at the first obstacle that is entered; otherwise the deepest entry is found.
    pub until_entered: bool,
}

/// Where a motion enters an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObstacleHit {
    /// Depth times the obstacle's weight, in metres.
    pub harm: f32,
    /// Time since the start of the motion, in seconds.
    pub time: f32,
    /// The body's sphere that enters deepest.
    pub sphere: usize,
}

impl ObstacleTest<'_> {
    /// The worst entry; `None` if none is entered. The motion must last until the end.
    pub(crate) fn on_motion(
        &self,
        motion: &Motion,
        scratch: &mut ObstacleScratch,
    ) -> Option<ObstacleHit> {
        if self.obstacles.is_empty() {
            return None;
        }
        self.find_near(motion, scratch);
        let mut worst: Option<ObstacleHit> = None;
        let mut at = 0;
        // The sample at which the root is nearest is tested first: where one is entered, this one is usually.
        let nearest = { scratch.near.iter().enumerate() }
            .min_by(|a, b| a.1.metres.total_cmp(&b.1.metres))
            .map(|(at, _)| at)?;
        let tick = scratch.near[nearest].tick;
        self.sample(motion, (nearest, tick), (scratch, &mut worst));
        while at < scratch.near.len() && !(self.until_entered && worst.is_some()) {
            let tick = scratch.near[at].tick;
            let range = self.sample(motion, (at, tick), (scratch, &mut worst));
            at = range;
        }
        worst
    }

    /// Poses a sample and tests the obstacles that are near then, from position `at` of the list on. Returns the position after them.
    fn sample(
        &self,
        motion: &Motion,
        (at, tick): (usize, u32),
        (scratch, worst): (&mut ObstacleScratch, &mut Option<ObstacleHit>),
    ) -> usize {
        let ObstacleScratch {
            near,
            pose,
            joints,
            centres,
            extents,
            roots,
            ..
        } = scratch;
        let graph = self.baked.graph();
        let seconds = self.seconds.0 + tick as f32 / RATE;
        motion.sample(graph, seconds, pose);
        forward_kinematics(graph.skeleton(), pose, joints);
        self.baked.body().centres(joints, centres);
        let (root, spheres) = (roots[tick as usize], &self.baked.body().spheres);
        extents.clear();
        extents.extend(
            centres
                .iter()
                .zip(spheres)
                .map(|(centre, part)| centre.distance(root) + part.radius),
        );
        let widest = extents
            .iter()
            .fold(0.0, |widest: f32, &extent| widest.max(extent));
        let same = near[at..].iter().take_while(|one| one.tick == tick);
        let mut next = at;
        for one in same {
            next += 1;
            let obstacle = &self.obstacles[one.obstacle as usize];
            let known = worst.map_or(0.0, |worst| worst.harm);
            if (widest - one.metres) * obstacle.weight <= known {
                continue;
            }
            for (sphere, ((centre, part), extent)) in
                centres.iter().zip(spheres).zip(&*extents).enumerate()
            {
                let known = worst.map_or(0.0, |worst| worst.harm);
                if (extent - one.metres) * obstacle.weight <= known {
                    continue;
                }
                let metres = obstacle.distance(*centre, seconds) - part.radius;
                let harm = -metres * obstacle.weight;
                if harm > known {
                    *worst = Some(ObstacleHit {
                        harm,
                        time: seconds,
                        sphere,
                    });
                }
            }
        }
        next
    }

    /// Lists the samples at which an obstacle is within reach, by time.
    fn find_near(&self, motion: &Motion, scratch: &mut ObstacleScratch) {
        let ObstacleScratch {
            roots, gone, near, ..
        } = scratch;
        let (graph, reach) = (self.baked.graph(), self.baked.reach());
        let (from, to) = self.seconds;
        let ticks = ((to - from).max(0.0) * RATE).ceil() as usize + 1;
        roots.clear();
        gone.clear();
        near.clear();
        let mut sum = 0.0;
        for tick in 0..ticks {
            let root = motion.root(graph, from + tick as f32 / RATE);
            sum += roots.last().map_or(0.0, |last: &Vec3| last.distance(root));
            roots.push(root);
            gone.push(sum);
        }
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let speed = obstacle.velocity.length() / RATE;
            let mut tick = 0;
            while tick < ticks {
                let seconds = from + tick as f32 / RATE;
                let metres = obstacle.distance(roots[tick], seconds);
                let free = metres - reach;
                if free <= 0.0 {
                    near.push(NearSample {
                        tick: tick as u32,
                        obstacle: index as u32,
                        metres,
                    });
                    tick += 1;
                    continue;
                }
                let start = tick;
                let moved = |at: usize| gone[at] - gone[start] + speed * (at - start) as f32;
                tick += 1;
                while tick < ticks && moved(tick) < free {
                    tick += 1;
                }
            }
        }
        near.sort_unstable_by_key(|one| (one.tick, one.obstacle));
    }
}
