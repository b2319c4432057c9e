use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::view::scene::Camera;

/// A camera that goes around what it looks at, and follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// From +Z towards +X, radians.
    pub around: f32,
    /// Above the horizon, radians.
    pub up: f32,
    /// Metres.
    pub distance: f32,
    /// Vertical field of view, radians.
    pub field: f32,
    /// What is in the middle, metres.
    pub focus: Vec3,
    /// How far to the left of the picture's middle the focus is seen, as a share of the picture's width: for panels on the
    /// right. Default 0.
    pub aside: f32,
}

/// Seconds after which the focus has come nearer by two thirds.
const SLACK: f32 = 0.35;
/// Radians per pixel of a drag.
const TURN: f32 = 0.006;

impl Orbit {
    /// From before a fighter who faces +Z, a little to the side and from above.
    #[must_use]
    pub fn around_fighter(focus: Vec3) -> Self {
        Self {
            around: 0.55,
            up: 0.17,
            distance: 4.6,
            field: 32f32.to_radians(),
            focus,
            aside: 0.0,
        }
    }

    /// Goes around by a drag of so many pixels.
    pub fn drag(&mut self, pixels: Vec2) {
        self.around = (self.around - pixels.x * TURN).rem_euclid(TAU);
        self.up = (self.up + pixels.y * TURN).clamp(-0.05, 1.45);
    }

    /// Goes nearer by so many notches of a wheel.
    pub fn zoom(&mut self, notches: f32) {
        self.distance = (self.distance * 0.9f32.powf(notches)).clamp(1.2, 60.0);
    }

    /// Follows what moves; `seconds` since the last time.
    pub fn follow(&mut self, focus: Vec3, seconds: f32) {
        let share = 1.0 - (-seconds.max(0.0) / SLACK).exp();
        self.focus = self.focus.lerp(focus, share);
    }

    /// The camera in a picture of this width over height. It stays above the ground.
    #[must_use]
    pub fn camera(&self, aspect: f32) -> Camera {
        let out = Camera::orbit(self.focus, (self.around, self.up), self.distance);
        let ahead = (out.target - out.eye).normalize_or(Vec3::NEG_Z);
        let right = ahead.cross(Vec3::Y).normalize_or(Vec3::X);
        let wide = 2.0 * self.distance * (0.5 * self.field).tan() * aspect;
        let shift = right * (wide * self.aside);
        let low = Vec3::new(out.eye.x, out.eye.y.max(0.12), out.eye.z);
        Camera {
            eye: low + shift,
            target: out.target + shift,
            field: self.field,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_focus_is_seen_where_the_orbit_says() {
        let mut orbit = Orbit::around_fighter(Vec3::new(0.4, 0.9, -0.2));
        let size = [1280, 720];
        let aspect = 1280.0 / 720.0;
        let middle = orbit.camera(aspect).pixel(orbit.focus, size).unwrap();
        assert!(middle.distance(Vec2::new(640.0, 360.0)) < 0.5, "{middle}");
        orbit.aside = 0.125;
        let left = orbit.camera(aspect).pixel(orbit.focus, size).unwrap();
        assert!(left.distance(Vec2::new(480.0, 360.0)) < 2.0, "{left}");
        orbit.drag(Vec2::new(0.0, -1e6));
        assert!(orbit.camera(aspect).eye.y > 0.1, "never below the ground");
        orbit.zoom(1e3);
        assert!(orbit.distance >= 1.2);
    }
}
