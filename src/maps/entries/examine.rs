//! The test of cuts from one motion to another against the limits of plausible motion.
//!
//! The played motion is that of [`Motion::enter`](crate::graph::play::motion::Motion::enter): the offset of the motion that is left fades out. Most cuts fail,
//! so the cheapest tests come first. The hips need no joint. A joint outside the legs needs no other joint. The legs need all their ancestors.

mod motion;

use glam::{Quat, Vec3};

use super::frames::{EnteredMotion, LeftMotion};
use super::joint_steps::{JointLimits, JointSteps};
use super::limits::{MotionLimits, departures, goes_on, head};
use crate::anim::{JointId, Pose, Skeleton};
use crate::graph::{Decay, FootDecay, MotionGraph, Weights};
use crate::math::Rigid2;

/// A cut from one motion to another.
#[derive(Clone, Copy)]
pub(super) struct Cut<'a> {
    pub(super) graph: &'a MotionGraph,
    pub(super) limits: &'a MotionLimits,
    pub(super) left: &'a LeftMotion,
    pub(super) entered: &'a EnteredMotion,
    /// Transform from the space of the entered clip to that of the left clip.
    pub(super) align: Rigid2,
    /// Whether a foot stands at the cut.
    pub(super) stands: bool,
    /// Whether the toes may be as fast as before the cut, if that is above the limit.
    pub(super) toe_slows: bool,
}

/// Scratch of the test of cuts in one graph.
#[derive(Clone, Debug)]
pub(super) struct Examiner {
    head: JointId,
    /// Joints that inverse kinematics moves: hip, knee and foot of each leg.
    of_legs: Vec<JointId>,
    /// All other joints.
    others: Vec<JointId>,
    offsets: Offsets,
    /// Weights of the offsets in each frame; `None` if they are 0.
    weights: Vec<Option<Weights>>,
    poses: Vec<Pose>,
    /// Steps and limits of each joint after the first frames.
    started: Vec<Option<(JointSteps, JointLimits)>>,
}

/// Offsets at a cut, in the space of the entered clip. Those of joints are computed on first use.
#[derive(Clone, Debug, Default)]
struct Offsets {
    root: Decay,
    joints: Vec<Option<Decay>>,
    places: Vec<Decay>,
    feet: Vec<FootDecay>,
}

/// The test of one cut.
pub(super) struct CutTest<'a> {
    cut: Cut<'a>,
    examiner: &'a mut Examiner,
    /// Transform from the space of the left clip to that of the entered clip.
    back: Rigid2,
    rate: f32,
}

/// Number of frames whose joints are tested before the head.
const FIRST: usize = 4;

impl Examiner {
    pub(super) fn new(graph: &MotionGraph) -> Self {
        let legs = graph.feet().legs().iter();
        let of_legs: Vec<JointId> = legs.flat_map(|leg| [leg.hip, leg.knee, leg.foot]).collect();
        let skeleton = graph.skeleton();
        Self {
            head: head(skeleton),
            others: skeleton.ids().filter(|id| !of_legs.contains(id)).collect(),
            of_legs,
            offsets: Offsets::default(),
            weights: Vec::new(),
            poses: Vec::new(),
            started: vec![None; skeleton.len()],
        }
    }

    /// Number of frames of the entered motion that the test of a blend of `blend` frames reads.
    pub(super) fn frames(frame_rate: f32, blend: usize) -> usize {
        (blend + 2).max(departures(frame_rate)[1] + 1)
    }

    pub(super) fn cut<'a>(&'a mut self, cut: Cut<'a>) -> CutTest<'a> {
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
    pub(super) fn is_plausible(&mut self, blend: f32) -> bool {
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
            && self.joints_start()
            && self.head_goes_on()
            && self.joints_fit(frames + 3)
            && self.legs_fit(frames + 3)
            && self.toes_fit(frames + 2)
    }

    /// Allocates the poses of `frames` frames.
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

    /// Whether the joints outside the legs are plausible in the first frames, in which the offsets begin to fade out.
    fn joints_start(&mut self) -> bool {
        self.others_fit(|test, joint| {
            let (mut steps, limits) = test.steps(joint);
            let fit = test.joint_fits(joint, 2..FIRST, &mut steps, limits);
            test.examiner.started[joint.index()] = Some((steps, limits));
            fit
        })
    }

    /// Whether the joints outside the legs are plausible in the frames after the first ones, up to `frames`.
    fn joints_fit(&mut self, frames: usize) -> bool {
        self.others_fit(|test, joint| {
            test.examiner.started[joint.index()].is_some_and(|(mut steps, limits)| {
                test.joint_fits(joint, FIRST..frames, &mut steps, limits)
            })
        })
    }

    /// Whether all joints outside the legs pass a test. A joint that fails is tested first the next time, because it often fails again.
    fn others_fit(&mut self, mut fits: impl FnMut(&mut Self, JointId) -> bool) -> bool {
        let mut others = std::mem::take(&mut self.examiner.others);
        let failed = others.iter().position(|&joint| !fits(self, joint));
        if let Some(failed) = failed {
            others[..=failed].rotate_right(1);
        }
        self.examiner.others = others;
        failed.is_none()
    }

    /// Whether a joint is plausible in some frames. Writes its rotations to the poses of these frames.
    fn joint_fits(
        &mut self,
        joint: JointId,
        mut frames: std::ops::Range<usize>,
        steps: &mut JointSteps,
        limits: JointLimits,
    ) -> bool {
        frames.all(|frame| {
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

    /// The step of a joint to the cut, and the limits of the joint.
    fn steps(&self, joint: JointId) -> (JointSteps, JointLimits) {
        let turn = self.cut.left.turns[joint.index()];
        let steps = JointSteps {
            before: self.left_rotation(joint, 1),
            turn: match joint {
                JointId::ROOT => self.back.vector(turn),
                _ => turn,
            },
        };
        (steps, JointLimits::of(self.cut.limits, joint, self.rate))
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
