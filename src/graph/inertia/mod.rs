//! Inertialization: a cut from one motion to another, after which the offset between the two fades out.
//!
//! Source: Bollo, "Inertialization: High-Performance Animation Transitions in Gears of War" (GDC 2018): after the cut only the new
//! motion is evaluated. The offset of the old motion at the cut, with its velocity, is added as a quintic that decays to 0. Differs:
//! offsets of rotations are rotation vectors with three quintics each, not an angle about one axis, and their initial acceleration is 0.
//! Feet have offsets in the space of the motion, and the legs follow by inverse kinematics. The offset of a foot is that of its toe, about
//! which it also turns: a foot whose toe is planted at the same place in both motions pivots on it. A foot that has to move takes a step,
//! and no toe is lower than in the lower one of both motions. No knee is bent the wrong way further than in one of both motions: offsets of
//! fast legs would do that.

mod decay;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{EdgeId, MotionGraph, Playhead};
use crate::anim::Pose;
use crate::math::Rigid2;

pub(crate) use decay::{Decay, FootDecay, LegPose, Weights, rotation_vector};

/// Position in the graph at which a motion continues without an edge that leads there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Edge to play.
    pub edge: EdgeId,
    /// Position on the edge, in frames.
    pub frame: f32,
    /// Transform from the space of the clip in which the edge starts to the world.
    pub clip_to_world: Rigid2,
    /// Playback rate of the edge and of the following edges of its clip, up to the end of the next event.
    pub rate: f32,
    /// Duration of the fade-out of the previous motion, in seconds. Above 0.
    pub blend: f32,
}

impl Entry {
    /// The position as a playhead.
    pub(crate) fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: self.frame,
            clip_to_world: self.clip_to_world,
        }
    }
}

/// Decaying offsets after one cut of a motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Inertia {
    /// Time of the cut, in seconds since the motion's start. Negative if the motion is the remainder of another.
    pub(super) start: f32,
    pub(super) seconds: f32,
    root: Decay,
    /// Offset of each joint's rotation.
    joints: Vec<Decay>,
    /// Offset of each joint's translation, if one of the motions has translations.
    places: Vec<Decay>,
    /// Offset of each leg's foot.
    feet: Vec<FootDecay>,
}

/// Scratch: poses of both motions at the cut and a moment later.
#[derive(Clone, Debug, Default)]
pub(super) struct EntryScratch {
    /// Time between the two poses of each motion, in seconds.
    pub(super) step: f32,
    pub(super) from: [Pose; 2],
    pub(super) to: [Pose; 2],
}

/// Maximum distance from a joint to a point that it carries, in metres.
pub(crate) const BESIDE: f32 = 0.1;

/// Maximum translation and rotation of a joint, in metres and radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointReach {
    moved: f32,
    turned: f32,
}

/// Distances by which offsets move points [beside](BESIDE) joints, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BlendReach {
    /// Upper limit for the body, reached if all joints rotate a point in the same direction. A knee that is nearly straight can move further.
    pub(crate) body: f32,
    /// Maximum over the feet, which have offsets of their own.
    pub(crate) feet: f32,
}

impl Inertia {
    /// Distances by which the offsets at `seconds` move the body.
    pub(super) fn reach(
        &self,
        graph: &MotionGraph,
        seconds: f32,
        reaches: &mut Vec<JointReach>,
    ) -> BlendReach {
        let weights = self.weights(seconds);
        let length = |decay: &Decay| decay.at(weights).length();
        reaches.clear();
        let mut body = 0.0;
        let joints = graph.skeleton().joints().iter();
        for (index, (joint, decay)) in joints.zip(&self.joints).enumerate() {
            let (moved, turned) = match joint.parent.map(|parent| reaches[parent.index()]) {
                None => (length(&self.root), 0.0),
                Some(JointReach { moved, turned }) => {
                    (moved + turned.min(2.0) * joint.offset.length(), turned)
                }
            };
            let moved = moved + self.places.get(index).map_or(0.0, length);
            let turned = turned + length(decay);
            body = f32::max(body, moved + turned.min(2.0) * BESIDE);
            reaches.push(JointReach { moved, turned });
        }
        let feet = self.feet.iter().map(|foot| foot.reach(weights));
        BlendReach {
            body,
            feet: feet.fold(0.0, f32::max),
        }
    }

