//! The guard in which all clips start and end.

use glam::{Vec2, Vec3};

use super::feet::FootPlacement;
use super::keys::Body;
use super::skeleton::LEFT;

/// The guard at the origin, with the left foot in front, or the right one for a southpaw.
pub(super) fn guard(southpaw: bool) -> Body {
    let orthodox = Body {
        place: Vec3::ZERO,
        pelvis: Vec3::new(-0.005, 0.9, -0.01),
        hips: Vec3::new(0.06, -0.45, 0.0),
        chest: Vec3::new(0.15, -0.38, 0.0),
        head: Vec3::new(0.08, -0.04, 0.0),
        hands: [Vec3::new(0.12, 0.20, 0.31), Vec3::new(-0.075, 0.19, 0.22)],
        reach: [Vec3::new(0.03, 1.45, 0.62), Vec3::new(-0.02, 1.45, 0.62)],
        reaching: [0.0; 2],
        elbows: [0.32, 0.38],
        heels: [0.0; 2],
    };
    if southpaw {
        orthodox.mirrored()
    } else {
        orthodox
    }
}

/// Place of a foot in guard, in home.
pub(super) fn guard_placement(side: usize, southpaw: bool) -> FootPlacement {
    let front = (side == LEFT) != southpaw;
    let orthodox = if front {
        FootPlacement::at_ankle(Vec2::new(0.10, 0.20), -0.2)
    } else {
        FootPlacement::at_ankle(Vec2::new(-0.12, -0.21), -0.8)
    };
    if southpaw {
        FootPlacement {
            toe: Vec2::new(-orthodox.toe.x, orthodox.toe.y),
            yaw: -orthodox.yaw,
        }
    } else {
        orthodox
    }
}
