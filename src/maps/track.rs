//! The body's spheres during and after an evasion.
//!
//! The motion from an evasion's start on is the same in every query: the evasion itself, then the
//! default continuation. It is sampled once, when a graph is baked or loaded.

use glam::Vec3;

use super::bounding_spheres::{BoundingSpheres, SphereRows};
use super::{Body, BodyRows};
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{EdgeId, Motion, MotionGraph, Playhead};
use crate::math::{Rigid2, Sphere};

/// Centres of the body's spheres, sampled [`BodyTrack::RATE`] times per second, in the character's
/// frame at the start (root on the ground, facing +Z). Time 0 is the first sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyTrack {
    spheres: usize,
    ticks: usize,
    /// Coordinates, `[tick][x, y, z][sphere]`, with rows padded to whole vectors.
    rows: Vec<f32>,
    /// Bounding spheres of each interval.
    bounds: BoundingSpheres,
}

/// Description of a [`BodyTrack`]: its start and its duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackDesc {
    /// Edge that is played at the start.
    pub edge: EdgeId,
    /// Time since the edge's start, in frames.
    pub frame: f32,
    /// Character's frame at the start of the track, in the space of the edge's clip.
    pub placement: Rigid2,
    /// Minimum duration of the track, in seconds.
    pub seconds: f32,
}

impl BodyTrack {
    /// Sample rate, per second. Between two samples a rotating limb deviates little from the
    /// straight line: at 15 rad/s and 0.7 m from its joint, by 0.7 (1 - cos(15 / 240)) m = 1.4 mm.
    /// At 240 samples per second it would be 0.34 mm.
    pub const RATE: f32 = 120.0;

    /// Number of samples in an interval for which bounding spheres are stored.
    pub const INTERVAL: usize = 4;

    /// Row lengths are multiples of this number. Padding repeats the last sphere.
    pub const LANES: usize = BodyRows::ROW_LANES;

    /// Samples the body on an edge and its default continuation.
    #[must_use]
    pub fn along(graph: &MotionGraph, body: &Body, desc: TrackDesc) -> Self {
        let ticks = (desc.seconds * Self::RATE).ceil() as usize + 1;
        let playhead = Playhead {
            edge: desc.edge,
            frame: desc.frame,
            clip_to_world: desc.placement.inverse(),
        };
        let mut motion = Motion::new(graph, playhead, &[]);
        motion.extend(graph, ticks as f32 / Self::RATE);
        let mut track = Self {
            spheres: body.spheres.len(),
            ticks,
            rows: Vec::with_capacity(ticks * 3 * Self::padded(body.spheres.len())),
            bounds: BoundingSpheres::default(),
        };
        let body_rows = BodyRows::new(body);
        let mut bounds = Vec::with_capacity(ticks);
        let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
        for tick in 0..ticks {
            motion.sample(graph, tick as f32 / Self::RATE, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            body_rows.push(&joints, &mut track.rows);
            body.centres(&joints, &mut centres);
            let spheres = body.spheres.iter().zip(&centres);
            let spheres = spheres.map(|(sphere, &centre)| Sphere::new(centre, sphere.radius));
            bounds.push(Sphere::around(&spheres.collect::<Vec<_>>()));
        }
        let firsts = (0..ticks).step_by(Self::INTERVAL);
        let stretches = firsts.map(|first| first..=(first + Self::INTERVAL).min(ticks - 1));
        let stretches: Vec<_> = stretches.collect();
        let whole: Vec<_> = stretches
            .iter()
            .map(|s| Sphere::around(&bounds[s.clone()]))
            .collect();
        let part = |stretch: usize, spheres: std::ops::Range<usize>| {
            let samples = stretches[stretch].clone();
            let of = |sphere: usize| {
                let (track, radius) = (&track, body.spheres[sphere].radius);
                let samples = samples.clone();
                samples.map(move |tick| Sphere::new(track.centre(tick, sphere), radius))
            };
            Sphere::around(&spheres.flat_map(of).collect::<Vec<_>>())
        };
        track.bounds = BoundingSpheres::new(body.spheres.len(), &whole, part);
        track
    }

    /// A track of given centres, without bounding spheres: for tests.
    #[cfg(test)]
    pub(super) fn of_centres(ticks: &[&[Vec3]]) -> Self {
        let spheres = ticks.first().map_or(0, |centres| centres.len());
        let mut rows = Vec::new();
        for centres in ticks {
            for axis in 0..3 {
                let first = rows.len();
                rows.extend(centres.iter().map(|centre| centre[axis]));
                rows.resize(first + Self::padded(spheres), 0.0);
            }
        }
        Self {
            spheres,
            ticks: ticks.len(),
            rows,
            bounds: BoundingSpheres::default(),
        }
    }

    /// Memory of a sample, in bytes.
    pub(super) fn tick_bytes(body: &Body) -> usize {
        12 * Self::padded(body.spheres.len())
            + 64
            + BoundingSpheres::stretch_bytes(body.spheres.len()) / Self::INTERVAL
    }

    fn padded(spheres: usize) -> usize {
        spheres.next_multiple_of(Self::LANES)
    }

    /// Sphere that contains the whole body during an interval: from sample [`BodyTrack::INTERVAL`]
    /// `index` to the first sample of the next interval, along straight lines between samples.
    #[must_use]
    pub fn bounding_sphere(&self, index: usize) -> Sphere {
        self.bounds.body(index)
    }

    /// Bounding spheres of 16 consecutive intervals. The last interval is repeated past the end.
    pub(crate) fn bounds(&self, first: usize) -> SphereRows {
        self.bounds.rows(first)
    }

    /// Spheres that contain the body's parts, [`PART`](super::PART) spheres each, during an
    /// interval. Indices past the end return the last interval.
    pub(crate) fn part_bounds(&self, index: usize) -> &[SphereRows] {
        self.bounds.parts(index)
    }

    /// Length of a row of one tick and axis, with padding.
    #[must_use]
    pub fn row(&self) -> usize {
        Self::padded(self.spheres)
    }

    /// Number of samples.
    #[must_use]
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// Time from the first sample to the last, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.ticks().saturating_sub(1) as f32 / Self::RATE
    }

    /// Rows of x, y and z of all spheres at one sample, padded.
    #[must_use]
    pub fn axes(&self, tick: usize) -> [&[f32]; 3] {
        let row = self.row();
        let axis = |axis: usize| &self.rows[(3 * tick + axis) * row..(3 * tick + axis + 1) * row];
        [axis(0), axis(1), axis(2)]
    }

    /// Centre of a sphere at one sample.
    #[must_use]
    pub fn centre(&self, tick: usize, sphere: usize) -> Vec3 {
        let [x, y, z] = self.axes(tick);
        Vec3::new(x[sphere], y[sphere], z[sphere])
    }
}
