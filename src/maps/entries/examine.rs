//! The test of cuts from one motion to another against the limits of plausible motion.
//!
//! The played motion is that of [`Motion::enter`](crate::graph::play::motion::Motion::enter): the offset of the motion that is left fades out. Most cuts fail,
//! so the cheapest tests come first. The hips need no joint. A joint outside the legs needs no other joint. The legs need all their ancestors.

use crate::anim::{Chain, JointId, JointTransform, Pose, Skeleton};
use crate::graph::{Decay, FootDecay, LegPose, MotionGraph, Weights, leg_targets, rotation_vector};
use crate::maps::entries::frames::{Frame, LeftMotion};
use crate::maps::entries::limits::{MotionLimits, departures, goes_on, head, limited};
use crate::math::Rigid2;
use glam::{Quat, Vec3};

/// A cut from one motion to another.
#[derive(Clone, Copy)]
pub(crate) struct Cut<'a> {
    pub(crate) graph: &'a MotionGraph,
    pub(crate) limits: &'a MotionLimits,
    pub(crate) left: &'a LeftMotion,
    /// Frames of the motion that is entered, from the cut on.
    pub(crate) entered: &'a [Frame],
    /// Transform from the space of the entered clip to that of the left clip.
    pub(crate) align: Rigid2,
    /// Whether a foot stands at the cut.
    pub(crate) stands: bool,
    /// Whether the toes may be as fast as before the cut, if that is above the limit.
    pub(crate) toe_slows: bool,
}

/// Scratch of the test of cuts in one graph.
#[derive(Clone, Debug)]
pub(crate) struct Examiner {
    head: JointId,
    /// Joints that inverse kinematics moves: hip, knee and foot of each leg.
    of_legs: Vec<JointId>,
    /// All other joints that can fail, or that move the legs.
    others: Vec<JointId>,
    offsets: Offsets,
    /// Weights of the offsets in each frame; `None` if they are 0.
    weights: Vec<Option<Weights>>,
    poses: Vec<Pose>,
}

/// Offsets at a cut, in the space of the entered clip. Those of joints are computed on first use.
#[derive(Clone, Debug, Default)]
struct Offsets {
    root: Decay,
    joints: Vec<Option<Decay>>,
    places: Vec<Decay>,
    feet: Vec<FootDecay>,
}

pub(crate) struct CutTest<'a> {
    cut: Cut<'a>,
    examiner: &'a mut Examiner,
    /// Transform from the space of the left clip to that of the entered clip.
    back: Rigid2,
    rate: f32,
}

/// Number of frames whose joints are tested before the head: those in which the offsets begin to fade out.
const FIRST: usize = 4;

impl Examiner {
    pub(crate) fn new(graph: &MotionGraph) -> Self {
        let (skeleton, legs) = (graph.skeleton(), graph.feet().legs());
        let of_legs = legs.iter().flat_map(|leg| [leg.hip, leg.knee, leg.foot]);
        let of_legs: Vec<JointId> = of_legs.collect();
        let mut is_needed = limited(skeleton);
        for leg in legs {
            let moving = skeleton.ancestry(leg.toe_or_foot());
            moving.for_each(|id| is_needed[id.index()] = true);
        }
        let is_other = |id: &JointId| is_needed[id.index()] && !of_legs.contains(id);
        Self {
            head: head(skeleton),
            others: skeleton.ids().filter(is_other).collect(),
            of_legs,
            offsets: Offsets::default(),
            weights: Vec::new(),
            poses: Vec::new(),
        }
    }

    /// Number of frames of the entered motion that the test of a blend of `blend` frames reads.
    pub(crate) fn frames(frame_rate: f32, blend: usize) -> usize {
        (blend + 2).max(departures(frame_rate)[1] + 1)
    }

    pub(crate) fn cut<'a>(&'a mut self, cut: Cut<'a>) -> CutTest<'a> {
        let mut test = CutTest {
            cut,
            examiner: self,
            back: cut.align.inverse(),
            rate: cut.graph.frame_rate() as f32,
        };
        test.measure();
        test
    }
}

