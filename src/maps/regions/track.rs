//! The body's spheres before, during and after an evasion.
//!
//! The motion from an evasion's start on is the same in every query: the evasion itself, then the
//! default continuation. Before it come the frames at which the evasion can be entered early. All
//! is sampled once, when a graph is baked or loaded.

use std::sync::OnceLock;

use glam::Vec3;

use super::body::Body;
use super::body_rows::BodyRows;
use super::events::Evasion;
use crate::anim::{Pose, forward_kinematics};
use crate::graph::{EdgeId, Motion, MotionGraph, Playhead};
use crate::math::Sphere;

/// Centres of the body's spheres, sampled [`BodyTrack::RATE`] times per second, in the character's
/// frame at time 0 (root on the ground, facing +Z). An evasion's track has its lead-in before
/// time 0, which is the evasion's start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyTrack {
    spheres: usize,
    ticks: usize,
    /// Number of samples before time 0.
    lead_in: usize,
    /// Coordinates, `[tick][x, y, z][sphere]`, with rows padded to whole vectors.
    rows: Vec<f32>,
    intervals: usize,
    /// Bounding spheres of the whole body in each interval, as rows of x, y, z and radius. The last one is repeated 15 times.
    bounds: [Vec<f32>; 4],
    /// Bounding spheres of the parts, `[interval][part / 16]`. Unused lanes have a radius of −∞.
    part_bounds: Vec<SphereRows>,
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

    /// Samples the body from a playhead on, along its edge and the default continuation, for at least `seconds` seconds. The track's frame is
    /// the world of the playhead.
    #[must_use]
    pub fn along(graph: &MotionGraph, body: &Body, playhead: Playhead, seconds: f32) -> Self {
        Self::with_lead_in(graph, body, (playhead, 0), playhead, seconds)
    }

    /// [`BodyTrack::along`] after a lead-in: another playhead in the same world, so many samples before.
    fn with_lead_in(
        graph: &MotionGraph,
        body: &Body,
        (before, lead_in): (Playhead, usize),
        playhead: Playhead,
        seconds: f32,
    ) -> Self {
        let motion_of = |playhead: Playhead, ticks: usize| {
            let mut motion = Motion::new(graph, playhead, &[]);
            motion.extend(graph, ticks as f32 / Self::RATE);
            motion
        };
        let after = (seconds * Self::RATE).ceil() as usize + 1;
        let motions = [motion_of(before, lead_in), motion_of(playhead, after)];
        let ticks = lead_in + after;
        let mut track = Self {
            spheres: body.spheres.len(),
            ticks,
            lead_in,
            rows: Vec::with_capacity(ticks * 3 * Self::padded(body.spheres.len())),
            ..Self::default()
        };
        let body_rows = BodyRows::new(body);
        let mut bounds = Vec::with_capacity(ticks);
        let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
        for tick in 0..ticks {
            let (motion, tick) = match tick.checked_sub(lead_in) {
                None => (&motions[0], tick),
                Some(after) => (&motions[1], after),
            };
            motion.sample(graph, tick as f32 / Self::RATE, &mut pose);
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            body_rows.push(&joints, &mut track.rows);
            body.centres(&joints, &mut centres);
            let spheres = body.spheres.iter().zip(&centres);
            let spheres = spheres.map(|(sphere, &centre)| Sphere::new(centre, sphere.radius));
            bounds.push(Sphere::around(&spheres.collect::<Vec<_>>()));
        }
        track.add_bounds(body, &bounds);
        track
    }

    /// Adds the bounding spheres of each interval. `bounds` holds that of the whole body at each sample.
    fn add_bounds(&mut self, body: &Body, bounds: &[Sphere]) {
        let spheres = self.spheres;
        for first in (0..self.ticks).step_by(Self::INTERVAL) {
            let samples = first..=(first + Self::INTERVAL).min(self.ticks - 1);
            let whole = Sphere::around(&bounds[samples.clone()]);
            for (row, value) in self.bounds.iter_mut().zip(values(whole)) {
                row.push(value);
            }
            for first in (0..spheres).step_by(PART * LANES) {
                let mut rows = [[0.0; LANES]; 4];
                rows[3] = [f32::NEG_INFINITY; LANES];
                let firsts = (first..spheres).step_by(PART).take(LANES);
                for (lane, first) in firsts.enumerate() {
                    let all = (first..(first + PART).min(spheres)).flat_map(|sphere| {
                        let (track, radius) = (&*self, body.spheres[sphere].radius);
                        let ticks = samples.clone();
                        ticks.map(move |tick| Sphere::new(track.centre(tick, sphere), radius))
                    });
                    let bound = Sphere::around(&all.collect::<Vec<_>>());
                    for (row, value) in rows.iter_mut().zip(values(bound)) {
                        row[lane] = value;
                    }
                }
                self.part_bounds.push(rows);
            }
            self.intervals += 1;
        }
        for row in &mut self.bounds {
            let last = row[self.intervals - 1];
            row.resize(row.len() + LANES - 1, last);
        }
    }

    /// Memory of a sample, in bytes.
    pub(in crate::maps) fn tick_bytes(body: &Body) -> usize {
        let spheres = body.spheres.len();
        let parts = spheres.div_ceil(PART * LANES) * size_of::<SphereRows>();
        12 * Self::padded(spheres) + 64 + (size_of::<Sphere>() + parts) / Self::INTERVAL
    }

    fn padded(spheres: usize) -> usize {
        spheres.next_multiple_of(Self::LANES)
    }

    /// Sphere that contains the whole body during an interval: from sample [`BodyTrack::INTERVAL`]
    /// `index` to the first sample of the next interval, along straight lines between samples.
    pub fn bounding_sphere(&self, index: usize) -> Sphere {
        let [x, y, z, radius] = [0, 1, 2, 3].map(|row| self.bounds[row][index]);
        Sphere::new(Vec3::new(x, y, z), radius)
    }

    /// Bounding spheres of 16 consecutive intervals. The last interval is repeated past the end.
    pub(crate) fn bounds(&self, first: usize) -> SphereRows {
        let first = first.min(self.intervals.saturating_sub(1));
        let mut rows = [[0.0; LANES]; 4];
        for (row, values) in rows.iter_mut().zip(&self.bounds) {
            row.copy_from_slice(&values[first..first + LANES]);
        }
        rows
    }

    /// Spheres that contain the body's parts, [`PART`] spheres each, during an
    /// interval, 16 to an entry. Indices past the end return the last interval.
    pub(crate) fn part_bounds(&self, index: usize) -> &[SphereRows] {
        let each = self.part_bounds.len() / self.intervals.max(1);
        let index = index.min(self.intervals.saturating_sub(1));
        &self.part_bounds[index * each..(index + 1) * each]
    }

    /// Length of a row of one tick and axis, with padding.
    pub fn row(&self) -> usize {
        Self::padded(self.spheres)
    }

    /// Number of samples.
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// Time of the last sample, in seconds.
    pub fn seconds(&self) -> f32 {
        self.ticks.saturating_sub(1 + self.lead_in) as f32 / Self::RATE
    }

    /// Time from the first sample to time 0, in seconds.
    pub fn lead_in(&self) -> f32 {
        self.lead_in as f32 / Self::RATE
    }

    /// The sample nearest to a time, within the track.
    pub fn nearest_tick(&self, seconds: f32) -> usize {
        let tick = ((seconds + self.lead_in()) * Self::RATE).round().max(0.0) as usize;
        tick.min(self.ticks.saturating_sub(1))
    }

    /// Rows of x, y and z of all spheres at one sample, padded.
    pub fn axes(&self, tick: usize) -> [&[f32]; 3] {
        let row = self.row();
        let axis = |axis: usize| &self.rows[(3 * tick + axis) * row..(3 * tick + axis + 1) * row];
        [axis(0), axis(1), axis(2)]
    }

    /// Centre of a sphere at one sample.
    pub fn centre(&self, tick: usize, sphere: usize) -> Vec3 {
        let [x, y, z] = self.axes(tick);
        Vec3::new(x[sphere], y[sphere], z[sphere])
    }
}

