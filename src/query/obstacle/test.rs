//! The exact test of a motion against obstacles.
//!
//! Beyond the paper, whose characters stand in an empty plane. A motion is sampled at [`ObstacleTest::RATE`]. An obstacle that is further from the
//! axis of the body's [`Column`] than that is wide is skipped until axis and obstacle have moved that far towards each other: most
//! obstacles cost one distance. The body is posed at the samples that are left, and of its spheres those are tested that reach as far
//! from the axis as the obstacle is.

use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;

use super::Obstacle;
use super::column::{Column, Heights};
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::query::clearance::{Clearance, PoseKey};

/// Scratch of the test.
#[derive(Clone, Debug, Default)]
pub struct ObstacleScratch {
    /// A motion that is built for one test.
    pub motion: Motion,
    columns: Vec<Column>,
    /// Distance that the axis has gone until each sample, in metres.
    gone: Vec<f32>,
    near: Vec<NearSample>,
    posed: PosedCentres,
    /// How far each sphere of the posed body reaches from the column's axis, in metres.
    extents: Vec<f32>,
}

/// The body's spheres in the poses that several motions have in common.
#[derive(Clone, Debug, Default)]
struct PosedCentres {
    pose: Pose,
    joints: Vec<JointTransform>,
    posed: Vec<Vec3>,
    /// Start of each pose in `centres`.
    known: FxHashMap<PoseKey, usize>,
    centres: Vec<Vec3>,
}

impl PosedCentres {
    /// Number of poses that are kept.
    const MOST: usize = 1024;

    /// Centres of the spheres `seconds` after the motion's start.
    fn at(&mut self, baked: &BakedGraph, (motion, seconds): (&Motion, f32)) -> &[Vec3] {
        if motion.is_composed(seconds) {
            self.pose(baked, (motion, seconds));
            return &self.posed;
        }
        let key = PoseKey::of(motion.playhead(baked.graph(), seconds));
        let count = baked.body().spheres.len();
        let start = match self.known.get(&key) {
            Some(&start) => start,
            None => {
                if self.known.len() == Self::MOST {
                    self.forget();
                }
                self.pose(baked, (motion, seconds));
                let start = self.centres.len();
                self.centres.extend_from_slice(&self.posed);
                self.known.insert(key, start);
                start
            }
        };
        &self.centres[start..start + count]
    }

    fn pose(&mut self, baked: &BakedGraph, (motion, seconds): (&Motion, f32)) {
        let graph = baked.graph();
        motion.sample(graph, seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
        baked.body().centres(&self.joints, &mut self.posed);
    }

    fn forget(&mut self) {
        self.known.clear();
        self.centres.clear();
    }
}

impl ObstacleScratch {
    /// Forgets all poses. This must be called before a test on another graph.
    pub(in crate::query) fn forget(&mut self) {
        self.posed.forget();
    }
}

/// A sample at which an obstacle touches the body's column.
#[derive(Clone, Copy, Debug)]
struct NearSample {
    tick: u32,
    obstacle: u32,
    /// Distance of the column's axis from the obstacle, in metres.
    metres: f32,
}

/// A motion against obstacles.
#[derive(Clone, Copy, Debug)]
pub struct ObstacleTest<'a> {
    /// The graph and the body.
    pub baked: &'a BakedGraph,
    /// Where they are when the motion starts, and how they move.
    pub obstacles: &'a [Obstacle],
    /// The part of the motion that is tested, from its start, in seconds.
    pub seconds: (f32, f32),
    /// The test stops once an entry's harm exceeds this, in metres: 0 stops at the first entry, infinity finds the most harmful one.
    pub enough: f32,
}

/// A circle on the ground around all columns of a motion.
#[derive(Clone, Copy, Debug)]
struct Around {
    middle: Vec2,
    radius: f32,
}