    /// Sets the time of the cut and the duration of the decay, in seconds.
    pub(super) fn set_times(&mut self, start: f32, seconds: f32) {
        (self.start, self.seconds) = (start, seconds);
    }

    /// Computes the offsets from `poses.to` to `poses.from` at the cut.
    pub(super) fn measure(&mut self, graph: &MotionGraph, poses: &mut EntryScratch) {
        let skeleton = graph.skeleton();
        let EntryScratch { from, to, step } = poses;
        let step = *step;
        self.root = Decay::new(from[0].root - to[0].root, from[1].root - to[1].root, step);
        self.joints.clear();
        let rotations =
            |poses: &[Pose; 2], joint: usize| [0, 1].map(|at| poses[at].rotations[joint]);
        self.joints.extend(
            (0..skeleton.len()).map(|joint| {
                Decay::of_rotations(rotations(from, joint), rotations(to, joint), step)
            }),
        );
        self.feet.clear();
        for leg in graph.feet().legs() {
            let foot = |pose: &Pose| LegPose::of(skeleton, pose, leg);
            let (from, to) = (
                [foot(&from[0]), foot(&from[1])],
                [foot(&to[0]), foot(&to[1])],
            );
            self.feet.push(FootDecay::new(from, to, step));
        }
        self.places.clear();
        let moved = |poses: &[Pose; 2]| poses.iter().any(|pose| !pose.translations.is_empty());
        if moved(from) || moved(to) {
            from.iter_mut()
                .chain(to.iter_mut())
                .for_each(|pose| pose.fill_translations(skeleton));
            let apart =
                |at: usize, joint: usize| from[at].translations[joint] - to[at].translations[joint];
            let places =
                (0..skeleton.len()).map(|joint| Decay::new(apart(0, joint), apart(1, joint), step));
            self.places.extend(places);
        }
    }

    /// Transforms the offsets that are in the space of the motion: those of root, root rotation and feet.
    pub(super) fn turn(&mut self, by: Rigid2) {
        self.root.turn(by);
        if let Some(root) = self.joints.first_mut() {
            root.turn(by);
        }
        for foot in &mut self.feet {
            foot.turn(by);
        }
    }

    /// Whether the offsets fit a skeleton. It checks offsets that come from a file.
    pub(super) fn is_sound(&self, joints: usize, legs: usize) -> bool {
        let feet = self.feet.iter().all(FootDecay::is_finite);
        let lists = [&self.joints, &self.places];
        let finite = lists.iter().all(|list| list.iter().all(Decay::is_finite));
        self.start.is_finite()
            && self.seconds > 0.0
            && self.seconds.is_finite()
            && self.root.is_finite()
            && self.joints.len() == joints
            && (self.places.is_empty() || self.places.len() == joints)
            && self.feet.len() == legs
            && feet
            && finite
    }

    /// Whether the offsets are not yet 0 at `seconds` of the motion.
    pub(super) fn lasts(&self, seconds: f32) -> bool {
        seconds - self.start < self.seconds
    }

    /// End of the decay, in seconds since the motion's start.
    pub(super) fn end(&self) -> f32 {
        self.start + self.seconds
    }

    fn weights(&self, seconds: f32) -> Weights {
        Weights::new((seconds - self.start) / self.seconds, self.seconds)
    }

    /// Offset of the root from that of the new motion, in metres.
    pub(super) fn root(&self, seconds: f32) -> Vec3 {
        self.root.at(self.weights(seconds))
    }

    /// Adds the offsets at `seconds` to the pose of the new motion.
    pub(super) fn apply(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        /// Maximum number of legs.
        const MOST: usize = 8;
        let (skeleton, weights) = (graph.skeleton(), self.weights(seconds));
        let legs = graph.feet().legs();
        let mut feet = [LegPose::ORIGIN; MOST];
        for (leg, foot) in legs.iter().zip(&mut feet) {
            *foot = LegPose::of(skeleton, pose, leg);
        }
        pose.root += self.root.at(weights);
        for (rotation, decay) in pose.rotations.iter_mut().zip(&self.joints) {
            *rotation = decay.rotated(*rotation, weights);
        }
        if !self.places.is_empty() {
            pose.fill_translations(skeleton);
            for (place, decay) in pose.translations.iter_mut().zip(&self.places) {
                *place += decay.at(weights);
            }
        }
        for ((leg, decay), foot) in legs.iter().zip(&self.feet).zip(feet) {
            decay.moved(foot, weights).bend(leg, skeleton, pose);
        }
    }
}