/// Body tracks of all evasions, each sampled on first use.
#[derive(Clone, Debug, Default)]
pub(in crate::maps) struct EvasionTracks(Vec<EvasionTrack>);

#[derive(Clone, Debug)]
struct EvasionTrack {
    /// Start of the lead-in, in the evasion's frame, and its number of samples.
    lead_in: (Playhead, usize),
    track: OnceLock<BodyTrack>,
}

impl EvasionTracks {
    /// Minimum duration of a track after the evasion's start and after its end, in seconds.
    const SECONDS: (f32, f32) = (1.0, 0.3);

    /// `first` returns the first frame of an evasion's clip at which it can be entered: the edge that plays the frame, its frame on the edge,
    /// and the number of frames until the evasion starts.
    pub(in crate::maps) fn new(
        graph: &MotionGraph,
        evasions: &[Evasion],
        first: impl Fn(usize) -> Option<(EdgeId, u32, u32)>,
    ) -> Self {
        let slot = |(index, evasion): (usize, &Evasion)| {
            let start = evasion.playhead();
            let lead_in = first(index).map(|(edge, edge_frame, frames)| {
                let rate = (graph.frame_rate() / f64::from(BodyTrack::RATE)) as f32;
                let ticks = (frames as f32 / rate) as usize;
                // The first sample is less than a sample after the frame.
                let later = frames as f32 - ticks as f32 * rate;
                let frame = edge_frame as f32 + later;
                (
                    Playhead {
                        edge,
                        frame,
                        ..start
                    },
                    ticks,
                )
            });
            EvasionTrack {
                lead_in: lead_in.unwrap_or((start, 0)),
                track: OnceLock::new(),
            }
        };
        Self(evasions.iter().enumerate().map(slot).collect())
    }

