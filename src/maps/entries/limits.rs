//! Limits of plausible motion, measured in the clips.
//!
//! The limits are percentiles over all frames of the clips: angular velocity and acceleration of each joint, departure of hips and head
//! from constant velocity, and speed of the toes. A motion within all limits is called plausible. Fingers, helpers and carried things have no
//! limits.
//!
//! Limits are rounded to steps of 3 to 6%, so that adding or removing a few clips rarely changes them.

use crate::anim::{JointId, JointKind, Pose, Skeleton, details, forward_kinematics};
use crate::graph::push::quantile;
use crate::graph::{MotionGraph, rotation_vector};
use crate::math::in_parallel;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Percentiles and bounds that define plausible motion. Percentiles are rounded to 16 steps between a power of two and the next.
#[derive(Clone, Copy)]
pub(crate) struct Plausibility {
    /// Percentile of each joint's angular velocity and acceleration, and of the toes' speed.
    joints: f32,
    /// Percentile of the departure of hips and head from constant velocity.
    departure: f32,
    /// Maximum slide during the blend, in metres, if a foot is planted at its start. At each moment, the slower toe counts.
    slide: f32,
}

impl Plausibility {
    /// Limits of all cuts. For the hips of fighting clips the departure is 0.13 m in 0.2 s and 0.22 m in 0.3 s.
    pub(crate) const USUAL: Self = Self {
        joints: 99.9,
        departure: 99.0,
        slide: 0.02,
    };

    /// Limits that are the maxima of the clips. They are for moments with few entries within the usual limits, such as those of a fast walk,
    /// and for exits from stretches that have no other exits.
    pub(crate) const UTMOST: Self = Self {
        joints: 100.0,
        departure: 100.0,
        slide: 2.5 * Self::USUAL.slide,
    };
}

/// Maximum speed of a toe, in metres per second. Entries between the moments of the bake exceed it by up to a quarter.
const TOE_SPEED: f32 = 3.5;

/// The limits of one set of clips.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionLimits {
    /// Angular velocity of each joint, in radians per second.
    pub joint_speed: Vec<f32>,
    /// Angular acceleration of each joint, in radians per second squared.
    pub joint_acceleration: Vec<f32>,
    /// Horizontal departure of the hips after each of [`DEPARTURES`], in metres.
    pub hip_departure: [f32; 2],
    /// Departure of the head after each of [`DEPARTURES`], in metres.
    pub head_departure: [f32; 2],
    /// Speed of a toe, in metres per second.
    pub toe_speed: f32,
    /// Slide of the slower toe during the blend, in metres.
    pub slide: f32,
}

/// Times after which departures are measured, in seconds.
pub(crate) const DEPARTURES: [f32; 2] = [0.2, 0.3];

/// The head: the joint of the trunk with the longest chain to the root, without helpers and things that are held.
pub(crate) fn head(skeleton: &Skeleton) -> JointId {
    let details = details(skeleton);
    let is_trunk = |id: &JointId| skeleton.mirror(*id).is_none() && !details[id.index()];
    let trunk = skeleton.ids().filter(is_trunk);
    let length = |&id: &JointId| skeleton.chain_length(id);
    trunk
        .max_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or(JointId::ROOT)
}

/// For each joint, whether it can leave the limits: fingers, helpers and carried things have none, and end sites have no rotation.
pub(crate) fn limited(skeleton: &Skeleton) -> Vec<bool> {
    let details = details(skeleton).into_iter().zip(skeleton.joints());
    details
        .map(|(is_detail, joint)| !is_detail && joint.kind == JointKind::Moving)
        .collect()
}

impl MotionLimits {
    /// Whether the limits fit a skeleton. It checks limits that come from a file.
    pub(crate) fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let lists: [&[f32]; 5] = [
            &self.joint_speed,
            &self.joint_acceleration,
            &self.hip_departure,
            &self.head_departure,
            &[self.toe_speed, self.slide],
        ];
        lists[..2].iter().all(|list| list.len() == skeleton.len())
            && lists.into_iter().flatten().all(|&number| number >= 0.0)
    }
}

/// Whether the departure of a point from constant velocity is within limits after each of [`DEPARTURES`]. The velocity is that between the
/// first two frames.
pub(crate) fn goes_on(limits: [f32; 2], rate: f32, mut point: impl FnMut(usize) -> Vec3) -> bool {
    let mut both = departures(rate).into_iter().zip(limits);
    both.all(|(frames, limit)| {
        let ends = [0, 1, 1 + frames].map(&mut point);
        departure(ends, frames).length() <= limit
    })
}

/// Vector from the position that constant velocity between `before` and `now` predicts after `frames` frames to the position `then`.
pub(crate) fn departure([before, now, then]: [Vec3; 3], frames: usize) -> Vec3 {
    then - (now + (now - before) * frames as f32)
}

/// Numbers of frames after which departures are measured.
pub(crate) fn departures(frame_rate: f32) -> [usize; 2] {
    DEPARTURES.map(|seconds| (seconds * frame_rate).round() as usize)
}

/// Data of a clip's frame that the limits depend on.
#[derive(Clone, Debug, Default)]
struct Sample {
    pose: Pose,
    head: Vec3,
    toes: Vec<Vec3>,
}

/// Rounds a positive number to one of 16 steps between a power of two and the next.
fn rounded(value: f32) -> f32 {
    const LOW: u32 = f32::MANTISSA_DIGITS - 1 - 4;
    let half = 1 << (LOW - 1);
    f32::from_bits((value.to_bits() + half) >> LOW << LOW)
}

