//! A character that is posed elsewhere, joint by joint, written as the crowd's own are.

use glam::{Affine3A, Quat};

use super::character::LevelId;
use super::output::{Form, Output, Region};
use super::repertoire::Repertoire;
use crate::anim::JointTransform;
use crate::lod::affine;
use crate::math::Line;

/// Memory for it, used again and again.
#[derive(Clone, Debug, Default)]
pub struct Single {
    /// All joints of the finest level, in its order, in the space of the world.
    pub joints: Vec<JointTransform>,
    matrices: Vec<Affine3A>,
}

impl Repertoire {
    /// Where the `index`th of several characters is that are written by [`Repertoire::write`], from
    /// `first_line` on, in groups of sixteen that take [`Output::lines`] each.
    #[must_use]
    pub fn region(&self, output: Output, (first_line, index): (usize, usize)) -> Region {
        let joints = self.joints(LevelId(0));
        Region {
            first_line: first_line + index / Line::LANES * output.lines(joints),
            lane: index % Line::LANES,
            level: LevelId(0),
            joints,
            output,
        }
    }

    /// Makes a pose look like a level, on the way to the next by what is behind the point, as
    /// [`Crowd::pose`](super::Crowd::pose) would, and writes it.
    ///
    /// # Panics
    /// Where there are fewer joints than the finest level has, or the region is not within `out`.
    pub fn write(&self, single: &mut Single, detail: f32, (region, out): (&Region, &mut [Line])) {
        let Single { joints, matrices } = single;
        match region.output.form {
            Form::Matrices => {
                matrices.clear();
                matrices.extend(joints.iter().map(affine));
                self.look(detail, matrices, |model, carrier, (ride, weight)| {
                    let there = carrier * affine(&ride);
                    model.matrix3 = model.matrix3 * (1.0 - weight) + there.matrix3 * weight;
                    model.translation = model.translation.lerp(there.translation, weight);
                });
                for (joint, matrix) in matrices.iter().enumerate().take(region.joints) {
                    let [x, y, z, at] = [
                        matrix.matrix3.x_axis,
                        matrix.matrix3.y_axis,
                        matrix.matrix3.z_axis,
                        matrix.translation,
                    ];
                    for row in 0..3 {
                        let numbers = [x[row], y[row], z[row], at[row]];
                        region.set(out, (joint, 4 * row), &numbers);
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
                for (joint, model) in joints.iter().enumerate().take(region.joints) {
                    region.set(out, (joint, 0), &model.rotation.to_array());
                    region.set(out, (joint, 4), &model.translation.to_array());
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
                for ride in &step.rides {
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
