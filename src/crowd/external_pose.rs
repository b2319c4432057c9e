//! A character that is posed elsewhere, joint by joint, written as the crowd's own are.

use glam::{Affine3A, Quat};

use super::animation_set::AnimationSet;
use super::output::{Form, Output, PoseSlice};
use crate::anim::JointTransform;
use crate::lod::LevelId;
use crate::lod::affine;
use crate::math::F32x16;

/// Buffers of a pose, reused for each character.
#[derive(Clone, Debug, Default)]
pub struct ExternalPose {
    /// All joints of the finest level, in its order, in the space of the world.
    pub joints: Vec<JointTransform>,
    matrices: Vec<Affine3A>,
}

impl AnimationSet {
    /// The slice of character `index` of those that [`AnimationSet::write`] writes from line `offset` on, in groups of
    /// sixteen that take [`Output::group_len`] each.
    #[must_use]
    pub fn pose_slice(&self, output: Output, (offset, index): (usize, usize)) -> PoseSlice {
        let joints = self.joints(LevelId(0));
        let offset = offset + index / F32x16::LANES * output.group_len(joints);
        let at = (offset, index % F32x16::LANES);
        PoseSlice::new(output, (LevelId(0), joints), at)
    }

    /// Makes a pose look like a level, blended towards the next by the fraction of `detail`, as
    /// [`Crowd::pose`](super::Crowd::pose) would, and writes it.
    ///
    /// # Panics
    /// If there are fewer joints than the finest level has, or the slice is not within `out`.
    pub fn write(
        &self,
        external: &mut ExternalPose,
        detail: f32,
        (slice, out): (&PoseSlice, &mut [F32x16]),
    ) {
        let ExternalPose { joints, matrices } = external;
        match slice.form {
            Form::Matrices => {
                matrices.clear();
                matrices.extend(joints.iter().map(affine));
                self.look(detail, matrices, |model, carrier, (ride, weight)| {
                    let there = carrier * affine(&ride);
                    model.matrix3 = model.matrix3 * (1.0 - weight) + there.matrix3 * weight;
                    model.translation = model.translation.lerp(there.translation, weight);
                });
                for (joint, matrix) in matrices.iter().enumerate().take(slice.joints) {
                    let [x, y, z, at] = [
                        matrix.matrix3.x_axis,
                        matrix.matrix3.y_axis,
                        matrix.matrix3.z_axis,
                        matrix.translation,
                    ];
                    for row in 0..3 {
                        let numbers = [x[row], y[row], z[row], at[row]];
                        slice.set(out, (joint, 4 * row), &numbers);
                    }
                }
            }
            Form::Rotations => {
                self.look(detail, joints, |model, carrier, (ride, weight)| {
                    let turn = carrier.rotation * ride.rotation;
                    model.rotation = towards(model.rotation, turn, weight);
                    let place = carrier.point(ride.translation);
                    model.translation = model.translation.lerp(place, weight);
                });
                for (joint, model) in joints.iter().enumerate().take(slice.joints) {
                    slice.set(out, (joint, 0), &model.rotation.to_array());
                    slice.set(out, (joint, 4), &model.translation.to_array());
                }
            }
        }
    }

    /// Takes the steps from the finest level, the coarsest first.
    fn look<T: Copy>(
        &self,
        detail: f32,
        models: &mut [T],
        approach: impl Fn(&mut T, T, (JointTransform, f32)),
    ) {
        for (index, step) in self.steps[0].iter().enumerate().rev() {
            let weight = (detail - index as f32).clamp(0.0, 1.0);
            if weight > 0.0 {
                for ride in &step.removed {
                    let carrier = models[usize::from(ride.carrier)];
                    let seat = JointTransform {
                        rotation: ride.turn,
                        translation: ride.place,
                    };
                    approach(
                        &mut models[usize::from(ride.joint)],
                        carrier,
                        (seat, weight),
                    );
                }
            }
        }
    }
}

/// Along the shorter arc.
fn towards(from: Quat, to: Quat, weight: f32) -> Quat {
    let to = if from.dot(to) < 0.0 { -to } else { to };
    (from * (1.0 - weight) + to * weight).normalize()
}
