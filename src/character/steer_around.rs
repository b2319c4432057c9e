//! Steering around obstacles.
//!
//! Source: Fiorini & Shiller, "Motion Planning in Dynamic Environments Using Velocity Obstacles" (1998). Differs: velocities are
//! sampled, the wanted one first, then those that turn off by ever more; time to collision is found by sphere tracing, so that
//! any shape with a distance function is an obstacle.

use glam::{Vec2, Vec3};

use super::goal::{Aim, Goal, STANDING};
use super::state::CharacterState;
use super::world::World;
use crate::query::Obstacle;

/// Heights at which obstacles stop a walking body, in metres.
const HEIGHTS: [f32; 3] = [0.25, 0.9, 1.5];
/// Directions that are tried to each side, and their distance, in radians.
const TURNS: (u8, f32) = (7, 0.25);
/// Speed at which a standing body makes way, in metres per second.
const ASIDE: f32 = 1.2;

/// A body on the ground among obstacles.
struct Around<'a> {
    obstacles: &'a [Obstacle],
    place: Vec2,
    /// Distance that the root keeps, in metres.
    clearance: f32,
    /// Seconds.
    foresight: f32,
}

impl CharacterState {
    /// What the goal asks for, as far as obstacles allow it.
    pub(super) fn steer_around(&self, world: &World<'_>, obstacles: &[Obstacle]) -> Aim {
        let place = self.ground(world.baked);
        let aim = self.goal.aim(place);
        let around = Around {
            obstacles,
            place,
            clearance: world.settings.steer.clearance,
            foresight: world.settings.steer.foresight,
        };
        let is_bound = matches!(self.goal, Goal::GoTo { .. });
        match obstacles.is_empty() {
            true => aim,
            false => Aim {
                velocity: around.velocity(aim.velocity, is_bound),
                ..aim
            },
        }
    }
}

impl Around<'_> {
    /// The velocity nearest to the wanted one that meets no obstacle. What is bound for a place goes around; what is not is slowed
    /// down by what it turns off.
    fn velocity(&self, wanted: Vec2, is_bound: bool) -> Vec2 {
        let free = self.free(wanted);
        if free >= self.foresight {
            return wanted;
        }
        let stands = wanted.length() < STANDING;
        let way = match stands {
            true => Vec2::Y * ASIDE,
            false => wanted,
        };
        let (count, angle) = TURNS;
        let sides = if stands { 2 * count } else { count };
        let mut best = (free, Vec2::ZERO);
        for turn in 1..=sides {
            for side in [-1.0, 1.0] {
                let off = side * angle * f32::from(turn);
                let slower = match is_bound || stands {
                    true => off.cos().max(0.8),
                    false => off.cos().max(0.0),
                };
                let velocity = Vec2::from_angle(off).rotate(way) * slower;
                let free = self.free(velocity);
                if free > best.0 + 1e-3 {
                    best = (free, velocity);
                }
            }
            if best.0 >= self.foresight {
                return best.1;
            }
        }
        // Nothing is free for long: slower, so that it stops in front of what is there.
        let share = (best.0 / self.foresight).clamp(0.0, 1.0);
        match best.1 == Vec2::ZERO {
            true => wanted * (share - 0.3).max(0.0),
            false => best.1 * share,
        }
    }

    /// Time until an obstacle is met at a velocity, at most the foresight, in seconds.
    fn free(&self, velocity: Vec2) -> f32 {
        let each = self.obstacles.iter();
        each.map(|obstacle| self.free_of(obstacle, velocity))
            .fold(self.foresight, f32::min)
    }

    fn free_of(&self, obstacle: &Obstacle, velocity: Vec2) -> f32 {
        /// Shortest time that a step of the tracing passes, in seconds.
        const STEP: f32 = 0.02;
        let moves = obstacle.velocity();
        let closing = velocity - Vec2::new(moves.x, moves.z);
        let speed = closing.length().max(0.01);
        let (mut seconds, mut is_first) = (0.0, true);
        while seconds < self.foresight {
            let (metres, normal) = ground(obstacle, self.place + velocity * seconds, seconds);
            let free = metres - self.clearance;
            if free < 0.0 {
                // What is too near may go away.
                let goes_away = is_first && closing.dot(normal) >= 0.0;
                return if goes_away { self.foresight } else { seconds };
            }
            seconds += (free / speed).max(STEP);
            is_first = false;
        }
        self.foresight
    }
}

/// Distance of a point of the ground from what an obstacle is at the heights of a body, and the direction in which it grows.
fn ground(obstacle: &Obstacle, place: Vec2, seconds: f32) -> (f32, Vec2) {
    let mut least = (f32::INFINITY, Vec2::X);
    for height in HEIGHTS {
        let point = Vec3::new(place.x, height, place.y);
        let nearest = obstacle.nearest(point, seconds);
        if nearest.metres < least.0 {
            let normal = Vec2::new(nearest.normal.x, nearest.normal.z);
            let normal = match normal.length() > 0.3 {
                true => normal.normalize(),
                false => obstacle.outwards(point, seconds),
            };
            least = (nearest.metres, normal);
        }
    }
    least
}