/// Measurements of the clips. The limits are percentiles of them.
#[derive(Clone)]
pub(crate) struct MeasuredMotion {
    /// For each joint, whether it has no limits.
    details: Vec<bool>,
    /// Measured values, in this order: speeds of each joint, accelerations of each joint, departures of the hips and of the head after each of
    /// [`DEPARTURES`], and speeds of the toes.
    lists: Vec<Vec<f32>>,
}

impl MeasuredMotion {
    pub(crate) fn new(graph: &MotionGraph, threads: usize) -> Self {
        let clips = graph.clips();
        let nothing = Self::nothing(details(graph.skeleton()));
        let of_clips = in_parallel(threads, clips.len(), |clip| {
            let mut of_clip = nothing.clone();
            of_clip.add_clip(graph, clip);
            of_clip
        });
        let Self { details, lists } = nothing;
        let lists = in_parallel(threads, lists.len(), |list| {
            let parts: Vec<&[f32]> = of_clips
                .iter()
                .map(|of_clip| of_clip.lists[list].as_slice())
                .collect();
            parts.concat()
        });
        Self { details, lists }
    }

    fn nothing(details: Vec<bool>) -> Self {
        let lists = 2 * details.len() + 2 * DEPARTURES.len() + 1;
        Self {
            details,
            lists: vec![Vec::new(); lists],
        }
    }

    fn add_clip(&mut self, graph: &MotionGraph, clip: usize) {
        let (clip, own) = (&graph.clips()[clip], graph.own_frames(clip));
        let rate = graph.frame_rate() as f32;
        let head = head(graph.skeleton());
        let mut joints = Vec::new();
        let mut samples = vec![Sample::default(); own.len()];
        for (frame, sample) in own.zip(&mut samples) {
            clip.pose(frame, &mut sample.pose);
            forward_kinematics(graph.skeleton(), &sample.pose, &mut joints);
            sample.head = joints[head.index()].translation;
            let toes = graph.feet().legs().iter();
            let toes = toes.map(|leg| joints[leg.toe_or_foot().index()].translation);
            sample.toes = toes.collect();
        }
        let (speeds, rest) = self.lists.split_at_mut(self.details.len());
        let (accelerations, rest) = rest.split_at_mut(self.details.len());
        let (hips, rest) = rest.split_at_mut(DEPARTURES.len());
        let (heads, toes) = rest.split_at_mut(DEPARTURES.len());
        let mut before: Vec<Vec3> = Vec::new();
        for pair in samples.windows(2) {
            let now = turns(&pair[0].pose, &pair[1].pose);
            for (joint, turn) in now.iter().enumerate() {
                if self.details[joint] {
                    continue;
                }
                speeds[joint].push(turn.length() * rate);
                if let Some(before) = before.get(joint) {
                    let change = (*turn - *before).length();
                    accelerations[joint].push(change * rate * rate);
                }
            }
            before = now;
            let ways = pair[0].toes.iter().zip(&pair[1].toes);
            toes[0].extend(ways.map(|(from, to)| from.distance(*to) * rate));
        }
        for (which, frames) in departures(rate).into_iter().enumerate() {
            for window in samples.windows(frames + 2) {
                let ends = [&window[0], &window[1], &window[frames + 1]];
                let hip = departure(ends.map(|s| s.pose.root), frames).with_y(0.0);
                hips[which].push(hip.length());
                heads[which].push(departure(ends.map(|s| s.head), frames).length());
            }
        }
    }

    /// The limits at some percentiles; infinity for joints without limits.
    pub(crate) fn limits(&mut self, plausible: Plausibility) -> MotionLimits {
        let joints = self.details.len();
        let departures = 2 * joints..2 * joints + 2 * DEPARTURES.len();
        let lists = self.lists.iter_mut().enumerate();
        let limits = lists.map(|(list, values)| {
            let percent = match departures.contains(&list) {
                true => plausible.departure,
                false => plausible.joints,
            };
            if list < departures.start && self.details[list % joints] {
                return f32::INFINITY;
            }
            rounded(quantile(values, percent / 100.0).unwrap_or(0.0))
        });
        let limits: Vec<f32> = limits.collect();
        let (speeds, accelerations) = limits[..departures.start].split_at(joints);
        let departure = |list: usize| limits[departures.start + list];
        let toe_speed = limits[departures.end];
        MotionLimits {
            joint_speed: speeds.to_vec(),
            joint_acceleration: accelerations.to_vec(),
            hip_departure: [0, 1].map(departure),
            head_departure: [2, 3].map(departure),
            toe_speed: toe_speed.min(TOE_SPEED),
            slide: plausible.slide,
        }
    }
}

// Rotations of joints between two poses.

/// Rotation vector of each joint between two poses, in radians.
pub(crate) fn turns(from: &Pose, to: &Pose) -> Vec<Vec3> {
    let both = from.rotations.iter().zip(&to.rotations);
    both.map(|(from, to)| rotation_vector(*to * from.conjugate()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_rounded_to_the_nearest_step() {
        assert_eq!(rounded(0.0), 0.0);
        assert_eq!(
            [1.0, 1.03, 1.04, 1.99].map(rounded),
            [1.0, 1.0, 1.0625, 2.0]
        );
        for value in (1..5000).map(|value| 0.01 * value as f32) {
            assert!((rounded(value) / value - 1.0).abs() < 0.0313, "{value}");
            assert_eq!(rounded(rounded(value)), rounded(value));
        }
    }
}
