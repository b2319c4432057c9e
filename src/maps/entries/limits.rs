//! Limits of plausible motion, measured in the clips.
//!
//! The limits are percentiles over all frames of the clips: angular velocity and acceleration of each joint, departure of hips and head
//! from constant velocity, and speed of the toes. A motion within all limits is called plausible.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use crate::anim::{JointId, JointTransform, Pose, Skeleton, forward_kinematics};
use crate::graph::{Motion, MotionGraph};

/// Percentiles and bounds that define plausible motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlausibilitySettings {
    /// Percentile of each joint's angular velocity and acceleration, and of the toes' speed. Default 99.9.
    pub joints: f32,
    /// Percentile of the departure of hips and head from constant velocity. Default 99. For the hips of fighting clips this is 0.13 m in
    /// 0.2 s and 0.22 m in 0.3 s.
    pub departure: f32,
    /// Maximum slide during the blend, in metres, if a foot is planted at its start: at each moment that of the slower toe. Default 0.02.
    pub slide: f32,
    /// Maximum speed of a toe, in metres per second. Default 3.5: moments between those of the bake exceed it by up to a quarter.
    pub toe_speed: f32,
}

impl Default for PlausibilitySettings {
    fn default() -> Self {
        Self {
            joints: 99.9,
            departure: 99.0,
            slide: 0.02,
            toe_speed: 3.5,
        }
    }
}

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

/// The first limit that an entry exceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Implausible {
    /// Angular velocity of a joint.
    JointSpeed(JointId),
    /// Angular acceleration of a joint.
    JointAcceleration(JointId),
    /// Departure of the hips.
    Hips,
    /// Departure of the head.
    Head,
    /// Speed of a toe.
    Toe,
    /// Slide of the planted feet.
    Slide,
}

/// The part of a pose that the limits depend on.
#[derive(Clone, Debug, Default)]
struct Sample {
    rotations: Vec<Quat>,
    hip: Vec3,
    head: Vec3,
    toes: Vec<Vec3>,
}

impl Sample {
    fn take(
        &mut self,
        graph: &MotionGraph,
        head: JointId,
        (pose, joints): (&Pose, &[JointTransform]),
    ) {
        self.rotations.clone_from(&pose.rotations);
        self.hip = pose.root;
        self.head = joints[head.index()].translation;
        let legs = graph.feet().legs();
        self.toes.clear();
        self.toes.extend(
            legs.iter()
                .map(|leg| joints[leg.toe_or_foot().index()].translation),
        );
    }
}

/// Rotation vector of each joint between two samples, in radians.
fn turns<'a>(from: &'a Sample, to: &'a Sample) -> impl Iterator<Item = Vec3> + 'a {
    let both = from.rotations.iter().zip(&to.rotations);
    both.map(|(from, to)| {
        let turn = *to * from.conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        turn.to_scaled_axis()
    })
}

/// Distance of a point from where its velocity between `before` and `now` would have taken it.
fn departure([before, now, then]: [Vec3; 3], frames: usize) -> Vec3 {
    then - (now + (now - before) * frames as f32)
}

/// The head: the joint of the trunk with the longest chain to the root.
pub(super) fn head(skeleton: &Skeleton) -> JointId {
    let trunk = skeleton.ids().filter(|&id| skeleton.mirror(id).is_none());
    let length = |&id: &JointId| skeleton.chain_length(id);
    trunk
        .max_by(|a, b| length(a).total_cmp(&length(b)))
        .unwrap_or(JointId::ROOT)
}