impl CutTest<'_> {
    fn skeleton(&self) -> &Skeleton {
        self.cut.graph.skeleton()
    }

    /// Time between two frames, in seconds.
    fn step(&self) -> f32 {
        1.0 / self.rate
    }

    /// Whether the cut is plausible with a blend of `blend` seconds.
    pub(crate) fn is_plausible(&mut self, blend: f32) -> bool {
        let step = self.step();
        let seconds = blend.max(step);
        let frames = (blend * self.rate).ceil() as usize;
        let weights = (0..Examiner::frames(self.rate, frames)).map(|frame| {
            let share = frame as f32 * step / seconds;
            (share < 1.0).then(|| Weights::new(share, seconds))
        });
        self.examiner.weights.clear();
        self.examiner.weights.extend(weights);
        self.make_poses(FIRST.max(frames + 3));
        self.hips_go_on()
            && self.joints_fit(FIRST)
            && self.head_goes_on()
            && self.joints_fit(frames + 3)
            && self.legs_fit(frames + 3)
            && self.toes_fit(frames + 2)
    }

    fn make_poses(&mut self, frames: usize) {
        let joints = self.skeleton().len();
        let poses = &mut self.examiner.poses;
        for _ in poses.len()..frames {
            poses.push(Pose {
                rotations: vec![Quat::IDENTITY; joints],
                ..Pose::default()
            });
        }
    }

    fn hips_go_on(&mut self) -> bool {
        let limits = self.cut.limits.hip_departure;
        goes_on(limits, self.rate, |frame| self.root(frame).with_y(0.0))
    }

    fn head_goes_on(&mut self) -> bool {
        let limits = self.cut.limits.head_departure;
        goes_on(limits, self.rate, |frame| self.head(frame))
    }

    /// Whether the joints outside the legs are plausible in the first `frames` frames. A joint that fails is tested first the next time,
    /// because it often fails again.
    fn joints_fit(&mut self, frames: usize) -> bool {
        let mut others = std::mem::take(&mut self.examiner.others);
        let failed = others
            .iter()
            .position(|&joint| !self.joint_fits(joint, frames));
        if let Some(failed) = failed {
            others[..=failed].rotate_right(1);
        }
        self.examiner.others = others;
        failed.is_none()
    }

    /// Whether a joint is plausible in the first `frames` frames. Writes its rotations to the poses of these frames.
    fn joint_fits(&mut self, joint: JointId, frames: usize) -> bool {
        let (mut steps, limits) = self.steps(joint);
        (2..frames).all(|frame| {
            let rotation = self.rotation(joint, frame);
            self.examiner.poses[frame].rotations[joint.index()] = rotation;
            steps.fits(rotation, limits)
        })
    }

    /// Whether the joints of the legs are plausible in all frames. The poses have the rotations of the other joints.
    fn legs_fit(&mut self, frames: usize) -> bool {
        self.measure_feet();
        let mut poses = std::mem::take(&mut self.examiner.poses);
        for (frame, pose) in poses[..frames].iter_mut().enumerate().skip(2) {
            self.bend_legs(frame, pose);
        }
        let fit = (0..self.examiner.of_legs.len()).all(|index| {
            let joint = self.examiner.of_legs[index];
            let (mut steps, limits) = self.steps(joint);
            let rotation = |pose: &Pose| pose.rotations[joint.index()];
            let mut later = poses[2..frames].iter();
            later.all(|pose| steps.fits(rotation(pose), limits))
        });
        self.examiner.poses = poses;
        fit
    }

    fn steps(&self, joint: JointId) -> (JointSteps, JointLimits) {
        let turn = self.cut.left.turns[joint.index()];
        let steps = JointSteps {
            before: self.left_rotation(joint, 1),
            turn: match joint {
                JointId::ROOT => self.back.vector(turn),
                _ => turn,
            },
        };
        (steps, JointLimits::new(self.cut.limits, joint, self.rate))
    }

    /// Whether the toes are plausible in the first `frames` frames, whose poses are complete.
    fn toes_fit(&mut self, frames: usize) -> bool {
        let first = self.cut.left.frames[1].toes();
        let mut before: Vec<Vec3> = first.map(|toe| self.back.point(toe)).collect();
        let own = match self.cut.toe_slows {
            true => self.own_toe_speed(),
            false => 0.0,
        };
        let fastest = self.cut.limits.toe_speed.max(own);
        let mut slide = 0.0;
        for frame in 2..frames {
            let now = self.toes(frame);
            let ways = before.iter().zip(&now).map(|(from, to)| *to - *from);
            let (mut longest, mut slower) = (0.0_f32, f32::INFINITY);
            for way in ways {
                longest = longest.max(way.length());
                slower = slower.min(way.with_y(0.0).length());
            }
            if longest * self.rate > fastest {
                return false;
            }
            slide += slower;
            before = now;
        }
        !self.cut.stands || slide <= self.cut.limits.slide
    }

    /// Speed of the fastest toe before the cut, in metres per second.
    fn own_toe_speed(&self) -> f32 {
        let [before, now, _] = &self.cut.left.frames;
        let ways = before
            .toes()
            .zip(now.toes())
            .map(|(from, to)| from.distance(to));
        ways.fold(0.0, f32::max) * self.rate
    }
}

