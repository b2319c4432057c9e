//! The body's spheres before, during and after an evasion.
//!
//! The motion from an evasion's start on is the same in every query: the evasion itself, then the
//! default continuation. Before it come the frames at which the evasion can be entered early. All
//! is sampled once, when a graph is baked or loaded.

use std::ops::Range;
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
    /// Bounding spheres of each interval.
    bounds: BoundingSpheres,
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
            bounds: BoundingSpheres::default(),
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
        let firsts = (0..ticks).step_by(Self::INTERVAL);
        let stretch = |first: usize| first..=(first + Self::INTERVAL).min(ticks - 1);
        let stretches: Vec<_> = firsts.map(stretch).collect();
        let whole = stretches.iter().map(|s| Sphere::around(&bounds[s.clone()]));
        let whole: Vec<_> = whole.collect();
        let part = |stretch: usize, spheres: Range<usize>| {
            let all = spheres.flat_map(|sphere| {
                let (track, radius) = (&track, body.spheres[sphere].radius);
                let samples = stretches[stretch].clone();
                samples.map(move |tick| Sphere::new(track.centre(tick, sphere), radius))
            });
            Sphere::around(&all.collect::<Vec<_>>())
        };
        track.bounds = BoundingSpheres::new(body.spheres.len(), &whole, part);
        track
    }

    /// Memory of a sample, in bytes.
    pub(in crate::maps) fn tick_bytes(body: &Body) -> usize {
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

    /// Spheres that contain the body's parts, [`PART`] spheres each, during an
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

    /// Time of the last sample, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.ticks.saturating_sub(1 + self.lead_in) as f32 / Self::RATE
    }

    /// Time from the first sample to time 0, in seconds.
    #[must_use]
    pub fn lead_in(&self) -> f32 {
        self.lead_in as f32 / Self::RATE
    }

    /// The sample nearest to a time, within the track.
    #[must_use]
    pub fn nearest_tick(&self, seconds: f32) -> usize {
        let tick = ((seconds + self.lead_in()) * Self::RATE).round().max(0.0) as usize;
        tick.min(self.ticks.saturating_sub(1))
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

/// The bounding spheres of a track in each interval.
#[derive(Clone, Debug, Default, PartialEq)]
struct BoundingSpheres {
    /// Bounding spheres of the whole body, as rows of x, y, z and radius. The last bounding sphere is repeated 15 times.
    body: [Vec<f32>; 4],
    stretches: usize,
    /// Bounding spheres of the parts, `[stretch][part / 16]`. Unused lanes have a radius of −∞.
    parts: Vec<SphereRows>,
}

impl BoundingSpheres {
    /// Creates the bounding spheres of a body with `spheres` spheres. `body` holds the bounding sphere of the body in
    /// each interval; `part` returns the bounding sphere of a range of spheres in an interval.
    fn new(spheres: usize, body: &[Sphere], part: impl Fn(usize, Range<usize>) -> Sphere) -> Self {
        let mut bounds = Self {
            stretches: body.len(),
            ..Self::default()
        };
        let last = body.last().into_iter().cycle().take(LANES - 1);
        for &bound in body.iter().chain(last) {
            for (row, value) in bounds.body.iter_mut().zip(values(bound)) {
                row.push(value);
            }
        }
        for stretch in 0..body.len() {
            for first in (0..spheres).step_by(PART * LANES) {
                let mut rows = [[0.0; LANES]; 4];
                rows[3] = [f32::NEG_INFINITY; LANES];
                let firsts = (first..spheres).step_by(PART).take(LANES);
                for (lane, first) in firsts.enumerate() {
                    let bound = part(stretch, first..(first + PART).min(spheres));
                    for (row, value) in rows.iter_mut().zip(values(bound)) {
                        row[lane] = value;
                    }
                }
                bounds.parts.push(rows);
            }
        }
        bounds
    }

    /// Memory of one interval, in bytes.
    fn stretch_bytes(spheres: usize) -> usize {
        size_of::<Sphere>() + spheres.div_ceil(PART * LANES) * size_of::<SphereRows>()
    }

    /// Bounding sphere of the whole body in an interval.
    fn body(&self, stretch: usize) -> Sphere {
        let [x, y, z, radius] = [0, 1, 2, 3].map(|row| self.body[row][stretch]);
        Sphere::new(Vec3::new(x, y, z), radius)
    }

    /// Bounding spheres of the whole body in 16 consecutive intervals. The last interval is repeated past the
    /// end.
    fn rows(&self, first: usize) -> SphereRows {
        let first = first.min(self.stretches.saturating_sub(1));
        let mut rows = [[0.0; LANES]; 4];
        for (row, values) in rows.iter_mut().zip(&self.body) {
            row.copy_from_slice(&values[first..first + LANES]);
        }
        rows
    }

    /// Bounding spheres of the body's parts in an interval, 16 to an entry.
    fn parts(&self, stretch: usize) -> &[SphereRows] {
        let each = self.parts.len() / self.stretches.max(1);
        let stretch = stretch.min(self.stretches.saturating_sub(1));
        &self.parts[stretch * each..(stretch + 1) * each]
    }
}

fn values(sphere: Sphere) -> [f32; 4] {
    let [x, y, z] = sphere.centre.to_array();
    [x, y, z, sphere.radius]
}