impl MotionLimits {
    /// Measures the limits in all clips of a graph.
    #[must_use]
    pub(crate) fn learn(graph: &MotionGraph, settings: &PlausibilitySettings) -> Self {
        let (rate, joints) = (graph.frame_rate() as f32, graph.skeleton().len());
        let head = head(graph.skeleton());
        let mut speeds = vec![Vec::new(); joints];
        let mut accelerations = vec![Vec::new(); joints];
        let (mut hips, mut heads) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        let mut toes = Vec::new();
        for clip in graph.clips() {
            let (mut pose, mut globals) = (Pose::default(), Vec::new());
            let mut samples = vec![Sample::default(); clip.frames()];
            for (frame, sample) in samples.iter_mut().enumerate() {
                clip.pose(frame, &mut pose);
                forward_kinematics(graph.skeleton(), &pose, &mut globals);
                sample.take(graph, head, (&pose, &globals));
            }
            let mut before: Vec<Vec3> = Vec::new();
            for pair in samples.windows(2) {
                let now: Vec<Vec3> = turns(&pair[0], &pair[1]).collect();
                for (joint, turn) in now.iter().enumerate() {
                    speeds[joint].push(turn.length() * rate);
                    if let Some(before) = before.get(joint) {
                        accelerations[joint].push((*turn - *before).length() * rate * rate);
                    }
                }
                before = now;
                let ways = pair[0].toes.iter().zip(&pair[1].toes);
                toes.extend(ways.map(|(from, to)| from.distance(*to) * rate));
            }
            for (which, seconds) in DEPARTURES.into_iter().enumerate() {
                let frames = (seconds * rate).round() as usize;
                for window in samples.windows(frames + 2) {
                    let ends = [&window[0], &window[1], &window[frames + 1]];
                    hips[which].push(departure(ends.map(|s| s.hip), frames).with_y(0.0).length());
                    heads[which].push(departure(ends.map(|s| s.head), frames).length());
                }
            }
        }
        let of_joints = |all: Vec<Vec<f32>>| {
            all.into_iter()
                .map(|values| percentile(values, settings.joints))
                .collect()
        };
        Self {
            joint_speed: of_joints(speeds),
            joint_acceleration: of_joints(accelerations),
            hip_departure: hips.map(|values| percentile(values, settings.departure)),
            head_departure: heads.map(|values| percentile(values, settings.departure)),
            toe_speed: percentile(toes, settings.joints).min(settings.toe_speed),
            slide: settings.slide,
        }
    }

    /// Whether the limits fit a skeleton. It checks limits that come from a file.
    #[must_use]
    pub(crate) fn is_sound(&self, skeleton: &Skeleton) -> bool {
        let numbers = self.joint_speed.iter().chain(&self.joint_acceleration);
        let ends = self.hip_departure.iter().chain(&self.head_departure);
        let others = [self.toe_speed, self.slide];
        [&self.joint_speed, &self.joint_acceleration]
            .iter()
            .all(|list| list.len() == skeleton.len())
            && { numbers.chain(ends).chain(&others) }.all(|&number| number >= 0.0)
    }
}

/// Percentile of the values, 0 if there are none.
fn percentile(mut values: Vec<f32>, percent: f32) -> f32 {
    values.sort_by(f32::total_cmp);
    let last = values.len().saturating_sub(1) as f32;
    let at = (last * percent / 100.0).round() as usize;
    values.get(at).copied().unwrap_or(0.0)
}

/// Scratch of the test of motions.
#[derive(Clone, Debug, Default)]
pub(super) struct Examiner {
    pose: Pose,
    joints: Vec<JointTransform>,
    samples: Vec<Sample>,
}

impl Examiner {
    /// Makes room for the samples of a test; returns the frames after which the departures end.
    fn reserve(&mut self, rate: f32, blend: usize) -> [usize; 2] {
        let after = DEPARTURES.map(|seconds| (seconds * rate).round() as usize);
        let count = (blend + 3).max(after[1] + 2);
        self.samples
            .resize_with(count.max(self.samples.len()), Sample::default);
        after
    }

