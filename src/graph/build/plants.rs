//! Finds the frames in which a clip's feet are planted.
//!
//! Feet are labelled by speed and height with two thresholds each, as in Ikemoto, Arikan & Forsyth
//! (2006), section 2, who call it the usual labelling. A foot has two points, ankle and toe, and is
//! planted if one of them is: on the heel as it lands, on the ball as it leaves. Ground height is
//! estimated for each clip, because captures are off by centimetres.

use crate::anim::{Clip, Leg, Pose, Skeleton, forward_kinematics};
use crate::graph::motion_graph::{Feet, Plant};
use crate::math::in_parallel;
use glam::Vec3;

// Thresholds. Lengths and speeds are in leg lengths (hip to ankle), so that they fit any body and unit. They come from captures of
// fighting and walking at 30 frames per second. In the fighting motions, the slower of a foot's two points moves slower than 0.25 in
// 76% of all frames and slower than 0.55 in 82%. Above that, the speeds of swinging feet spread up to 4 and more. Feet slower than 0.2
// are below 0.04 in 99% of the frames, and below 0.06 in 90% of those of a crouched sneaking motion.

/// Speed below which a point may become planted, and speed above which it is not planted, in leg lengths per second. Between the two
/// it keeps its state.
const SPEEDS: [f32; 2] = [0.25, 0.55];
/// Heights above the clip's ground, with the same meaning, in leg lengths.
const HEIGHTS: [f32; 2] = [0.06, 0.11];
/// Minimum duration of a plant, in seconds.
const SHORTEST: f64 = 0.1;
/// Gap between two plants below which they are merged, in seconds: two frames at 30 frames per second.
const GAP: f64 = 0.07;

/// Share of a point's heights in a clip that may be below its ground, to ignore a few frames of
/// noise.
const BELOW_GROUND: f32 = 0.05;

fn plants(skeleton: &Skeleton, legs: &[Leg], clip: &Clip) -> Vec<Vec<Plant>> {
    let tracks = tracks(skeleton, clip, legs);
    let grounds: Vec<[f32; 2]> = tracks
        .iter()
        .map(|track| [0, 1].map(|point| ground(&track[point])))
        .collect();
    let lowest = [0, 1].map(|point| {
        let of_legs = grounds.iter().map(|ground| ground[point]);
        of_legs.fold(f32::INFINITY, f32::min)
    });
    let plants = |(leg, (track, ground)): (&Leg, (&[Vec<Vec3>; 2], &[f32; 2]))| {
        let length = leg.length(skeleton);
        let points = [0, 1].map(|point| {
            // A ground slightly above that of the lower foot is a calibration error. If it is
            // higher, this foot never touches the ground.
            let ground = ground[point].min(lowest[point] + HEIGHTS[0] * length);
            point_states(&track[point], ground, length, clip.frame_rate() as f32)
        });
        let stands = |frame: usize| points[0][frame].max(points[1][frame]);
        let states: Vec<PointState> = (0..clip.frames()).map(stands).collect();
        plants_of_states(&states, clip.frame_rate())
    };
    legs.iter()
        .zip(tracks.iter().zip(&grounds))
        .map(plants)
        .collect()
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

/// State of a point in each frame, for a leg of `length` metres.
fn point_states(track: &[Vec3], ground: f32, length: f32, frame_rate: f32) -> Vec<PointState> {
    let [still, moving] = SPEEDS.map(|speed| speed * length);
    let [low, high] = HEIGHTS.map(|height| height * length);
    let at = |frame: usize| {
        // The difference over both neighbours has half the noise of a one-sided difference and
        // no delay.
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(track.len() - 1));
        let seconds = (after - before) as f32 / frame_rate;
        let speed = if seconds > 0.0 {
            track[before].distance(track[after]) / seconds
        } else {
            0.0
        };
        let height = track[frame].y - ground;
        if speed < still && height < low {
            PointState::Planted
        } else if speed < moving && height < high {
            PointState::Unclear
        } else {
            PointState::Moving
        }
    };
    (0..track.len()).map(at).collect()
}

/// Finds ranges of frames without a moving state that contain a planted one. Ranges with a short gap are merged, and short ranges are
/// removed.
fn plants_of_states(states: &[PointState], frame_rate: f64) -> Vec<Plant> {
    let frames = |seconds: f64| (seconds * frame_rate).round() as u32;
    let (shortest, gap) = (frames(SHORTEST).max(1), frames(GAP));
    let is_moving = |state: &PointState| *state == PointState::Moving;
    let mut plants: Vec<Plant> = Vec::new();
    let mut first = 0;
    for stretch in states.chunk_by(|a, b| is_moving(a) == is_moving(b)) {
        let last = first + stretch.len() as u32 - 1;
        if stretch.contains(&PointState::Planted) {
            match plants.last_mut() {
                Some(before) if first - before.last <= gap => before.last = last,
                _ => plants.push(Plant { first, last }),
            }
        }
        first = last + 1;
    }
    plants.retain(|plant| plant.last - plant.first + 1 >= shortest);
    plants
}

impl Feet {
    pub(crate) fn new(skeleton: &Skeleton, clips: &[Clip], threads: usize) -> Self {
        let legs = Leg::all(skeleton);
        let plants = in_parallel(threads, clips.len(), |clip| {
            plants(skeleton, &legs, &clips[clip])
        });
        Self {
            legs,
            plants: plants.into_iter().flatten().collect(),
            ..Self::default()
        }
    }
}
