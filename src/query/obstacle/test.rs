//! The exact test of a motion against obstacles.
//!
//! Beyond the paper, whose characters stand in an empty plane. A motion is sampled at [`ObstacleTest::RATE`], and more often while a fast
//! obstacle passes. An obstacle that is further from the
//! axis of the body's [`Column`] than that is wide is skipped until axis and obstacle have moved that far towards each other: most
//! obstacles cost one distance. The body is posed at the samples that are left, and of its spheres those are tested that reach as far
//! from the axis as the obstacle is.

use glam::Vec2;

use super::Obstacle;
use super::column::{Column, Heights};
use super::extents::Extents;
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::query::clearance::{Clearance, MotionBody, PoseCache};

/// Scratch of the test.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct ObstacleScratch {
    /// A motion that is built for one test.
    pub motion: Motion,
    columns: Vec<Column>,
    /// Distance that the axis has gone until each sample, in metres.
    gone: Vec<f32>,
    near: Vec<NearSample>,
    /// The worst entry so far.
    worst: Option<ObstacleHit>,
    extents: Extents,
}

/// A sample at which an obstacle touches the body's column.
#[derive(Clone, Copy, Debug)]
struct NearSample {
    /// Time since the start of the motion, in seconds.
    seconds: f32,
    /// The column's axis.
    axis: Vec2,
    obstacle: u32,
    /// Distance of the column's axis from the obstacle, in metres.
    metres: f32,
}

impl NearSample {
    /// Key of the order by time and then by obstacle. Times are not negative, so that their bits are in their order.
    fn order(&self) -> u64 {
        u64::from(self.seconds.to_bits()) << 32 | u64::from(self.obstacle)
    }
}

/// A motion against obstacles.
#[derive(Clone, Copy, Debug)]
pub struct ObstacleTest<'a> {
    /// The graph and the body.
    pub baked: &'a BakedGraph,
    /// Obstacles, at the start of the motion.
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

/// Entry of a motion into an obstacle.
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
    /// Samples per second. An obstacle that moves further between two of them than [`ObstacleTest::LONGEST_WAY`] has samples between them.
    pub const RATE: f32 = 30.0;

    /// The longest way of an obstacle between two samples, in metres: less than the body and a thin obstacle are wide.
    const LONGEST_WAY: f32 = 0.15;

    /// The worst entry; `None` if none is entered. The motion must last until the end. `scratch` is kept from one test to the next.
    pub fn on_motion(&self, motion: &Motion, scratch: &mut MotionBody) -> Option<ObstacleHit> {
        if self.obstacles.is_empty() {
            return None;
        }
        let (poses, scratch) = scratch.for_obstacles()?;
        poses.start_with_joints(self.baked, motion);
        self.find_near(motion, scratch);
        scratch.worst = None;
        let mut at = 0;
        // The sample at which the axis is nearest is tested first: where one is entered, this one is usually.
        let nearest = scratch
            .near
            .iter()
            .enumerate()
            .min_by(|a, b| a.1.metres.total_cmp(&b.1.metres))
            .map(|(at, _)| at)?;
        self.sample(motion, nearest, scratch, poses);
        while at < scratch.near.len() && scratch.worst.is_none_or(|hit| hit.harm <= self.enough) {
            at = self.sample(motion, at, scratch, poses);
        }
        scratch.worst
    }

    /// Poses the sample at position `at` of the list and tests the obstacles that are near then. Returns the position after them.
    fn sample(
        &self,
        motion: &Motion,
        at: usize,
        scratch: &mut ObstacleScratch,
        poses: &mut PoseCache,
    ) -> usize {
        let ObstacleScratch {
            near,
            worst,
            extents,
            ..
        } = scratch;
        let NearSample { seconds, axis, .. } = near[at];
        let number = poses.number(self.baked, motion.moment_at(seconds));
        let joints = poses.joints(self.baked, number);
        let spheres = &self.baked.body().spheres;
        extents.measure(self.baked, poses.axes(self.baked, number), axis);
        let is_same = |one: &&NearSample| (one.seconds, one.axis) == (seconds, axis);
        let same = near[at..].iter().take_while(is_same);
        let mut next = at;
        for one in same {
            next += 1;
            let obstacle = &self.obstacles[one.obstacle as usize];
            let reaches = |extent: f32, known: f32| (extent - one.metres) * obstacle.weight > known;
            for block in 0..extents.widest.len() {
                let harm = |worst: &Option<ObstacleHit>| worst.map_or(0.0, |worst| worst.harm);
                if !reaches(extents.widest[block], harm(worst)) {
                    continue;
                }
                for sphere in extents.of_block(block, spheres.len()) {
                    let known = harm(worst);
                    if !reaches(extents.all[sphere], known) {
                        continue;
                    }
                    let part = &spheres[sphere];
                    let metres = obstacle.distance(part.centre(joints), seconds) - part.radius;
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
            let column = Column::new(self.baked, motion.moment_at(seconds), &mut heights);
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
            let parts = (speed / Self::LONGEST_WAY).ceil().max(1.0) as usize;
            // Position of the last sample, and whether the axis was outside then.
            let mut before = None;
            let mut tick = 0;
            while tick < ticks {
                let seconds = from + tick as f32 / Self::RATE;
                let axis = columns[tick].axis;
                let metres = obstacle.metres_from_line(axis, heights, seconds);
                if parts > 1 && tick > 0 && metres > 0.0 && before != Some((tick - 1, false)) {
                    let pair = [columns[tick - 1], columns[tick]];
                    for part in 1..parts {
                        let share = part as f32 / parts as f32;
                        let seconds = from + ((tick - 1) as f32 + share) / Self::RATE;
                        let column = Column::between(pair, share);
                        let metres = obstacle.metres_from_line(column.axis, heights, seconds);
                        if metres <= column.radius {
                            near.push(NearSample {
                                seconds,
                                axis: column.axis,
                                obstacle: index as u32,
                                metres,
                            });
                        }
                    }
                }
                before = Some((tick, metres > 0.0));
                if metres <= columns[tick].radius {
                    near.push(NearSample {
                        seconds,
                        axis,
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
        near.sort_unstable_by_key(NearSample::order);
    }
}
