//! The exact test of a motion against obstacles.
//!
//! Not in the paper, whose characters stand in an empty plane. A motion is sampled at [`ObstacleTest::RATE`], and more often while a fast
//! obstacle passes. The body at a sample lies in a vertical [`Column`]: distances are 1-Lipschitz, so an obstacle that is further from the
//! column's axis than the column is wide touches no part of the body. It is skipped until axis and obstacle have moved that far towards each
//! other: most obstacles cost one distance. The body is posed at the samples that are left, and of its spheres those are tested that reach as far
//! from the axis as the obstacle is.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::extent::ObstacleHit;
use super::pose_cache::PoseCache;
use crate::graph::{Motion, MotionMoment};
use crate::maps::{BakedGraph, BodyTrack};
use crate::math::Isa;
use crate::query::obstacle::Obstacle;

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

#[derive(Clone, Debug, Default)]
pub(super) struct ObstacleScratch {
    columns: Vec<Column>,
    /// Distance that the axis has gone until each sample, in metres.
    gone: Vec<f32>,
    near: Vec<NearSample>,
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

impl ObstacleTest<'_> {
    /// Samples per second. An obstacle that moves further between two of them than `ObstacleTest::LONGEST_WAY` has samples between them.
    pub const RATE: f32 = 30.0;

    /// The longest way of an obstacle between two samples, in metres: less than the body and a thin obstacle are wide.
    const LONGEST_WAY: f32 = 0.15;

