//! The room of a driven character: four walls and pillars.

use glam::{Vec2, Vec3};
use sabaki::math::Sphere;
use sabaki::query::{Obstacle, ObstacleError};
use sabaki_draw::scene::{Capsule, Shot};

use super::sight_line::{FADED, SightLine};

/// Half of the side of the room, in metres.
pub(super) const HALF_SIDE: f32 = 6.0;

/// Pillars: place (x, z) and radius, in metres.
const PILLARS: [(Vec2, f32); 3] = [
    (Vec2::new(2.5, 2.0), 0.35),
    (Vec2::new(-3.0, 1.0), 0.35),
    (Vec2::new(0.5, -3.2), 0.5),
];

const COLOUR: [f32; 3] = [0.34, 0.38, 0.45];

/// The walls and pillars as obstacles.
///
/// # Errors
/// None for this room.
pub(super) fn obstacles() -> Result<Vec<Obstacle>, ObstacleError> {
    let mut all = Vec::new();
    for out in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        all.push(Obstacle::half_space(out * HALF_SIDE, -out)?);
    }
    for (place, radius) in PILLARS {
        all.push(Obstacle::disc(place, radius)?);
    }
    Ok(all)
}

/// Adds the walls as rails and the pillars as columns. A pillar that hides the character is translucent.
pub(super) fn add_room(sight: &SightLine, shot: &mut Shot) {
    const THICK: f32 = 0.06;
    let [r, g, b] = COLOUR;
    for height in [0.1, 0.6, 1.1] {
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        let corner = |index: usize| {
            let (x, z): (f32, f32) = corners[index % 4];
            Vec3::new(x * (HALF_SIDE + THICK), height, z * (HALF_SIDE + THICK))
        };
        for index in 0..4 {
            let end = |index| Sphere::new(corner(index), THICK);
            let rail = Capsule::new(end(index), end(index + 1), [r, g, b, 1.0]);
            shot.solids.push(rail);
        }
    }
    for (place, radius) in PILLARS {
        let at = |height: f32| Sphere::new(Vec3::new(place.x, height, place.y), radius);
        let pillar = |alpha| Capsule::new(at(0.0), at(1.8), [r, g, b, alpha]);
        match sight.meets(place, radius) {
            true => shot.ghosts.push(pillar(FADED)),
            false => shot.solids.push(pillar(1.0)),
        }
    }
}
