//! The obstacles near one character, and how its body is kept out of them.
//!
//! Plans and steering avoid obstacles. What is left, such as an arm that swings into a wall or a body that comes closer, is removed by
//! a shift of the whole body on the ground, as character controllers of games do.

use std::sync::Mutex;

use glam::{Vec2, Vec3};

use super::scratch::Worker;
use super::slot::{Slot, lock};
use super::state::CharacterState;
use super::world::World;
use crate::maps::BakedGraph;
use crate::math::Rigid2;
use crate::query::Obstacle;
use crate::query::obstacle::ObstacleTest;

/// Obstacles within this distance of what the body reaches are near, in metres.
const NEAR: f32 = 6.0;

/// A character as the others see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OtherBody {
    index: u32,
    /// On the ground (x, z), in metres.
    place: Vec2,
    /// In metres per second.
    velocity: Vec2,
}

/// Lists all characters that are not released.
pub(super) fn find_bodies(baked: &BakedGraph, slots: &[Mutex<Slot>], out: &mut Vec<OtherBody>) {
    for (index, slot) in slots.iter().enumerate() {
        let slot = lock(slot);
        let Some(state) = slot.state.as_deref().filter(|state| !state.is_released) else {
            continue;
        };
        let velocity = state.velocity(baked);
        out.push(OtherBody {
            index: index as u32,
            place: state.ground(baked),
            velocity: Vec2::new(velocity.x, velocity.z),
        });
    }
}

impl CharacterState {
    /// Lists the obstacles near the character, among them the other characters.
    pub(super) fn near_obstacles(&self, index: u32, world: &World<'_>, out: &mut Vec<Obstacle>) {
        out.clear();
        if world.obstacles.is_empty() && world.bodies.is_empty() {
            return;
        }
        let root = (&self.playing.motion).root(world.baked.graph(), self.playing.seconds);
        let range = |obstacle: &Obstacle| {
            world.baked.reach() + NEAR + obstacle.velocity().length() * world.settings.horizon
        };
        let near = |obstacle: &&Obstacle| obstacle.distance(root, 0.0) < range(obstacle);
        out.extend(world.obstacles.iter().filter(near));
        for body in world.bodies.iter().filter(|body| body.index != index) {
            let radius = world.settings.body_radius;
            let disc = Obstacle::disc(body.place, radius);
            let velocity = Vec3::new(body.velocity.x, 0.0, body.velocity.y);
            let disc = disc.and_then(|disc| disc.moving(velocity));
            out.extend(disc.ok().filter(|disc| near(&disc)));
        }
    }

    /// Drops a plan that has come to enter an obstacle, which moves otherwise than it did.
    pub(super) fn look_for_obstacles(
        &mut self,
        index: u32,
        world: &World<'_>,
        worker: &mut Worker,
    ) {
        /// Time between two looks, and how far they look ahead, in seconds.
        const INTERVAL: f64 = 0.1;
        const AHEAD: f32 = 0.8;
        let left = self.held_until - world.now;
        if left <= 0.0 || world.now < self.look_at || self.pending.is_some() {
            return;
        }
        self.look_at = world.now + INTERVAL;
        self.near_obstacles(index, world, &mut worker.obstacles);
        if worker.obstacles.is_empty() {
            return;
        }
        let playing = &mut self.playing;
        let seconds = (left as f32).min(AHEAD);
        let to = playing.seconds + seconds * playing.rate;
        playing.motion.extend(world.baked.graph(), to);
        // The motion began before now.
        let began = playing.seconds;
        worker.plan.ahead.clear();
        let since = worker.obstacles.iter().map(|one| one.later(-began, 0.0));
        worker.plan.ahead.extend(since);
        let test = ObstacleTest {
            baked: world.baked,
            obstacles: &worker.plan.ahead,
            seconds: (began, to),
            enough: 0.0,
        };
        let entered = test.on_motion(&playing.motion, &mut worker.plan.entered);
        if entered.is_some() {
            self.seen = 0;
            if world.threats.is_empty() {
                self.held_until = world.now;
            }
        }
    }

    /// Shifts the body out of the obstacles that it enters at the end of the step.
    pub(super) fn keep_out(&mut self, world: &World<'_>, worker: &mut Worker) {
        /// Distance that is kept, in metres.
        const SKIN: f32 = 0.002;
        const TURNS: usize = 12;
        let (body, reach) = (world.baked.body(), world.baked.reach());
        let playing = &self.playing;
        let root = playing.motion.root(world.baked.graph(), playing.seconds);
        let is_near = |one: &Obstacle| one.distance(root, world.dt) < reach + SKIN;
        worker.obstacles.retain(is_near);
        if worker.obstacles.is_empty() {
            return;
        }
        worker.pose_body(world.baked, (&playing.motion, playing.seconds));
        let Worker {
            centres, obstacles, ..
        } = worker;
        // Only a sphere that reaches as far from the root as an obstacle is can enter it.
        let extents = centres
            .iter()
            .zip(&body.spheres)
            .map(|(centre, part)| centre.distance(root) + part.radius);
        let widest = extents.fold(0.0, f32::max) + SKIN + world.settings.push * world.dt;
        obstacles.retain(|one| one.distance(root, world.dt) < widest);
        let mut shift = Vec2::ZERO;
        for _ in 0..TURNS {
            let mut deepest = (0.0, Vec2::ZERO);
            for obstacle in &*obstacles {
                for (centre, part) in centres.iter().zip(&body.spheres) {
                    let at = *centre + Vec3::new(shift.x, 0.0, shift.y);
                    let nearest = obstacle.nearest(at, world.dt);
                    let depth = part.radius + SKIN - nearest.metres;
                    if depth > deepest.0 {
                        let out = Vec2::new(nearest.normal.x, nearest.normal.z);
                        let out = match out.length() > 0.3 {
                            true => out / out.length_squared(),
                            false => obstacle.outwards(at, world.dt),
                        };
                        deepest = (depth, out * (depth + 1e-4));
                    }
                }
            }
            if deepest.0 == 0.0 {
                break;
            }
            shift += deepest.1;
        }
        let shift = shift.clamp_length_max(world.settings.push * world.dt);
        if shift == Vec2::ZERO {
            return;
        }
        let by = Rigid2::new(0.0, shift.x, shift.y);
        self.playing.motion.transform(by);
        if let Some(pending) = &mut self.pending {
            pending.motion.transform(by);
        }
    }
}