    /// Duration of an evasion's track after its start, in seconds.
    fn seconds(graph: &MotionGraph, evasion: &Evasion) -> f32 {
        (graph.seconds(evasion.edge) + Self::SECONDS.1).max(Self::SECONDS.0)
    }

    /// Estimated memory of an evasion's track with a lead-in of so many seconds, in bytes.
    pub(in crate::maps) fn bytes(
        graph: &MotionGraph,
        body: &Body,
        evasion: &Evasion,
        lead_in: f32,
    ) -> u64 {
        let seconds = lead_in + Self::seconds(graph, evasion);
        let ticks = (seconds * BodyTrack::RATE) as u64 + 2;
        ticks * BodyTrack::tick_bytes(body) as u64
    }

    /// The track of an evasion, by its index.
    pub(in crate::maps) fn get(
        &self,
        graph: &MotionGraph,
        body: &Body,
        evasions: &[Evasion],
        index: usize,
    ) -> &BodyTrack {
        let slot = &self.0[index];
        slot.track.get_or_init(|| {
            let evasion = &evasions[index];
            let seconds = Self::seconds(graph, evasion);
            BodyTrack::with_lead_in(graph, body, slot.lead_in, evasion.playhead(), seconds)
        })
    }
}

/// Number of consecutive spheres of the body in one part.
pub(crate) const PART: usize = 8;

/// Number of bounding spheres that are tested together.
const LANES: usize = 16;

/// X, y, z and radius of 16 spheres.
pub(crate) type SphereRows = [[f32; LANES]; 4];

fn values(sphere: Sphere) -> [f32; 4] {
    let [x, y, z] = sphere.centre.to_array();
    [x, y, z, sphere.radius]
}
