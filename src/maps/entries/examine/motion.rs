//! Evaluates the played motion around a cut: the offsets at the cut, and root, joints, legs and head in the frames after it.

use glam::{Quat, Vec3};

use super::CutTest;
use crate::anim::{Chain, JointId, JointTransform, Pose};
use crate::graph::{Decay, FootDecay, LegPose};
use crate::maps::entries::frames::Frame;

impl CutTest<'_> {
    /// Computes the offsets, except for those of the joints.
    pub(super) fn measure(&mut self) {
        let (left, entered) = (&self.cut.left.frames, &self.cut.entered.frames);
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

    pub(super) fn measure_feet(&mut self) {
        if !self.examiner.offsets.feet.is_empty() {
            return;
        }
        let (left, entered) = (&self.cut.left.frames, &self.cut.entered.frames);
        let back = |leg: LegPose| LegPose {
            at_toe: JointTransform {
                rotation: self.back.rotation() * leg.at_toe.rotation,
                translation: self.back.point(leg.at_toe.translation),
            },
            ..leg
        };
        let step = self.step();
        let feet = (0..self.cut.graph.feet().legs().len()).map(|leg| {
            let from = [1, 2].map(|frame: usize| back(left[frame].feet[leg]));
            let to = [0, 1].map(|frame: usize| entered[frame].feet[leg]);
            FootDecay::new(from, to, step)
        });
        self.examiner.offsets.feet.extend(feet);
    }

    /// Adds root and legs to the pose of a frame.
    pub(super) fn bend_legs(&mut self, frame: usize, pose: &mut Pose) {
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
        let feet = &self.cut.entered.frames[frame - 1].feet;
        let legs = self.cut.graph.feet().legs();
        for ((leg, &foot), decay) in legs.iter().zip(feet).zip(&self.examiner.offsets.feet) {
            decay.moved(foot, weights).bend(leg, skeleton, pose);
        }
    }

    pub(super) fn toes(&self, frame: usize) -> Vec<Vec3> {
        let legs = self.cut.graph.feet().legs();
        let chain = Chain::of(self.skeleton(), &self.examiner.poses[frame]);
        let toe = |joint| chain.global(joint).translation;
        legs.iter().map(|leg| toe(leg.toe_or_foot())).collect()
    }

    /// Position of the root in a frame. Frame 1 is the frame of the cut.
    #[inline]
    pub(super) fn root(&self, frame: usize) -> Vec3 {
        if frame < 2 {
            return self.back.point(self.cut.left.frames[frame].pose.root);
        }
        let root = self.cut.entered.frames[frame - 1].pose.root;
        let weights = self.examiner.weights[frame - 1];
        root + weights.map_or(Vec3::ZERO, |weights| self.examiner.offsets.root.at(weights))
    }

    /// Rotation of a joint in a frame after the cut, before inverse kinematics.
    #[inline]
    pub(super) fn rotation(&mut self, joint: JointId, frame: usize) -> Quat {
        let rotation = self.cut.entered.frames[frame - 1].pose.rotations[joint.index()];
        match self.examiner.weights[frame - 1] {
            Some(weights) => self.decay(joint).rotated(rotation, weights),
            None => rotation,
        }
    }

    #[inline]
    pub(super) fn left_rotation(&self, joint: JointId, frame: usize) -> Quat {
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
        let entered = &self.cut.entered.frames;
        let to = [0, 1].map(|frame: usize| entered[frame].pose.rotations[joint.index()]);
        let decay = Decay::of_rotations(from, to, self.step());
        self.examiner.offsets.joints[joint.index()] = Some(decay);
        decay
    }

    /// Position of a joint in its parent's frame, in a frame after the cut.
    #[inline]
    fn place(&self, joint: JointId, frame: usize) -> Vec3 {
        let pose = &self.cut.entered.frames[frame - 1].pose;
        let (_, place) = pose.local(self.skeleton(), joint);
        let decay = self.examiner.offsets.places.get(joint.index());
        match (self.examiner.weights[frame - 1], decay) {
            (Some(weights), Some(decay)) => place + decay.at(weights),
            _ => place,
        }
    }

    /// Position of the head in a frame.
    pub(super) fn head(&mut self, frame: usize) -> Vec3 {
        if frame < 2 {
            return self.back.point(self.cut.left.frames[frame].head);
        }
        if self.examiner.weights[frame - 1].is_none() {
            return self.cut.entered.frames[frame - 1].head;
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
