//! Compresses a clip.

use glam::DVec3;

use super::quantiser::{SKIN, Truth};
use super::tuning::tuned;
use super::{PackedClip, StoredPacked, write};
use crate::anim::{Clip, ClipDesc, JointKind, JointTransform, Pose, Skeleton, forward_kinematics};

/// Errors that compressing a clip may cause.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CompressionSettings {
    /// Largest distance of a joint from where it was, in metres. Default 0.0001.
    pub joint_error: f32,
    /// Largest distance of an end site, and of the points that stand for the skin (0.1 m from each joint that rotates, along its
    /// axes), from where it was, in metres. Default 0.0003.
    pub end_error: f32,
}

impl Default for CompressionSettings {
    fn default() -> Self {
        Self {
            joint_error: 1e-4,
            end_error: 3e-4,
        }
    }
}

impl PackedClip {
    /// Compresses a sound clip of the skeleton. Returns `None` if the error cannot be held.
    pub(in crate::anim) fn new(
        skeleton: &Skeleton,
        desc: &ClipDesc,
        settings: &CompressionSettings,
    ) -> Option<Self> {
        let truth = Truth::new(skeleton, desc);
        let quantised = tuned(&truth, settings)?;
        let bytes = write::bytes(&truth, &quantised)?;
        let stored = StoredPacked {
            name: desc.name.clone(),
            frame_rate: desc.frame_rate,
            frames: u32::try_from(desc.roots.len()).ok()?,
            joints: u16::try_from(skeleton.len()).ok()?,
            moves_joints: truth.moves_joints,
            errors: [0.0; 2],
            lanes: truth.lanes,
            bytes,
        };
        Self::try_from(stored)
            .ok()
            .filter(|clip| clip.fits(skeleton))
    }

    pub(in crate::anim) fn set_errors(&mut self, errors: [f32; 2]) {
        self.stored.errors = errors;
    }
}

/// Largest distances between two clips' joints, and between their end sites and the points that stand for the skin, in metres.
pub(in crate::anim) fn largest_errors(skeleton: &Skeleton, a: &Clip, b: &Clip) -> [f32; 2] {
    let (mut pose, mut joints) = (Pose::default(), [Vec::new(), Vec::new()]);
    let mut errors = [0.0; 2];
    for frame in 0..a.frames().min(b.frames()) {
        for (clip, joints) in [a, b].into_iter().zip(&mut joints) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, joints);
        }
        let both = joints[0].iter().zip(&joints[1]);
        for (joint, (a, b)) in skeleton.joints().iter().zip(both) {
            let place = (b.translation - a.translation).as_dvec3();
            if joint.kind == JointKind::EndSite {
                errors[1] = place.length().max(errors[1]);
                continue;
            }
            errors[0] = place.length().max(errors[0]);
            let point = |joint: &JointTransform, axis| joint.rotation.as_dquat().normalize() * axis;
            for axis in DVec3::AXES {
                let turned = point(b, axis) - point(a, axis);
                errors[1] = (place + SKIN * turned).length().max(errors[1]);
            }
        }
    }
    errors.map(|error| error as f32)
}
