//! The test of motions against the limits of plausible motion.
//!
//! Most motions fail, so the tests that cost least come first: the hips need no pose, the joints need no positions.

use glam::Vec3;

use super::limits::{DEPARTURES, MotionLimits, head};
use crate::anim::{JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{Motion, MotionGraph};

/// The part of a motion's frame that the limits depend on.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    pub(super) pose: Pose,
    pub(super) head: Vec3,
    pub(super) toes: Vec<Vec3>,
    /// Whether the pose, and the positions, are those of the motion that is tested.
    is_posed: bool,
    is_located: bool,
}

impl Sample {
    /// Finds the positions of head and toes in the pose.
    pub(super) fn locate(
        &mut self,
        graph: &MotionGraph,
        head: JointId,
        joints: &mut Vec<JointTransform>,
    ) {
        forward_kinematics(graph.skeleton(), &self.pose, joints);
        self.head = joints[head.index()].translation;
        let toes = graph.feet().legs().iter();
        self.toes.clear();
        self.toes
            .extend(toes.map(|leg| joints[leg.toe_or_foot().index()].translation));
    }
}

/// Rotation vector of each joint between two samples, in radians.
pub(super) fn turns<'a>(from: &'a Sample, to: &'a Sample) -> impl Iterator<Item = Vec3> + 'a {
    let both = from.pose.rotations.iter().zip(&to.pose.rotations);
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

/// Frames at which departures are measured.
pub(super) fn departures(frame_rate: f32) -> [usize; 2] {
    DEPARTURES.map(|seconds| (seconds * frame_rate).round() as usize)
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
    joints: Vec<JointTransform>,
    samples: Vec<Sample>,
    /// Rotation vectors of the joints between the last two samples that were tested.
    turns: Vec<Vec3>,
}

/// A test of one motion, whose frames `pose` writes.
struct Test<'a, P> {
    graph: &'a MotionGraph,
    limits: &'a MotionLimits,
    examiner: &'a mut Examiner,
    pose: P,
    rate: f32,
    /// Number of frames of which the joints are tested.
    frames: usize,
}

impl Examiner {
    pub(super) fn new(graph: &MotionGraph) -> Self {
        Self {
            head: head(graph.skeleton()),
            joints: Vec::new(),
            samples: Vec::new(),
            turns: Vec::new(),
        }
    }

    /// Number of frames that a test of a motion with a blend of so many frames reads.
    pub(super) fn frames(frame_rate: f32, blend: usize) -> usize {
        (blend + 3).max(departures(frame_rate)[1] + 2)
    }

    fn test<'a, P: FnMut(usize, &mut Pose)>(
        &'a mut self,
        (graph, limits): (&'a MotionGraph, &'a MotionLimits),
        blend: usize,
        pose: P,
    ) -> Test<'a, P> {
        let rate = graph.frame_rate() as f32;
        let count = Self::frames(rate, blend).max(self.samples.len());
        self.samples.resize_with(count, Sample::default);
        for sample in &mut self.samples {
            (sample.is_posed, sample.is_located) = (false, false);
        }
        Test {
            graph,
            limits,
            examiner: self,
            pose,
            rate,
            frames: blend + 3,
        }
    }

    /// Whether a motion that is entered at its second frame is plausible.
    pub(super) fn is_plausible(
        &mut self,
        (graph, limits): (&MotionGraph, &MotionLimits),
        entered: &EnteredMotion<'_>,
    ) -> bool {
        let &EnteredMotion { motion, blend, .. } = entered;
        let rate = graph.frame_rate() as f32;
        let seconds = |frame: usize| frame as f32 / rate;
        let hip_goes_on =
            { departures(rate).into_iter().zip(limits.hip_departure) }.all(|(frames, limit)| {
                let ends = [0, 1, 1 + frames].map(|frame| motion.root(graph, seconds(frame)));
                departure(ends, frames).with_y(0.0).length() <= limit
            });
        if !hip_goes_on {
            return false;
        }
        let pose = |frame, pose: &mut Pose| motion.sample(graph, seconds(frame), pose);
        self.test((graph, limits), blend, pose).is_plausible()
            && self.feet_are_plausible(limits, (entered, rate))
    }

    /// The last part of the test: the feet, of which the frames have positions.
    fn feet_are_plausible(
        &self,
        limits: &MotionLimits,
        (entered, rate): (&EnteredMotion<'_>, f32),
    ) -> bool {
        let samples = &self.samples[..entered.blend + 2];
        let speed = |pair: &[Sample]| {
            let ways = pair[0].toes.iter().zip(&pair[1].toes);
            let ways = ways.map(|(from, to)| from.distance(*to));
            ways.fold(0.0, f32::max) * rate
        };
        let own = match entered.toe_slows {
            true => speed(&samples[..2]),
            false => 0.0,
        };
        let fastest = limits.toe_speed.max(own);
        samples[1..].windows(2).all(|pair| speed(pair) <= fastest)
            && !(entered.stands && slide(&samples[1..]) > limits.slide)
    }

    /// Whether a motion whose upper body changes at its second frame, for so many frames, is plausible: its joints, and the departure of its
    /// head. `pose` writes its frames.
    pub(super) fn is_upper_plausible(
        &mut self,
        source: (&MotionGraph, &MotionLimits),
        blend: usize,
        pose: impl FnMut(usize, &mut Pose),
    ) -> bool {
        let mut test = self.test(source, blend, pose);
        test.start_is_plausible() && test.joints_are_plausible()
    }
}