    /// Samples a frame of a motion. `head` is [`head_of`] the graph, which is not looked for in each frame.
    fn take(&mut self, (graph, head): (&MotionGraph, JointId), motion: &Motion, frame: usize) {
        let seconds = frame as f32 / graph.frame_rate() as f32;
        motion.sample(graph, seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
        let posed = (&self.pose, &self.joints[..]);
        self.samples[frame].take(graph, head, posed);
    }

    /// Whether a motion that is entered at its second frame and blends for so many frames is plausible. `standing` are the
    /// legs whose feet stand then.
    pub(super) fn examine(
        &mut self,
        graph: &MotionGraph,
        limits: &MotionLimits,
        (motion, blend, standing): (&Motion, usize, &[bool]),
    ) -> Result<(), Implausible> {
        let rate = graph.frame_rate() as f32;
        let (head, after) = (head_of(graph), self.reserve(rate, blend));
        // The ends of the departures first: most entries fail there.
        let mut taken = [false; 64];
        let mut take = |examiner: &mut Self, frame: usize| {
            if frame >= taken.len() || std::mem::replace(&mut taken[frame], true) {
                return;
            }
            examiner.take((graph, head), motion, frame);
        };
        for (which, frames) in after.into_iter().enumerate() {
            let ends = [0, 1, 1 + frames];
            ends.into_iter().for_each(|frame| take(self, frame));
            let ends = ends.map(|frame| &self.samples[frame]);
            let hip = departure(ends.map(|s| s.hip), frames).with_y(0.0).length();
            if hip > limits.hip_departure[which] {
                return Err(Implausible::Hips);
            }
            if departure(ends.map(|s| s.head), frames).length() > limits.head_departure[which] {
                return Err(Implausible::Head);
            }
        }
        (0..blend + 3).for_each(|frame| take(self, frame));
        let samples = &self.samples[..blend + 3];
        self::joints(samples, limits, rate)?;
        feet(&samples[1..blend + 2], limits, (rate, standing))
    }

    /// Whether a motion whose upper body changes at its second frame, for so many frames, is plausible: its joints, and the departure of its
    /// head.
    pub(super) fn examine_upper(
        &mut self,
        graph: &MotionGraph,
        limits: &MotionLimits,
        (motion, blend): (&Motion, usize),
    ) -> Result<(), Implausible> {
        let rate = graph.frame_rate() as f32;
        let (head, after) = (head_of(graph), self.reserve(rate, blend));
        [0, 1]
            .into_iter()
            .for_each(|frame| self.take((graph, head), motion, frame));
        for (which, frames) in after.into_iter().enumerate() {
            self.take((graph, head), motion, 1 + frames);
            let ends = [0, 1, 1 + frames].map(|frame| self.samples[frame].head);
            if departure(ends, frames).length() > limits.head_departure[which] {
                return Err(Implausible::Head);
            }
        }
        (2..blend + 3).for_each(|frame| self.take((graph, head), motion, frame));
        joints(&self.samples[..blend + 3], limits, rate)
    }
}

fn head_of(graph: &MotionGraph) -> JointId {
    head(graph.skeleton())
}

fn joints(samples: &[Sample], limits: &MotionLimits, rate: f32) -> Result<(), Implausible> {
    for window in samples.windows(3) {
        let both = turns(&window[0], &window[1]).zip(turns(&window[1], &window[2]));
        for (joint, (before, now)) in both.enumerate() {
            let id = JointId(joint as u16);
            if now.length() * rate > limits.joint_speed[joint] {
                return Err(Implausible::JointSpeed(id));
            }
            if (now - before).length() * rate * rate > limits.joint_acceleration[joint] {
                return Err(Implausible::JointAcceleration(id));
            }
        }
    }
    Ok(())
}

/// Whether one foot stays at a time, if one stands at first, and no toe darts.
fn feet(
    samples: &[Sample],
    limits: &MotionLimits,
    (rate, standing): (f32, &[bool]),
) -> Result<(), Implausible> {
    let mut slide = 0.0;
    for pair in samples.windows(2) {
        let ways = || pair[0].toes.iter().zip(&pair[1].toes);
        if ways().any(|(from, to)| from.distance(*to) * rate > limits.toe_speed) {
            return Err(Implausible::Toe);
        }
        let over_ground = ways().map(|(from, to)| (*to - *from).with_y(0.0).length());
        slide += over_ground.fold(f32::INFINITY, f32::min);
    }
    match standing.contains(&true) && slide > limits.slide {
        true => Err(Implausible::Slide),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_sorted_values() {
        let values: Vec<f32> = (0..=1000).rev().map(|value| value as f32).collect();
        assert_eq!(percentile(values.clone(), 99.9), 999.0);
        assert_eq!(percentile(values, 50.0), 500.0);
        assert_eq!(percentile(Vec::new(), 99.0), 0.0);
    }

    #[test]
    fn what_goes_straight_on_departs_from_nothing() {
        let at = |t: f32| Vec3::new(0.1, 0.0, -0.2) * t;
        assert!(departure([at(0.0), at(1.0), at(7.0)], 6).length() < 1e-6);
    }
}
