//! What stands between the camera and a character.

use glam::{Vec2, Vec3};
use sabaki_draw::scene::Camera;

/// Opacity of what hides the character.
pub(super) const FADED: f32 = 0.2;

/// The line on the ground from the camera to a character.
pub(super) struct SightLine {
    eye: Vec2,
    character: Vec2,
}

impl SightLine {
    /// The line from a camera to a character's focus.
    pub(super) fn new(camera: &Camera, focus: Vec3) -> Self {
        Self {
            eye: Vec2::new(camera.eye.x, camera.eye.z),
            character: Vec2::new(focus.x, focus.z),
        }
    }

    /// Whether an upright cylinder on the ground hides a part of the character: its place (x, z) and radius, in metres.
    pub(super) fn meets(&self, place: Vec2, radius: f32) -> bool {
        /// Half of the width of the character, in metres.
        const CHARACTER: f32 = 0.45;
        let (way, to) = (self.character - self.eye, place - self.eye);
        let along = to.dot(way.normalize_or_zero());
        let aside = (to.length_squared() - along * along).max(0.0).sqrt();
        (0.0..way.length()).contains(&along) && aside < radius + CHARACTER
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_meets_what_stands_between_camera_and_character_alone() {
        let camera = Camera {
            eye: Vec3::new(0.0, 2.0, 6.0),
            target: Vec3::new(0.0, 0.9, 0.0),
            field: 0.8,
        };
        let sight = SightLine::new(&camera, camera.target);
        let meets = |x: f32, z: f32| sight.meets(Vec2::new(x, z), 0.3);
        assert!(meets(0.0, 3.0) && meets(0.7, 3.0) && meets(-0.7, 1.0));
        assert!(!meets(0.8, 3.0), "beside the line");
        assert!(!meets(0.0, -0.5), "behind the character");
        assert!(!meets(0.0, 6.5), "behind the camera");
    }
}