impl<P: FnMut(usize, &mut Pose)> Test<'_, P> {
    /// Number of frames whose joints are tested before the head.
    const FIRST: usize = 4;

    /// Tests all but the hips and the feet, and finds the positions of each frame.
    fn is_plausible(&mut self) -> bool {
        if !(self.start_is_plausible() && self.joints_are_plausible()) {
            return false;
        }
        (0..self.frames).for_each(|frame| self.locate(frame));
        true
    }

    /// The joints in the first frames, where an offset begins to fade out, then the head.
    fn start_is_plausible(&mut self) -> bool {
        (0..Self::FIRST.min(self.frames)).all(|frame| self.joints_fit(frame)) && self.head_goes_on()
    }

    /// The joints in all other frames.
    fn joints_are_plausible(&mut self) -> bool {
        (Self::FIRST..self.frames).all(|frame| self.joints_fit(frame))
    }

    fn head_goes_on(&mut self) -> bool {
        let limits = self.limits.head_departure;
        { departures(self.rate).into_iter().zip(limits) }.all(|(frames, limit)| {
            let ends = [0, 1, 1 + frames].map(|frame| {
                self.locate(frame);
                self.examiner.samples[frame].head
            });
            departure(ends, frames).length() <= limit
        })
    }

    fn take(&mut self, frame: usize) {
        let sample = &mut self.examiner.samples[frame];
        if !std::mem::replace(&mut sample.is_posed, true) {
            (self.pose)(frame, &mut sample.pose);
        }
    }

    fn locate(&mut self, frame: usize) {
        self.take(frame);
        let Examiner {
            head,
            joints,
            samples,
            ..
        } = &mut *self.examiner;
        let sample = &mut samples[frame];
        if !std::mem::replace(&mut sample.is_located, true) {
            sample.locate(self.graph, *head, joints);
        }
    }

    /// Tests the joints between the last three samples up to a frame. Frames are tested one after the other, from 0 on.
    fn joints_fit(&mut self, frame: usize) -> bool {
        self.take(frame);
        let (limits, rate) = (self.limits, self.rate);
        let Examiner { samples, turns, .. } = &mut *self.examiner;
        let Some(last) = frame.checked_sub(1) else {
            turns.clear();
            return true;
        };
        let now = self::turns(&samples[last], &samples[frame]);
        if last == 0 {
            turns.extend(now);
            return true;
        }
        let limits = limits.joint_speed.iter().zip(&limits.joint_acceleration);
        for ((before, now), (speed, acceleration)) in turns.iter_mut().zip(now).zip(limits) {
            let change = (now - *before).length() * rate * rate;
            if now.length() * rate > *speed || change > *acceleration {
                return false;
            }
            *before = now;
        }
        true
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
