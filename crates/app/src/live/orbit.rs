use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use sabaki_draw::scene::Camera;

/// A camera that orbits its focus and follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Angle around the focus, from +Z towards +X, in radians.
    pub around: f32,
    /// Angle above the horizon, in radians.
    pub up: f32,
    /// Distance from the focus, in metres.
    pub distance: f32,
    /// Vertical field of view, in radians.
    pub field: f32,
    /// Centre of the picture, in metres.
    pub focus: Vec3,
}

/// Time constant with which the focus follows, in seconds.
const SLACK: f32 = 0.35;
/// Rotation of the camera for each pixel of a drag, in radians.
const TURN: f32 = 0.006;

impl Orbit {
    /// A camera in front of a character that faces +Z, slightly to the side and above.
    #[must_use]
    pub fn around_fighter(focus: Vec3) -> Self {
        Self {
            around: 0.55,
            up: 0.17,
            distance: 4.6,
            field: 32f32.to_radians(),
            focus,
        }
    }

    /// Orbits by a drag of the mouse, in pixels.
    pub fn drag(&mut self, pixels: Vec2) {
        self.around = (self.around - pixels.x * TURN).rem_euclid(TAU);
        self.up = (self.up + pixels.y * TURN).clamp(-0.05, 1.45);
    }

    /// Moves nearer by notches of the mouse wheel.
    pub fn zoom(&mut self, notches: f32) {
        self.distance = (self.distance * 0.9f32.powf(notches)).clamp(1.2, 60.0);
    }

    /// Follows a moving focus; `seconds` have passed since the last call.
    pub fn follow(&mut self, focus: Vec3, seconds: f32) {
        let share = 1.0 - (-seconds.max(0.0) / SLACK).exp();
        self.focus = self.focus.lerp(focus, share);
    }

    /// The camera of the orbit. It stays above the ground.
    #[must_use]
    pub fn camera(&self) -> Camera {
        let out = Camera::orbit(sabaki_draw::scene::Orbit {
            target: self.focus,
            around: self.around,
            up: self.up,
            distance: self.distance,
        });
        Camera {
            eye: Vec3::new(out.eye.x, out.eye.y.max(0.12), out.eye.z),
            field: self.field,
            ..out
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_focus_is_in_the_middle_and_the_eye_above_the_ground() {
        let mut orbit = Orbit::around_fighter(Vec3::new(0.4, 0.9, -0.2));
        let size = [1280, 720];
        let middle = orbit.camera().pixel(orbit.focus, size).unwrap();
        assert!(middle.distance(Vec2::new(640.0, 360.0)) < 0.5, "{middle}");
        orbit.drag(Vec2::new(0.0, -1e6));
        assert!(orbit.camera().eye.y > 0.1, "never below the ground");
        orbit.zoom(1e3);
        assert!(orbit.distance >= 1.2);
    }
}
