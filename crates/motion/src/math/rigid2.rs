use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A rotation about +Y followed by a translation on the ground: where a character stands and which
/// way it faces.
///
/// A heading of 0 faces +Z, π/2 faces +X. Applying `Rigid2` to a point in the character's frame
/// (root on the ground, facing +Z) gives the point in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rigid2 {
    /// Cosine and sine of the heading; always of unit length.
    cos: f32,
    sin: f32,
    /// Translation on the ground, metres.
    pub x: f32,
    /// Translation on the ground, metres.
    pub z: f32,
}

impl Rigid2 {
    /// Standing at the origin, facing +Z.
    pub const IDENTITY: Self = Self {
        cos: 1.0,
        sin: 0.0,
        x: 0.0,
        z: 0.0,
    };

    /// A heading in radians and a translation in metres.
    #[must_use]
    pub fn new(heading: f32, x: f32, z: f32) -> Self {
        let (sin, cos) = heading.sin_cos();
        Self { cos, sin, x, z }
    }

    /// Faces the way that `forward` points on the ground; +Z where it points nowhere.
    #[must_use]
    pub fn facing(forward: Vec2, x: f32, z: f32) -> Self {
        let direction = forward.normalize_or(Vec2::Y);
        Self {
            cos: direction.y,
            sin: direction.x,
            x,
            z,
        }
    }

    /// Heading in radians, in (-π, π].
    pub fn heading(self) -> f32 {
        self.sin.atan2(self.cos)
    }

    /// Whether the rotation has unit length and the translation is at most `furthest` metres long. Checks values that come
    /// from a file.
    pub fn is_sound(self, furthest: f32) -> bool {
        (self.cos * self.cos + self.sin * self.sin - 1.0).abs() < 1e-3
            && self.x.abs() <= furthest
            && self.z.abs() <= furthest
    }

    /// Cosine of the heading.
    pub fn cos(self) -> f32 {
        self.cos
    }

    /// Sine of the heading.
    pub fn sin(self) -> f32 {
        self.sin
    }

    /// The translation as a point on the ground.
    pub fn ground(self) -> Vec2 {
        Vec2::new(self.x, self.z)
    }

    /// The transform that undoes this one.
    #[must_use]
    pub fn inverse(self) -> Self {
        let turned = Self {
            cos: self.cos,
            sin: -self.sin,
            x: 0.0,
            z: 0.0,
        };
        let back = turned.point(Vec3::new(-self.x, 0.0, -self.z));
        Self {
            x: back.x,
            z: back.z,
            ..turned
        }
    }

    /// Transforms a point; its height stays.
    pub fn point(self, point: Vec3) -> Vec3 {
        self.vector(point) + Vec3::new(self.x, 0.0, self.z)
    }

    /// Turns a direction, without moving it.
    pub fn vector(self, v: Vec3) -> Vec3 {
        Vec3::new(
            self.cos * v.x + self.sin * v.z,
            v.y,
            self.cos * v.z - self.sin * v.x,
        )
    }

    /// The rotation about +Y as a quaternion.
    pub fn rotation(self) -> Quat {
        // Cosine and sine of half the heading, the larger one by its root.
        let (y, w) = if self.cos >= 0.0 {
            let w = ((1.0 + self.cos) / 2.0).sqrt();
            (self.sin / (2.0 * w), w)
        } else {
            let y = ((1.0 - self.cos) / 2.0).sqrt().copysign(self.sin);
            (y, self.sin / (2.0 * y))
        };
        Quat::from_xyzw(0.0, y, 0.0, w)
    }
}

impl std::ops::Mul for Rigid2 {
    type Output = Self;
    /// `a * b` applies `b` first, as matrices do.
    #[inline]
    fn mul(self, inner: Self) -> Self {
        let (cos, sin) = (
            self.cos * inner.cos - self.sin * inner.sin,
            self.sin * inner.cos + self.cos * inner.sin,
        );
        let length = (cos * cos + sin * sin).sqrt();
        let moved = self.point(Vec3::new(inner.x, 0.0, inner.z));
        Self {
            cos: cos / length,
            sin: sin / length,
            x: moved.x,
            z: moved.z,
        }
    }
}

/// A sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Position of the centre, in metres. Files call it `offset`.
    #[serde(rename = "offset")]
    pub centre: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

impl Sphere {
    /// The sphere with this centre and radius, in metres.
    #[must_use]
    pub fn new(centre: Vec3, radius: f32) -> Self {
        Self { centre, radius }
    }

    /// A sphere that contains all `spheres`, centred in the bounding box of their centres.
    pub fn around(spheres: &[Self]) -> Self {
        let centres = || spheres.iter().map(|sphere| sphere.centre);
        let low = centres().fold(Vec3::INFINITY, Vec3::min);
        let high = centres().fold(Vec3::NEG_INFINITY, Vec3::max);
        let centre = (low + high) / 2.0;
        let reach = |sphere: &Self| sphere.centre.distance(centre) + sphere.radius;
        let radius = spheres.iter().map(reach).fold(0.0, f32::max);
        Self { centre, radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_turn_takes_forward_to_the_left() {
        let turned = Rigid2::new(FRAC_PI_2, 0.0, 0.0).vector(Vec3::Z);
        assert!((turned - Vec3::X).length() < 1e-6);
    }

    #[test]
    fn agrees_with_the_quaternion() {
        let placement = Rigid2::new(0.7, 1.0, -2.0);
        let point = Vec3::new(0.3, 1.1, -0.4);
        let by_quaternion = placement.rotation() * point + Vec3::new(1.0, 0.0, -2.0);
        assert!((placement.point(point) - by_quaternion).length() < 1e-6);
    }

    #[test]
    fn the_quaternion_is_that_of_the_heading() {
        for step in -63..=63 {
            let heading = step as f32 * 0.05;
            let rotation = Rigid2::new(heading, 0.0, 0.0).rotation();
            let apart = rotation.angle_between(Quat::from_rotation_y(heading));
            assert!(apart < 1e-3, "{heading}: {rotation}");
            assert!((rotation.length() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_inverse_undoes() {
        let placement = Rigid2::new(2.1, 1.0, -2.0);
        let there_and_back = placement * placement.inverse();
        assert!(there_and_back.ground().length() < 1e-6 && there_and_back.heading().abs() < 1e-6);
    }
}
