//! A character that is posed elsewhere, joint by joint, written as the crowd's own are.

use glam::{Affine3A, Quat};

use super::keys::animation_set::AnimationSet;
use super::output::{Form, JointNumber, Output, PoseSlice, SlicePlace};
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
    /// Form and layout of the crowd's output.
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
        match slice.form {
            Form::Matrices => {
                matrices.clear();
                matrices.extend(joints.iter().map(affine));
                self.look(
                    detail,
                    matrices,
                    |model, carrier, WeightedAttachment { offset, weight }| {
                        let there = carrier * affine(&offset);
                        model.matrix3 = model.matrix3 * (1.0 - weight) + there.matrix3 * weight;
                        model.translation = model.translation.lerp(there.translation, weight);
                    },
                );
                for (joint, matrix) in matrices.iter().enumerate().take(slice.joints) {
                    let [x, y, z, at] = [
                        matrix.matrix3.x_axis,
                        matrix.matrix3.y_axis,
                        matrix.matrix3.z_axis,
                        matrix.translation,
                    ];
                    for row in 0..3 {
                        let numbers = [x[row], y[row], z[row], at[row]];
                        let number = 4 * row;
                        slice.set(out, JointNumber { joint, number }, &numbers);
                    }
                }
            }
            Form::Rotations => {
                self.look(
                    detail,
                    joints,
                    |model, carrier, WeightedAttachment { offset, weight }| {
                        let turn = carrier.rotation * offset.rotation;
                        model.rotation = towards(model.rotation, turn, weight);
                        let place = carrier.point(offset.translation);
                        model.translation = model.translation.lerp(place, weight);
                    },
                );
                for (joint, model) in joints.iter().enumerate().take(slice.joints) {
                    let at = |number| JointNumber { joint, number };
                    slice.set(out, at(0), &model.rotation.to_array());
                    slice.set(out, at(4), &model.translation.to_array());
                }
            }
        }
    }

    /// Applies the steps from the finest level to the one of `detail`, the coarsest step first.
    fn look<T: Copy>(
        &self,
        detail: f32,
        models: &mut [T],
        approach: impl Fn(&mut T, T, WeightedAttachment),
    ) {
        for (index, step) in self.steps[0].iter().enumerate().rev() {
            let weight = (detail - index as f32).clamp(0.0, 1.0);
            if weight > 0.0 {
                for removed in &step.removed {
                    let carrier = models[usize::from(removed.carrier)];
                    let offset = JointTransform {
                        rotation: removed.turn,
                        translation: removed.place,
                    };
                    let attachment = WeightedAttachment { offset, weight };
                    approach(&mut models[usize::from(removed.joint)], carrier, attachment);
                }
            }
        }
    }
}

/// The transform of a removed joint in its carrier's frame, and the weight of that attachment from 0 to 1.
struct WeightedAttachment {
    offset: JointTransform,
    weight: f32,
}

/// Normalised linear interpolation along the shorter arc.
fn towards(from: Quat, to: Quat, weight: f32) -> Quat {
    let to = if from.dot(to) < 0.0 { -to } else { to };
    (from * (1.0 - weight) + to * weight).normalize()
}