impl Around {
    fn of(columns: &[Column], widest: f32) -> Self {
        let axes = columns.iter().map(|column| column.axis);
        let low = axes.clone().fold(Vec2::INFINITY, Vec2::min);
        let high = axes.clone().fold(Vec2::NEG_INFINITY, Vec2::max);
        let middle = 0.5 * (low + high);
        let away = axes.map(|axis| axis.distance_squared(middle));
        Self {
            middle,
            // More than the columns need, for rounding.
            radius: away.fold(0.0, f32::max).sqrt() + widest + 1e-3,
        }
    }
}

/// Where a motion enters an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleHit {
    /// Depth times the obstacle's weight, in metres.
    pub harm: f32,
    /// Time since the start of the motion, in seconds.
    pub time: f32,
    /// The body's sphere that enters deepest.
    pub sphere: usize,
}

impl ObstacleHit {
    /// The entry as a clearance below 0.
    pub fn as_clearance(self) -> Clearance {
        Clearance {
            metres: -self.harm,
            time: self.time,
            body_sphere: self.sphere,
        }
    }
}

impl ObstacleTest<'_> {
    /// Samples per second.
    pub const RATE: f32 = 30.0;

    /// The worst entry; `None` if none is entered. The motion must last until the end.
    pub fn on_motion(&self, motion: &Motion, scratch: &mut ObstacleScratch) -> Option<ObstacleHit> {
        scratch.forget();
        self.on_shared_motion(motion, scratch)
    }

    /// The same for one of several motions in the graph: poses that they have in common are computed once.
    pub(in crate::query) fn on_shared_motion(
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
        // The sample at which the axis is nearest is tested first: where one is entered, this one is usually.
        let nearest = scratch
            .near
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.metres.total_cmp(&b.1.metres))
            .map(|(at, _)| at)?;
        let tick = scratch.near[nearest].tick;
        self.sample(motion, (nearest, tick), (scratch, &mut worst));
        while at < scratch.near.len() && worst.is_none_or(|worst| worst.harm <= self.enough) {
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
            posed,
            extents,
            columns,
            ..
        } = scratch;
        let seconds = self.seconds.0 + tick as f32 / Self::RATE;
        let centres = posed.at(self.baked, (motion, seconds));
        let (axis, spheres) = (columns[tick as usize].axis, &self.baked.body().spheres);
        extents.clear();
        extents.extend(
            centres
                .iter()
                .zip(spheres)
                .map(|(centre, part)| Vec2::new(centre.x, centre.z).distance(axis) + part.radius),
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

    /// Lists the samples at which an obstacle is within reach, by time. `heights` contain the body at all samples.
    fn find_near(&self, motion: &Motion, scratch: &mut ObstacleScratch) {
        let ObstacleScratch {
            columns,
            gone,
            near,
            ..
        } = scratch;
        let (from, to) = self.seconds;
        let ticks = ((to - from).max(0.0) * Self::RATE).ceil() as usize + 1;
        columns.clear();
        gone.clear();
        near.clear();
        let (mut sum, mut widest, mut heights) = (0.0, 0.0f32, Heights::NONE);
        for tick in 0..ticks {
            let seconds = from + tick as f32 / Self::RATE;
            let column = Column::new(self.baked, (motion, seconds), &mut heights);
            let before = columns.last();
            sum += before.map_or(0.0, |last: &Column| last.axis.distance(column.axis));
            widest = widest.max(column.radius);
            columns.push(column);
            gone.push(sum);
        }
        let around = Around::of(columns, widest);
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let speed = obstacle.velocity.length() / Self::RATE;
            let moved = speed * ticks as f32;
            if obstacle.metres_from_line(around.middle, heights, from) > around.radius + moved {
                continue;
            }
            let mut tick = 0;
            while tick < ticks {
                let seconds = from + tick as f32 / Self::RATE;
                let metres = obstacle.metres_from_line(columns[tick].axis, heights, seconds);
                if metres <= columns[tick].radius {
                    near.push(NearSample {
                        tick: tick as u32,
                        obstacle: index as u32,
                        metres,
                    });
                }
                let (start, free) = (tick, metres - widest);
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
