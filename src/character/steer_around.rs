//! Steering around obstacles.
//!
//! Source: Fiorini & Shiller, "Motion Planning in Dynamic Environments Using Velocity Obstacles" (1998). Differs: velocities are
//! sampled, the wanted one first, then those that turn off by ever more; time to collision is found by sphere tracing, so that
//! any shape with a distance function is an obstacle.

use glam::{Vec2, Vec3};

use super::goal::{Aim, Goal, STANDING};
use super::state::{CharacterState, Side};
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
    /// Distance that the root keeps from obstacles, in metres.
    clearance: f32,
    /// Time that is looked ahead, in seconds.
    foresight: f32,
}

impl CharacterState {
    /// Aim of the goal, changed so that the character goes around obstacles.
    pub(super) fn steer_around(&mut self, world: &World<'_>, obstacles: &[Obstacle]) -> Aim {
        let place = self.playing.ground(world.baked.graph());
        let (aim, is_there) = match self.goal {
            Goal::Strike { .. } => self.aim_to_strike(world),
            goal => (goal.aim(place, &mut self.has_arrived), false),
        };
        if obstacles.is_empty() || is_there {
            self.side = Side::None;
            return aim;
        }
        let around = Around {
            obstacles,
            place,
            clearance: world.settings.steer.clearance,
            foresight: world.settings.steer.foresight,
        };
        let is_bound = matches!(self.goal, Goal::GoTo { .. } | Goal::Strike { .. });
        let (velocity, side) = around.velocity(aim.velocity, is_bound, self.side);
        self.side = side;
        Aim { velocity, ..aim }
    }
}

impl Around<'_> {
    /// The velocity nearest to the wanted one that meets no obstacle, and the side to which it turns off. A character that goes to a point
    /// (`is_bound`) goes around obstacles; any other goes the slower, the more it turns. `side` is the side on which it passes an obstacle.
    fn velocity(&self, wanted: Vec2, is_bound: bool, side: Side) -> (Vec2, Side) {
        let free = self.free(wanted);
        if free >= self.foresight {
            return (wanted, Side::None);
        }
        let stands = wanted.length() < STANDING;
        let sides = match side {
            Side::None => &[Side::Left, Side::Right][..],
            Side::Left => &[Side::Left],
            Side::Right => &[Side::Right],
        };
        let mut best = (free, Vec2::ZERO, Side::None);
        let turns = match stands {
            true => 0..=2 * TURNS.0,
            false => 1..=TURNS.0,
        };
        let way = match stands {
            true => self.aside() * ASIDE,
            false => wanted,
        };
        let keeps_speed = stands || is_bound;
        for turn in turns {
            for &side in sides {
                let angle = f32::from(turn) * TURNS.1;
                let least = if keeps_speed { 0.8 } else { 0.0 };
                let velocity = turned(way, side, angle) * angle.cos().max(least);
                let free = self.free(velocity);
                if free > best.0 + 1e-3 {
                    best = (free, velocity, side);
                }
            }
            if best.0 >= self.foresight {
                return (best.1, best.2);
            }
        }
        if side != Side::None {
            // The other side may be free.
            return self.velocity(wanted, is_bound, Side::None);
        }
        // No direction is free for long: the character slows down, so that it stops in front of the obstacle.
        let share = (best.0 / self.foresight).clamp(0.0, 1.0);
        match best.1 == Vec2::ZERO {
            true => (wanted * (share - 0.3).max(0.0), Side::None),
            false => (best.1 * share, best.2),
        }
    }

    /// The direction in which a body that stands makes way for what it meets first: across its way, on the side where the body is.
    fn aside(&self) -> Vec2 {
        /// Distance from the middle of the obstacle's way within which a body always goes to the left, in metres.
        const MIDDLE: f32 = 0.05;
        let free = |obstacle: &&Obstacle| self.free_of(obstacle, Vec2::ZERO);
        let first = self.obstacles.iter();
        let Some(first) = first.min_by(|a, b| free(a).total_cmp(&free(b))) else {
            return Vec2::Y;
        };
        let (_, away) = ground(first, self.place, 0.0);
        let moves = first.velocity();
        let along = Vec2::new(moves.x, moves.z).normalize_or_zero();
        let across = away - along * away.dot(along);
        match across.length() > MIDDLE {
            true => across.normalize(),
            false => along.perp(),
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
                // A character that is too near may move away.
                let goes_away = is_first && closing.dot(normal) >= 0.0;
                return if goes_away { self.foresight } else { seconds };
            }
            seconds += (free / speed).max(STEP);
            is_first = false;
        }
        self.foresight
    }
}

/// A direction or velocity, turned off to a side by an angle.
fn turned(way: Vec2, side: Side, angle: f32) -> Vec2 {
    let angle = if side == Side::Left { -angle } else { angle };
    Vec2::from_angle(angle).rotate(way)
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
