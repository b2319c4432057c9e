//! The test of motions against the limits of plausible motion.

use glam::{Quat, Vec3};

use super::limits::{DEPARTURES, MotionLimits, head};
use crate::anim::{JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, MotionGraph};

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
pub(super) struct Sample {
    pub(super) rotations: Vec<Quat>,
    pub(super) hip: Vec3,
    pub(super) head: Vec3,
    pub(super) toes: Vec<Vec3>,
}

impl Sample {
    pub(super) fn take(
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
pub(super) fn turns<'a>(from: &'a Sample, to: &'a Sample) -> impl Iterator<Item = Vec3> + 'a {
    let both = from.rotations.iter().zip(&to.rotations);
    both.map(|(from, to)| {
        let turn = *to * from.conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        turn.to_scaled_axis()
    })
}

/// Distance of a point from where its velocity between `before` and `now` would have taken it.
pub(super) fn departure([before, now, then]: [Vec3; 3], frames: usize) -> Vec3 {
    then - (now + (now - before) * frames as f32)
}

/// A motion that is entered at its second frame.
pub(super) struct EnteredMotion<'a> {
    pub(super) motion: &'a Motion,
    /// Duration of the blend, in frames.
    pub(super) blend: usize,
    /// Whether a foot stands when it is entered.
    pub(super) stands: bool,
    /// Whether a toe may be faster than the limit, if it was when the motion was left.
    pub(super) toe_slows: bool,
}

/// Scratch of the test of motions of one graph.
#[derive(Clone, Debug)]
pub(super) struct Examiner {
    head: JointId,
    pose: Pose,
    joints: Vec<JointTransform>,
    samples: Vec<Sample>,
    /// Rotation vectors of the joints between the last two samples that were tested.
    turns: Vec<Vec3>,
}

impl Examiner {
    pub(super) fn new(graph: &MotionGraph) -> Self {
        Self {
            head: head(graph.skeleton()),
            pose: Pose::default(),
            joints: Vec::new(),
            samples: Vec::new(),
            turns: Vec::new(),
        }
    }

    /// Makes room for the samples of a test; returns the frames after which the departures end.
    fn reserve(&mut self, rate: f32, blend: usize) -> [usize; 2] {
        let after = DEPARTURES.map(|seconds| (seconds * rate).round() as usize);
        let count = (blend + 3).max(after[1] + 2);
        self.samples
            .resize_with(count.max(self.samples.len()), Sample::default);
        after
    }

    /// Samples a frame of a motion.
    fn take(&mut self, graph: &MotionGraph, motion: &Motion, frame: usize) {
        let seconds = frame as f32 / graph.frame_rate() as f32;
        motion.sample(graph, seconds, &mut self.pose);
        forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
        let posed = (&self.pose, &self.joints[..]);
        self.samples[frame].take(graph, self.head, posed);
    }

    /// Tests the joints between the last three samples up to a frame. Frames are tested one after the other, from 0 on.
    fn test_joints(
        &mut self,
        frame: usize,
        limits: &MotionLimits,
        rate: f32,
    ) -> Result<(), Implausible> {
        let Some(last) = frame.checked_sub(1) else {
            self.turns.clear();
            return Ok(());
        };
        let now = turns(&self.samples[last], &self.samples[frame]);
        if last == 0 {
            self.turns.extend(now);
            return Ok(());
        }
        for (joint, (before, now)) in self.turns.iter_mut().zip(now).enumerate() {
            let id = JointId(joint as u16);
            if now.length() * rate > limits.joint_speed[joint] {
                return Err(Implausible::JointSpeed(id));
            }
            if (now - *before).length() * rate * rate > limits.joint_acceleration[joint] {
                return Err(Implausible::JointAcceleration(id));
            }
            *before = now;
        }
        Ok(())
    }

    /// Whether a motion that is entered at its second frame is plausible.
    pub(super) fn examine(
        &mut self,
        graph: &MotionGraph,
        limits: &MotionLimits,
        entered: &EnteredMotion<'_>,
    ) -> Result<(), Implausible> {
        let &EnteredMotion { motion, blend, .. } = entered;
        let rate = graph.frame_rate() as f32;
        let after = self.reserve(rate, blend);
        // The ends of the departures first: most entries fail there.
        let mut taken = [false; 64];
        let mut take = |examiner: &mut Self, frame: usize| {
            if frame >= taken.len() || std::mem::replace(&mut taken[frame], true) {
                return;
            }
            examiner.take(graph, motion, frame);
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
        for frame in 0..blend + 3 {
            take(self, frame);
            self.test_joints(frame, limits, rate)?;
        }
        let samples = &self.samples[..blend + 3];
        let speed = |pair: &[Sample]| {
            let ways = pair[0].toes.iter().zip(&pair[1].toes);
            let ways = ways.map(|(from, to)| from.distance(*to));
            ways.fold(0.0, f32::max) * rate
        };
        let own = if entered.toe_slows {
            speed(&samples[..2])
        } else {
            0.0
        };
        let fastest = limits.toe_speed.max(own);
        if samples[1..blend + 2]
            .windows(2)
            .any(|pair| speed(pair) > fastest)
        {
            return Err(Implausible::Toe);
        }
        let slides = entered.stands && slide(&samples[1..blend + 2]) > limits.slide;
        if slides {
            Err(Implausible::Slide)
        } else {
            Ok(())
        }
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
        let after = self.reserve(rate, blend);
        (0..2).for_each(|frame| self.take(graph, motion, frame));
        for (which, frames) in after.into_iter().enumerate() {
            self.take(graph, motion, 1 + frames);
            let ends = [0, 1, 1 + frames].map(|frame| self.samples[frame].head);
            if departure(ends, frames).length() > limits.head_departure[which] {
                return Err(Implausible::Head);
            }
        }
        for frame in 0..blend + 3 {
            if frame >= 2 {
                self.take(graph, motion, frame);
            }
            self.test_joints(frame, limits, rate)?;
        }
        Ok(())
    }
}

/// Slide of the feet over the ground, in metres: at each moment that of the slower toe.
fn slide(samples: &[Sample]) -> f32 {
    let slower = |pair: &[Sample]| {
        let ways = pair[0].toes.iter().zip(&pair[1].toes);
        let over_ground = ways.map(|(from, to)| (*to - *from).with_y(0.0).length());
        over_ground.fold(f32::INFINITY, f32::min)
    };
    samples.windows(2).map(slower).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_straight_on_departs_from_nothing() {
        let at = |t: f32| Vec3::new(0.1, 0.0, -0.2) * t;
        assert!(departure([at(0.0), at(1.0), at(7.0)], 6).length() < 1e-6);
    }
}