// Evaluates the played motion around a cut: the offsets at the cut, and root, joints, legs and head in the frames after it.

impl CutTest<'_> {
    /// Computes the offsets, except for those of the joints.
    pub(crate) fn measure(&mut self) {
        let (left, entered) = (&self.cut.left.frames, self.cut.entered);
        let (back, step) = (self.back, self.step());
        let apart = |at: usize| back.point(left[at + 1].pose.root) - entered[at].pose.root;
        let offsets = &mut self.examiner.offsets;
        offsets.root = Decay::new(apart(0), apart(1), step);
        offsets.joints.clear();
        offsets.joints.resize(self.cut.graph.skeleton().len(), None);
        offsets.places.clear();
        offsets.feet.clear();
        let moved = |frame: &Frame| !frame.pose.translations.is_empty();
        if left.iter().any(moved) || entered.iter().any(moved) {
            let places = self.cut.graph.skeleton().ids().map(|id| {
                let place = |frame: &Frame| frame.pose.local(self.cut.graph.skeleton(), id).1;
                let apart = |at: usize| place(&left[at + 1]) - place(&entered[at]);
                Decay::new(apart(0), apart(1), step)
            });
            offsets.places.extend(places);
        }
    }

    pub(crate) fn measure_feet(&mut self) {
        if !self.examiner.offsets.feet.is_empty() {
            return;
        }
        let (left, entered) = (&self.cut.left.frames, self.cut.entered);
        let back = |leg: LegPose| LegPose {
            at_toe: JointTransform {
                rotation: self.back.rotation() * leg.at_toe.rotation,
                translation: self.back.point(leg.at_toe.translation),
            },
            ..leg
        };
        let (step, knees) = (self.step(), self.cut.graph.knees());
        let feet = (0..self.cut.graph.feet().legs().len()).map(|leg| {
            let from = [1, 2].map(|frame: usize| back(left[frame].feet[leg]));
            let to = [0, 1].map(|frame: usize| entered[frame].feet[leg]);
            FootDecay::new(from, to, knees[leg], step)
        });
        self.examiner.offsets.feet.extend(feet);
    }

    /// Adds root and legs to the pose of a frame.
    pub(crate) fn bend_legs(&mut self, frame: usize, pose: &mut Pose) {
        (pose.root, pose.translations) = (self.root(frame), Vec::new());
        for index in 0..self.examiner.of_legs.len() {
            let joint = self.examiner.of_legs[index];
            pose.rotations[joint.index()] = self.rotation(joint, frame);
        }
        let skeleton = self.cut.graph.skeleton();
        if !self.examiner.offsets.places.is_empty() {
            let places = skeleton.ids().map(|id| self.place(id, frame));
            pose.translations.extend(places);
        }
        let Some(weights) = self.examiner.weights[frame - 1] else {
            return;
        };
        let feet = &self.cut.entered[frame - 1].feet;
        let legs = self.cut.graph.feet().legs();
        let targets = leg_targets(&self.examiner.offsets.feet, feet, weights);
        for (leg, target) in legs.iter().zip(targets) {
            target.bend(leg, skeleton, pose);
        }
    }

    pub(crate) fn toes(&self, frame: usize) -> Vec<Vec3> {
        let legs = self.cut.graph.feet().legs();
        let chain = Chain::of(self.skeleton(), &self.examiner.poses[frame]);
        let toe = |joint| chain.global(joint).translation;
        legs.iter().map(|leg| toe(leg.toe_or_foot())).collect()
    }

    /// Position of the root in a frame. Frame 1 is the frame of the cut.
    #[inline]
    pub(crate) fn root(&self, frame: usize) -> Vec3 {
        if frame < 2 {
            return self.back.point(self.cut.left.frames[frame].pose.root);
        }
        let root = self.cut.entered[frame - 1].pose.root;
        let weights = self.examiner.weights[frame - 1];
        root + weights.map_or(Vec3::ZERO, |weights| self.examiner.offsets.root.at(weights))
    }

    /// Rotation of a joint in a frame after the cut, before inverse kinematics.
    #[inline]
    pub(crate) fn rotation(&mut self, joint: JointId, frame: usize) -> Quat {
        let rotation = self.cut.entered[frame - 1].pose.rotations[joint.index()];
        match self.examiner.weights[frame - 1] {
            Some(weights) => self.decay(joint).rotated(rotation, weights),
            None => rotation,
        }
    }

    #[inline]
    pub(crate) fn left_rotation(&self, joint: JointId, frame: usize) -> Quat {
        let rotation = self.cut.left.frames[frame].pose.rotations[joint.index()];
        match joint {
            JointId::ROOT => self.back.rotation() * rotation,
            _ => rotation,
        }
    }

    #[inline]
    fn decay(&mut self, joint: JointId) -> Decay {
        if let Some(decay) = self.examiner.offsets.joints[joint.index()] {
            return decay;
        }
        let from = [1, 2].map(|frame| self.left_rotation(joint, frame));
        let entered = self.cut.entered;
        let to = [0, 1].map(|frame: usize| entered[frame].pose.rotations[joint.index()]);
        let decay = Decay::of_rotations(from, to, self.step());
        self.examiner.offsets.joints[joint.index()] = Some(decay);
        decay
    }

    /// Position of a joint in its parent's frame, in a frame after the cut.
    #[inline]
    fn place(&self, joint: JointId, frame: usize) -> Vec3 {
        let pose = &self.cut.entered[frame - 1].pose;
        let (_, place) = pose.local(self.skeleton(), joint);
        let decay = self.examiner.offsets.places.get(joint.index());
        match (self.examiner.weights[frame - 1], decay) {
            (Some(weights), Some(decay)) => place + decay.at(weights),
            _ => place,
        }
    }

    pub(crate) fn head(&mut self, frame: usize) -> Vec3 {
        if frame < 2 {
            return self.back.point(self.cut.left.frames[frame].head);
        }
        if self.examiner.weights[frame - 1].is_none() {
            return self.cut.entered[frame - 1].head;
        }
        let (mut next, mut point) = (Some(self.examiner.head), Vec3::ZERO);
        while let Some(joint) = next {
            let place = match joint {
                JointId::ROOT => self.root(frame),
                _ => self.place(joint, frame),
            };
            point = self.rotation(joint, frame) * point + place;
            next = self.skeleton().joint(joint).parent;
        }
        point
    }
}

