use glam::{Mat3, Mat4, Quat, Vec2, Vec3};

use crate::anim::JointTransform;

/// A change from sabaki's space, in metres, +Y up, right-handed, to that of a host, which puts its axes elsewhere, is left-handed or has another
/// unit. [`Space::inverse`] leads back.
///
/// ```
/// use glam::Vec3;
/// use sabaki_motion::math::Space;
///
/// // The head of a character that faces +Z, and a ball that comes from its left.
/// assert_eq!(Space::UNREAL.point(Vec3::new(0.0, 1.6, 2.0)), Vec3::new(200.0, 0.0, 160.0));
/// let ball = Space::UNREAL.inverse().point(Vec3::new(0.0, -300.0, 120.0));
/// assert!(ball.abs_diff_eq(Vec3::new(3.0, 1.2, 0.0), 1e-5));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    axes: Mat3,
    /// Units of the target in one of the source.
    unit: f32,
    /// Index of the axis that points up, in the source and in the target.
    up: [usize; 2],
}

impl Space {
    /// sabaki's own: metres, +Y up, right-handed. Godot's and glTF's, too.
    pub const Y_UP: Self = Self::with([Vec3::X, Vec3::Y, Vec3::Z], 1.0, 1);
    /// Metres, +Z up, right-handed; a heading of 0 faces +Y. Blender's.
    pub const Z_UP: Self = Self::with([Vec3::NEG_X, Vec3::Z, Vec3::Y], 1.0, 2);
    /// Metres, +Y up, left-handed; a heading of 0 faces +Z.
    pub const UNITY: Self = Self::with([Vec3::NEG_X, Vec3::Y, Vec3::Z], 1.0, 1);
    /// Centimetres, +Z up, left-handed; a heading of 0 faces +X.
    pub const UNREAL: Self = Self::with([Vec3::NEG_Y, Vec3::Z, Vec3::X], 100.0, 2);

    const fn with(axes: [Vec3; 3], unit: f32, up: usize) -> Self {
        let [x, y, z] = axes;
        Self {
            axes: Mat3::from_cols(x, y, z),
            unit,
            up: [1, up],
        }
    }

    /// The same axes with another unit: as many of them as there are in a metre.
    #[must_use]
    pub fn with_unit(self, in_a_metre: f32) -> Self {
        Self {
            unit: in_a_metre,
            ..self
        }
    }

    /// The way back, from the host's space to sabaki's.
    #[must_use]
    pub fn inverse(self) -> Self {
        let [from, to] = self.up;
        Self {
            axes: self.axes.transpose(),
            unit: 1.0 / self.unit,
            up: [to, from],
        }
    }

    /// A length, a speed or an acceleration.
    pub fn length(self, length: f32) -> f32 {
        length * self.unit
    }

    /// A direction, without a change of its length.
    pub fn direction(self, direction: Vec3) -> Vec3 {
        self.axes * direction
    }

    /// A position, a way or a velocity.
    pub fn point(self, point: Vec3) -> Vec3 {
        self.axes * point * self.unit
    }

    /// Sizes along the three axes.
    pub fn sizes(self, sizes: Vec3) -> Vec3 {
        self.axes.abs() * sizes * self.unit
    }

    /// A position or a velocity on the ground: the two coordinates that do not point up, in their order.
    pub fn ground(self, point: Vec2) -> Vec2 {
        let [from, to] = self.up;
        let whole = match from {
            1 => Vec3::new(point.x, 0.0, point.y),
            _ => point.extend(0.0),
        };
        let whole = self.point(whole);
        match to {
            1 => Vec2::new(whole.x, whole.z),
            _ => whole.truncate(),
        }
    }

    /// An angle about the axis that points up. In left-handed spaces it grows clockwise as seen from above.
    pub fn heading(self, heading: f32) -> f32 {
        heading * self.axes.determinant()
    }

    /// A rotation: of a joint relative to its parent, or in the world.
    pub fn rotation(self, rotation: Quat) -> Quat {
        let axis = self.axes * rotation.xyz() * self.axes.determinant();
        Quat::from_vec4(axis.extend(rotation.w))
    }

    /// The frame of a joint.
    pub fn joint(self, joint: JointTransform) -> JointTransform {
        JointTransform {
            rotation: self.rotation(joint.rotation),
            translation: self.point(joint.translation),
        }
    }

    /// The change as a matrix. The frame `M` of a joint becomes `matrix * M * matrix.inverse()`.
    pub fn matrix(self) -> Mat4 {
        Mat4::from_mat3(self.axes * self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Space; 4] = [Space::Y_UP, Space::Z_UP, Space::UNITY, Space::UNREAL];

    /// A frame, by three numbers.
    fn frame(seed: f32) -> JointTransform {
        JointTransform {
            rotation: Quat::from_euler(glam::EulerRot::XYZ, seed, 0.7 - seed, 0.4 * seed),
            translation: Vec3::new(seed, 1.0 - seed, 0.3),
        }
    }

    #[test]
    fn what_is_composed_and_then_changed_is_what_is_changed_and_then_composed() {
        for space in ALL {
            for seed in [0.1, 0.9, -2.3] {
                let (a, b) = (frame(seed), frame(1.3 * seed));
                let [c, d] = [a, b].map(|joint| space.joint(joint));
                let rotation = space.rotation(a.rotation * b.rotation);
                assert!(
                    rotation.abs_diff_eq(c.rotation * d.rotation, 1e-5),
                    "{space:?}"
                );
                let point = space.point(a.rotation * b.translation + a.translation);
                let same = c.rotation * d.translation + c.translation;
                assert!((point - same).length() < 1e-3, "{space:?}");
                let matrix = Mat4::from_rotation_translation(a.rotation, a.translation);
                let changed = space.matrix() * matrix * space.matrix().inverse();
                let same = Mat4::from_rotation_translation(c.rotation, c.translation);
                assert!(changed.abs_diff_eq(same, 1e-3), "{space:?}");
                let back = space.inverse().joint(c);
                assert!(back.rotation.abs_diff_eq(a.rotation, 1e-6), "{space:?}");
                assert!((back.translation - a.translation).length() < 1e-6);
            }
        }
    }

    #[test]
    fn a_heading_and_the_ground_are_those_of_points() {
        for space in ALL {
            let (heading, at) = (0.6f32, Vec2::new(1.5, -0.7));
            let whole = space.point(Vec3::new(at.x, 0.0, at.y));
            let up = space.direction(Vec3::Y);
            assert_eq!(whole.dot(up), 0.0);
            let ground = space.ground(at);
            let lifted = match up {
                Vec3::Y => Vec3::new(ground.x, 0.0, ground.y),
                _ => ground.extend(0.0),
            };
            assert_eq!(lifted, whole);
            assert_eq!(space.inverse().ground(ground), at);
            // A heading turns what faces ahead, about the axis that points up, as the host's own rotations do.
            let ahead = space.direction(Vec3::Z);
            let turned = Quat::from_axis_angle(up, space.heading(heading)) * ahead;
            let ours = Quat::from_rotation_y(heading) * Vec3::Z;
            assert!(
                (turned - space.direction(ours)).length() < 1e-6,
                "{space:?}"
            );
        }
    }
}
