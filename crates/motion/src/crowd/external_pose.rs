//! A character that is posed elsewhere, joint by joint, written as the crowd's own are.

use glam::Affine3A;

use super::keys::animation_set::AnimationSet;
use super::output::{Output, PoseSlice};
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

impl AnimationSet {
    /// The slice of a character that is posed elsewhere. Such characters are in groups of sixteen that take [`Output::group_len`] each, and the
    /// first group starts at `offset` in the output, in `F32x16`s.
    pub fn external_slice(&self, output: Output, offset: usize, index: usize) -> PoseSlice {
        let joints = self.joints(LevelId(0));
        let group = index / F32x16::LANES;
        let offset = offset + group * output.group_len(joints);
        PoseSlice::new(output, LevelId(0), joints, offset, index % F32x16::LANES)
    }

    /// Makes a pose look like a level, blended towards the next by the fraction of `detail`, as [`Crowd::pose`](super::Crowd::pose) would, and
    /// writes it to a slice of the whole output.
    ///
    /// # Panics
    /// If there are fewer joints than the finest level has, or the slice is not within the output.
    pub fn write_external(
        &self,
        external: &mut ExternalPose,
        detail: f32,
        slice: PoseSlice,
        out: &mut [F32x16],
    ) {
        let ExternalPose { joints, matrices } = external;
        matrices.clear();
        matrices.extend(joints.iter().map(affine));
        // The coarsest step first.
        for (index, step) in self.banks[0].steps.iter().enumerate().rev() {
            let weight = (detail - index as f32).clamp(0.0, 1.0);
            if weight <= 0.0 {
                continue;
            }
            for blend in step {
                blend.apply(weight, matrices);
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
