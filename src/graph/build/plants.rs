//! Finds the frames in which a clip's feet are planted.
//!
//! Feet are labelled by speed and height with two thresholds each, as in Ikemoto, Arikan & Forsyth
//! (2006), section 2, who call it the usual labelling. A foot has two points, ankle and toe, and is
//! planted if one of them is: on the heel as it lands, on the ball as it leaves. Ground height is
//! estimated for each clip, because captures are off by centimetres.

use crate::anim::{Clip, Leg, Pose, Skeleton, forward_kinematics};
use crate::graph::motion_graph::{Feet, Plant};
use crate::graph::settings::{FeetSettings, GraphSettings};
use crate::math::in_parallel;
use glam::Vec3;

/// Share of a point's heights in a clip that may be below its ground, to ignore a few frames of
/// noise.
const BELOW_GROUND: f32 = 0.05;

/// Search for the plants of clips.
pub(crate) struct PlantSearch<'a> {
    pub(crate) skeleton: &'a Skeleton,
    pub(crate) legs: &'a [Leg],
    pub(crate) settings: &'a FeetSettings,
}

impl PlantSearch<'_> {
    /// Plants of a clip, by leg.
    pub(crate) fn run(&self, clip: &Clip) -> Vec<Vec<Plant>> {
        let tracks = tracks(self.skeleton, clip, self.legs);
        let grounds: Vec<[f32; 2]> = tracks
            .iter()
            .map(|track| [0, 1].map(|point| ground(&track[point])))
            .collect();
        let lowest = [0, 1].map(|point| {
            let of = grounds.iter().map(|ground| ground[point]);
            of.fold(f32::INFINITY, f32::min)
        });
        let plants = |(leg, (track, ground)): (&Leg, (&[Vec<Vec3>; 2], &[f32; 2]))| {
            let length = leg.length(self.skeleton);
            let limits = Limits::new(self.settings, clip.frame_rate(), length);
            let points = [0, 1].map(|point| {
                // A ground slightly above that of the lower foot is a calibration error. If it is
                // higher, this foot never touches the ground.
                let ground = ground[point].min(lowest[point] + limits.low);
                limits.point_states(&track[point], ground)
            });
            let stands = |frame: usize| points[0][frame].max(points[1][frame]);
            let states: Vec<PointState> = (0..clip.frames()).map(stands).collect();
            limits.plants(&states)
        };
        self.legs
            .iter()
            .zip(tracks.iter().zip(&grounds))
            .map(plants)
            .collect()
    }
}

/// Positions of the ankle and the toe of each leg, frame by frame.
fn tracks(skeleton: &Skeleton, clip: &Clip, legs: &[Leg]) -> Vec<[Vec<Vec3>; 2]> {
    let mut tracks = vec![[Vec::new(), Vec::new()]; legs.len()];
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        forward_kinematics(skeleton, &pose, &mut joints);
        for (leg, track) in legs.iter().zip(&mut tracks) {
            track[0].push(joints[leg.foot.index()].translation);
            track[1].push(joints[leg.toe_or_foot().index()].translation);
        }
    }
    tracks
}

fn ground(track: &[Vec3]) -> f32 {
    let mut heights: Vec<f32> = track.iter().map(|place| place.y).collect();
    heights.sort_by(f32::total_cmp);
    heights[(BELOW_GROUND * (heights.len() - 1) as f32) as usize]
}

/// State of a point in one frame. A foot has the state of its steadier point.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PointState {
    Moving,
    /// The point has the state of the neighbouring frames.
    Unclear,
    Planted,
}

/// The settings in metres and frames.
struct Limits {
    frame_rate: f32,
    still: f32,
    moving: f32,
    low: f32,
    high: f32,
    shortest: u32,
    gap: u32,
}

impl Limits {
    /// Converts the settings for a leg of `length` metres.
    fn new(settings: &FeetSettings, frame_rate: f64, length: f32) -> Self {
        let frames = |seconds: f64| (seconds * frame_rate).round() as u32;
        Self {
            frame_rate: frame_rate as f32,
            still: settings.still_speed * length,
            moving: settings.moving_speed * length,
            low: settings.low * length,
            high: settings.high * length,
            shortest: frames(settings.shortest).max(1),
            gap: frames(settings.gap),
        }
    }

    fn point_states(&self, track: &[Vec3], ground: f32) -> Vec<PointState> {
        let at = |frame: usize| {
            // The difference over both neighbours has half the noise of a one-sided difference and
            // no delay.
            let (before, after) = (frame.saturating_sub(1), (frame + 1).min(track.len() - 1));
            let seconds = (after - before) as f32 / self.frame_rate;
            let speed = if seconds > 0.0 {
                track[before].distance(track[after]) / seconds
            } else {
                0.0
            };
            let height = track[frame].y - ground;
            if speed < self.still && height < self.low {
                PointState::Planted
            } else if speed < self.moving && height < self.high {
                PointState::Unclear
            } else {
                PointState::Moving
            }
        };
        (0..track.len()).map(at).collect()
    }

    /// Finds ranges of frames without a moving state that contain a planted one. Ranges with a
    /// short gap are merged, and short ranges are removed.
    fn plants(&self, states: &[PointState]) -> Vec<Plant> {
        let mut plants: Vec<Plant> = Vec::new();
        let mut first = 0;
        for stretch in
            states.chunk_by(|a, b| (*a == PointState::Moving) == (*b == PointState::Moving))
        {
            let last = first + stretch.len() as u32 - 1;
            if stretch.contains(&PointState::Planted) {
                match plants.last_mut() {
                    Some(before) if first - before.last <= self.gap => before.last = last,
                    _ => plants.push(Plant { first, last }),
                }
            }
            first = last + 1;
        }
        plants.retain(|plant| plant.last - plant.first + 1 >= self.shortest);
        plants
    }
}

impl Feet {
    /// Legs and plants of clips.
    pub(crate) fn new(skeleton: &Skeleton, clips: &[Clip], settings: &GraphSettings) -> Self {
        let legs = Leg::all(skeleton);
        let search = PlantSearch {
            skeleton,
            legs: &legs,
            settings: &settings.feet,
        };
        let plants = in_parallel(settings.threads, clips.len(), |clip| {
            search.run(&clips[clip])
        });
        Self {
            legs,
            plants: plants.into_iter().flatten().collect(),
            ..Self::default()
        }
    }
}