    /// The worst entry; `None` if none is entered. The motion must last until the end.
    pub(super) fn worst_entry(
        &self,
        motion: &Motion,
        poses: &mut PoseCache,
        scratch: &mut ObstacleScratch,
    ) -> Option<ObstacleHit> {
        poses.start(self.baked, motion);
        self.find_near(motion, poses.additive.moves(), scratch);
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
        let (near, worst, extents) = (&scratch.near, &mut scratch.worst, &mut scratch.extents);
        let NearSample { seconds, axis, .. } = near[at];
        let number = poses.number(self.baked, motion.moment_at(seconds));
        let axes = poses.axes(self.baked, number);
        let spheres = &self.baked.body().spheres;
        extents.measure(self.baked, axes, axis);
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
                for sphere in extents.block_spheres(block, spheres.len()) {
                    let known = harm(worst);
                    if !reaches(extents.all[sphere], known) {
                        continue;
                    }
                    let centre = Vec3::from_array(axes.map(|axis| axis[sphere]));
                    let metres = obstacle.distance(centre, seconds) - spheres[sphere].radius;
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

    /// Lists the samples at which an obstacle is within reach, by time. A layer moves the body by at most `moved` metres.
    fn find_near(&self, motion: &Motion, moved: f32, scratch: &mut ObstacleScratch) {
        let (columns, gone) = (&mut scratch.columns, &mut scratch.gone);
        let near = &mut scratch.near;
        let (from, to) = self.seconds;
        let ticks = ((to - from).max(0.0) * Self::RATE).ceil() as usize + 1;
        columns.clear();
        gone.clear();
        near.clear();
        let (mut sum, mut widest) = (0.0, 0.0f32);
        // Lowest and highest point of the body during the motion.
        let mut heights = [f32::INFINITY, f32::NEG_INFINITY];
        for tick in 0..ticks {
            let seconds = from + tick as f32 / Self::RATE;
            let mut column = Column::new(self.baked, motion.moment_at(seconds), &mut heights);
            column.radius += moved;
            let before = columns.last();
            sum += before.map_or(0.0, |last: &Column| last.axis.distance(column.axis));
            widest = widest.max(column.radius);
            columns.push(column);
            gone.push(sum);
        }
        heights[0] -= moved;
        heights[1] += moved;
        let (middle, around) = circle_around(columns, widest);
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let speed = obstacle.velocity().length() / Self::RATE;
            let moved = speed * ticks as f32;
            if obstacle.metres_from_line(middle, heights, from) > around + moved {
                continue;
            }
            let parts = (speed / Self::LONGEST_WAY).ceil().max(1.0) as usize;
            let mut list = |column: Column, seconds: f32, metres: f32| {
                if metres <= column.radius {
                    near.push(NearSample {
                        seconds,
                        axis: column.axis,
                        obstacle: index as u32,
                        metres,
                    });
                }
            };
            // Position of the last sample, and whether the axis was outside then.
            let mut before = None;
            let mut tick = 0;
            while tick < ticks {
                let seconds = from + tick as f32 / Self::RATE;
                let metres = obstacle.metres_from_line(columns[tick].axis, heights, seconds);
                if parts > 1 && tick > 0 && metres > 0.0 && before != Some((tick - 1, false)) {
                    let pair = [columns[tick - 1], columns[tick]];
                    for part in 1..parts {
                        let share = part as f32 / parts as f32;
                        let seconds = from + ((tick - 1) as f32 + share) / Self::RATE;
                        let column = Column::between(pair, share);
                        let metres = obstacle.metres_from_line(column.axis, heights, seconds);
                        list(column, seconds, metres);
                    }
                }
                before = Some((tick, metres > 0.0));
                list(columns[tick], seconds, metres);
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

/// Middle and radius of a circle on the ground around all columns of a motion, the widest of which has a radius of `widest` metres.
fn circle_around(columns: &[Column], widest: f32) -> (Vec2, f32) {
    let axes = columns.iter().map(|column| column.axis);
    let low = axes.clone().fold(Vec2::INFINITY, Vec2::min);
    let high = axes.clone().fold(Vec2::NEG_INFINITY, Vec2::max);
    let middle = 0.5 * (low + high);
    let away = axes.map(|axis| axis.distance_squared(middle));
    // More than the columns need, for rounding.
    (middle, away.fold(0.0, f32::max).sqrt() + widest + 1e-3)
}

/// The column around the body at one sample of a motion.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// X and z coordinates.
    pub axis: Vec2,
    pub radius: f32,
}

impl Column {
    /// How far a body leaves the interpolated cylinder between two frames of a clip, at most, in metres.
    const SLACK: f32 = 0.03;
    /// How far a body leaves the interpolated cylinder in a transition, at most, in metres.
    const TRANSITION_SLACK: f32 = 0.2;

    /// The column at a moment; `heights` grow by it.
    fn new(baked: &BakedGraph, moment: MotionMoment<'_>, heights: &mut [f32; 2]) -> Self {
        let MotionMoment { motion, seconds } = moment;
        let graph = baked.graph();
        if motion.is_composed(seconds) {
            let (root, reach) = (motion.root(graph, seconds), baked.reach());
            heights[0] = heights[0].min(root.y - reach);
            heights[1] = heights[1].max(root.y + reach);
            return Self {
                axis: Vec2::new(root.x, root.z),
                radius: reach,
            };
        }
        let playhead = motion.playhead(graph, seconds);
        let cylinder = baked.bounding_cylinder(playhead.edge, playhead.frame);
        let cylinder = cylinder.placed(playhead.clip_to_world);
        let edge = graph.edge(playhead.edge);
        let slack = match graph.edge_moment(edge, playhead.frame).target {
            Some(_) => Self::TRANSITION_SLACK,
            None => Self::SLACK,
        };
        heights[0] = heights[0].min(cylinder.low - slack);
        heights[1] = heights[1].max(cylinder.high + slack);
        Self {
            axis: cylinder.axis,
            radius: cylinder.radius + slack,
        }
    }

    /// The column between two samples, at a share of the time between them.
    fn between([before, after]: [Self; 2], share: f32) -> Self {
        let way = before.axis.distance(after.axis);
        Self {
            axis: before.axis.lerp(after.axis, share),
            // The body may leave the interpolated axis by as much.
            radius: before.radius.max(after.radius) + 0.5 * way,
        }
    }
}

/// Number of spheres of a block.
const LANES: usize = BodyTrack::LANES;

/// How far each sphere of a body reaches from an axis, in metres.
#[derive(Clone, Debug, Default)]
struct Extents {
    /// Distance of each sphere's far side from the axis, in metres, padded to whole blocks.
    pub all: Vec<f32>,
    /// The largest of each block.
    pub widest: Vec<f32>,
}

impl Extents {
    /// Measures from a vertical axis. `centres` are rows of the coordinates of the spheres' centres.
    fn measure(&mut self, baked: &BakedGraph, centres: [&[f32]; 3], axis: Vec2) {
        let radii = baked.body_rows().radii();
        self.all.resize(radii.len(), 0.0);
        self.widest.resize(radii.len() / LANES, 0.0);
        let [x, _, z] = centres;
        Isa::best().run(
            #[inline(always)]
            || self.measure_rows([x, z, radii], axis),
        );
    }

    /// The spheres of a block, without the padding.
    fn block_spheres(&self, block: usize, spheres: usize) -> Range<usize> {
        block * LANES..((block + 1) * LANES).min(spheres)
    }

    #[inline(always)]
    fn measure_rows(&mut self, rows: [&[f32]; 3], axis: Vec2) {
        // Rounding of centres and of their distances, in metres, and as a share of the axis's coordinates.
        const ROUNDING: (f32, f32) = (1e-4, 1e-6);
        let slack = ROUNDING.0 + ROUNDING.1 * axis.abs().max_element();
        let [x, z, radii] = rows.map(|row| row.as_chunks::<LANES>().0);
        let all = self.all.as_chunks_mut::<LANES>().0;
        for (block, (extents, widest)) in all.iter_mut().zip(&mut self.widest).enumerate() {
            for lane in 0..LANES {
                let (x, z) = (x[block][lane] - axis.x, z[block][lane] - axis.y);
                extents[lane] = (x * x + z * z).sqrt() + radii[block][lane] + slack;
            }
            *widest = extents.iter().copied().fold(0.0, f32::max);
        }
    }
}
