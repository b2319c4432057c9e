//! A character that is posed elsewhere, joint by joint, written as the crowd's own are.

use glam::Affine3A;

use super::keys::animation_set::AnimationSet;
use super::output::{Output, PoseSlice, SlicePlace};
use crate::anim::JointTransform;
use crate::lod::{LevelId, affine};
use crate::math::F32x16;

/// Buffers of a pose, reused for each character.
#[derive(Clone, Debug, Default)]
pub struct ExternalPose {
    /// All joints of the finest level, in its order, in the space of the world.
    pub joints: Vec<JointTransform>,
    matrices: Vec<Affine3A>,
}

/// Characters that are posed elsewhere, in groups of sixteen that take [`Output::group_len`] each.
#[derive(Clone, Copy, Debug)]
pub struct ExternalGroups {
    /// Layout of the crowd's output.
    pub output: Output,
    /// Start of the first group in the output, in `F32x16`s.
    pub offset: usize,
}

/// Destination of a pose, and the level that it is made to look like.
pub struct ExternalTarget<'a> {
    /// Place of the pose in the output.
    pub slice: PoseSlice,
    /// The whole output.
    pub out: &'a mut [F32x16],
    /// Level plus blend of the appearance.
    pub detail: f32,
}

impl AnimationSet {
    /// The slice of the character at `index`.
    #[must_use]
    pub fn external_slice(&self, groups: ExternalGroups, index: usize) -> PoseSlice {
        let joints = self.joints(LevelId(0));
        let at = SlicePlace {
            level: LevelId(0),
            joints,
            offset: groups.offset + index / F32x16::LANES * groups.output.group_len(joints),
            lane: index % F32x16::LANES,
        };
        PoseSlice::new(groups.output, at)
    }

    /// Makes a pose look like a level, blended towards the next by the fraction of the detail, as
    /// [`Crowd::pose`](super::Crowd::pose) would, and writes it.
    ///
    /// # Panics
    /// If there are fewer joints than the finest level has, or the slice is not within the output.
    pub fn write_external(&self, external: &mut ExternalPose, target: ExternalTarget<'_>) {
        let ExternalTarget { slice, out, detail } = target;
        let ExternalPose { joints, matrices } = external;
        matrices.clear();
        matrices.extend(joints.iter().map(affine));
        // The coarsest step first.
        for (index, step) in self.steps[0].iter().enumerate().rev() {
            let weight = (detail - index as f32).clamp(0.0, 1.0);
            if weight <= 0.0 {
                continue;
            }
            for removed in &step.removed {
                let offset = JointTransform {
                    rotation: removed.turn,
                    translation: removed.place,
                };
                let there = matrices[usize::from(removed.carrier)] * affine(&offset);
                let model = &mut matrices[usize::from(removed.joint)];
                model.matrix3 = model.matrix3 * (1.0 - weight) + there.matrix3 * weight;
                model.translation = model.translation.lerp(there.translation, weight);
            }
        }
        for (joint, matrix) in matrices.iter().enumerate().take(slice.joints) {
            let [x, y, z, at] = [
                matrix.matrix3.x_axis,
                matrix.matrix3.y_axis,
                matrix.matrix3.z_axis,
                matrix.translation,
            ];
            let mut numbers = [0.0; Output::NUMBERS];
            for row in 0..3 {
                numbers[4 * row..][..4].copy_from_slice(&[x[row], y[row], z[row], at[row]]);
            }
            slice.set(out, joint, &numbers);
        }
    }
}