// Compares the rotations of a joint from frame to frame with the limits of its velocity and acceleration.

/// Rotation vector of a rotation. Up to 35° it is computed without an arc tangent, from the first terms of the arc sine series, with an error
/// below 1e-8 of the angle. Rotations between two frames are rarely larger.
fn small_turn(rotation: Quat) -> Vec3 {
    /// Square of the sine of half the largest angle for the series.
    const MOST: f32 = 0.09;
    let vector = rotation.xyz();
    let square = vector.length_squared();
    if square > MOST {
        return rotation_vector(rotation);
    }
    let series = [35.0 / 1152.0, 5.0 / 112.0, 3.0 / 40.0, 1.0 / 6.0, 1.0];
    let share = series
        .into_iter()
        .fold(63.0 / 2816.0, |sum, term| sum * square + term);
    vector * (2.0 * share).copysign(rotation.w)
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct JointLimits {
    /// Square of the largest rotation angle between two frames, in radians.
    step: f32,
    /// Square of the largest change of the rotation vector between two such steps, in radians.
    change: f32,
}

impl JointLimits {
    pub(crate) fn new(limits: &MotionLimits, joint: JointId, rate: f32) -> Self {
        let step = limits.joint_speed[joint.index()] / rate;
        let change = limits.joint_acceleration[joint.index()] / (rate * rate);
        Self {
            step: step * step,
            change: change * change,
        }
    }
}

/// State of the test of a joint, frame by frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointSteps {
    /// Rotation in the last frame.
    pub(crate) before: Quat,
    /// Rotation vector of the last step, in the space of the joint's parent.
    pub(crate) turn: Vec3,
}

impl JointSteps {
    /// Moves on to the next rotation, and returns whether the step is within the limits.
    pub(crate) fn fits(&mut self, rotation: Quat, limits: JointLimits) -> bool {
        let turn = small_turn(rotation * self.before.conjugate());
        let change = turn - self.turn;
        (self.before, self.turn) = (rotation, turn);
        turn.length_squared() <= limits.step && change.length_squared() <= limits.change
    }
}
