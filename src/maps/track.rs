//! The body's spheres all through an evasion and beyond.
//!
//! What an evasion's body does from its start on is the same in every query: the evasion itself,
//! then the natural way on. It is sampled once, when a graph is baked or read.

use glam::Vec3;

use super::hulls::{HullRows, Hulls};
use super::{Body, BodyRows};
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{EdgeId, Motion, MotionGraph, Playhead};
use crate::math::Rigid2;

/// Centres of the body's spheres, [`BodyTrack::RATE`] times a second, in the character's frame at
/// the start (root on the ground, facing +Z). The clock starts with the first sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyTrack {
    spheres: usize,
    ticks: usize,
    /// `[tick][x, y, z][sphere]`, rows padded to whole lanes.
    rows: Vec<f32>,
    /// For each stretch what holds the body all through.
    hulls: Hulls,
}

impl BodyTrack {
    /// Samples a second. In between a rotating limb leaves the straight line by little: at 15 rad/s
    /// and 0.7 m from its joint, by 0.7 (1 - cos(15 / 240)) m = 1.4 mm; it would be 0.34 mm at 240
    /// a second.
    pub const RATE: f32 = 120.0;

    /// From one sample of a stretch to the first of the next there are so many.
    pub const STRETCH: usize = 4;

    /// Rows are padded to a multiple of it, with copies of the last sphere.
    pub const LANES: usize = 16;

    /// The body on `edge` and the natural way on, from its start until `seconds` have passed.
    /// `placement` is the character's frame at the edge's start, in the space of its clip.
    #[must_use]
    pub fn along(
        graph: &MotionGraph,
        body: &Body,
        (edge, placement): (EdgeId, Rigid2),
        seconds: f32,
    ) -> Self {
        let ticks = (seconds * Self::RATE).ceil() as usize + 1;
        let start = Playhead {
            edge,
            frame: 0.0,
            clip_to_world: placement.inverse(),
        };
        let mut motion = Motion::new(graph, start, &[]);
        motion.extend(graph, ticks as f32 / Self::RATE);
        let mut track = Self {
            spheres: body.spheres.len(),
            ticks,
            rows: Vec::with_capacity(ticks * 3 * Self::padded(body.spheres.len())),
            hulls: Hulls::default(),
        };
        let body_rows = BodyRows::new(body);
        let mut bounds = Vec::with_capacity(ticks);
        let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
        for tick in 0..ticks {
            motion.sample(graph, tick as f32 / Self::RATE, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            body_rows.push(&joints, &mut track.rows);
            body.centres(&joints, &mut centres);
            bounds.push(bound(body, &centres));
        }
        let firsts = (0..ticks).step_by(Self::STRETCH);
        let stretches = firsts.map(|first| first..=(first + Self::STRETCH).min(ticks - 1));
        let stretches: Vec<_> = stretches.collect();
        let whole: Vec<_> = stretches
            .iter()
            .map(|s| around(&bounds[s.clone()]))
            .collect();
        let part = |stretch: usize, spheres: std::ops::Range<usize>| {
            let samples = stretches[stretch].clone();
            let of = |sphere: usize| {
                let (track, radius) = (&track, body.spheres[sphere].radius);
                let samples = samples.clone();
                samples.map(move |tick| (track.centre(tick, sphere), radius))
            };
            around(&spheres.flat_map(of).collect::<Vec<_>>())
        };
        track.hulls = Hulls::new(body.spheres.len(), &whole, part);
        track
    }

    /// What a sample takes in memory, bytes.
    pub(super) fn tick_bytes(body: &Body) -> usize {
        12 * Self::padded(body.spheres.len())
            + 64
            + Hulls::stretch_bytes(body.spheres.len()) / Self::STRETCH
    }

    fn padded(spheres: usize) -> usize {
        spheres.next_multiple_of(Self::LANES)
    }

    /// A sphere that holds the whole body all through a stretch: from sample [`BodyTrack::STRETCH`]
    /// `index` to the first one of the next stretch, in straight lines between samples.
    #[must_use]
    pub fn hull(&self, index: usize) -> (Vec3, f32) {
        self.hulls.whole(index)
    }

    /// The same of sixteen stretches that follow each other, and after the last one that again.
    pub(crate) fn hulls(&self, first: usize) -> HullRows {
        self.hulls.rows(first)
    }

    /// Spheres that hold the body's parts, [`PART`](super::PART) spheres each, all through a stretch; the last one where there are
    /// no more.
    pub(crate) fn part_hulls(&self, index: usize) -> &[HullRows] {
        self.hulls.parts(index)
    }

    /// Values in a row of one tick and axis.
    #[must_use]
    pub fn row(&self) -> usize {
        Self::padded(self.spheres)
    }

    /// How many samples.
    #[must_use]
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// Seconds from the first sample to the last.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.ticks().saturating_sub(1) as f32 / Self::RATE
    }

    /// The x, y and z of all spheres at one sample, padded.
    #[must_use]
    pub fn axes(&self, tick: usize) -> [&[f32]; 3] {
        let row = self.row();
        let axis = |axis: usize| &self.rows[(3 * tick + axis) * row..(3 * tick + axis + 1) * row];
        [axis(0), axis(1), axis(2)]
    }

    /// One sphere's centre at one sample.
    #[must_use]
    pub fn centre(&self, tick: usize, sphere: usize) -> Vec3 {
        let [x, y, z] = self.axes(tick);
        Vec3::new(x[sphere], y[sphere], z[sphere])
    }
}

/// A sphere around spheres.
fn around(spheres: &[(Vec3, f32)]) -> (Vec3, f32) {
    let low = spheres.iter().map(|s| s.0).fold(Vec3::INFINITY, Vec3::min);
    let high = spheres
        .iter()
        .map(|s| s.0)
        .fold(Vec3::NEG_INFINITY, Vec3::max);
    let middle = (low + high) / 2.0;
    let reach = |(centre, radius): &(Vec3, f32)| centre.distance(middle) + radius;
    (middle, spheres.iter().map(reach).fold(0.0, f32::max))
}

/// The sphere around the middle of the body's box.
fn bound(body: &Body, centres: &[Vec3]) -> (Vec3, f32) {
    let low = centres.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = centres.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let middle = (low + high) / 2.0;
    let radius = body
        .spheres
        .iter()
        .zip(centres)
        .map(|(sphere, centre)| centre.distance(middle) + sphere.radius)
        .fold(0.0, f32::max);
    (middle, radius)
}
