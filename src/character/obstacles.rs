//! The obstacles near one character, among them the other characters.

use std::sync::Mutex;

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::event::CharacterId;
use super::kind::Kind;
use super::slot::Slot;
use super::state::CharacterState;
use super::world::{OtherBody, Worker, World};
use crate::math::parallel::lock;
use crate::query::Obstacle;
use crate::query::clearance::ObstacleTest;

/// Obstacles within this distance of what the body reaches are near, in metres.
const NEAR: f32 = 6.0;

/// Characters on grounds that are further apart are not in each other's way, in metres.
const STOREY: f32 = 1.8;

/// Lists all characters that are not released.
pub(super) fn find_bodies(kinds: &[Kind], slots: &[Mutex<Slot>], out: &mut Vec<OtherBody>) {
    for (index, slot) in slots.iter().enumerate() {
        let slot = lock(slot);
        let Some(state) = slot.state.as_deref().filter(|state| !state.is_released) else {
            continue;
        };
        let Kind {
            baked, settings, ..
        } = slot.kind.of(kinds);
        let velocity = state.velocity(baked);
        let playing = &state.playing;
        let root = playing.motion.root(baked.graph(), playing.seconds);
        out.push(OtherBody {
            id: slot.id(index),
            place: root.xz(),
            height: state.height,
            root: root.y,
            velocity: Vec2::new(velocity.x, velocity.z),
            radius: settings.body_radius,
        });
    }
}

impl CharacterState {
    /// Lists the obstacles near the character, among them the other characters.
    pub(super) fn near_obstacles(
        &self,
        id: CharacterId,
        world: &World<'_>,
        out: &mut Vec<Obstacle>,
    ) {
        out.clear();
        // Who strikes comes near.
        let avoids = world.settings.body_radius > 0.0 && self.strike.is_none();
        let bodies = if avoids { world.bodies } else { &[] };
        if world.obstacles.is_empty() && bodies.is_empty() {
            return;
        }
        let root = self
            .playing
            .motion
            .root(world.baked.graph(), self.playing.seconds);
        let range = |obstacle: &Obstacle| {
            self.reach(world.baked) + NEAR + obstacle.velocity().length() * world.settings.horizon
        };
        let near =
            |obstacle: &&Obstacle, root: Vec3| obstacle.distance(root, 0.0) < range(obstacle);
        let place = root + Vec3::Y * self.height;
        let given = world.obstacles.iter().filter(|one| near(one, place));
        out.extend(given.map(|one| one.lowered(self.height)));
        let is_other = |body: &&OtherBody| {
            body.id != id && body.radius > 0.0 && (body.height - self.height).abs() < STOREY
        };
        for body in bodies.iter().filter(is_other) {
            let disc = Obstacle::disc(body.place, body.radius);
            let velocity = Vec3::new(body.velocity.x, 0.0, body.velocity.y);
            let disc = disc.and_then(|disc| disc.moving(velocity));
            out.extend(disc.ok().filter(|disc| near(&disc, root)));
        }
    }

    /// Drops a plan that has come to enter an obstacle, which moves otherwise than it did.
    pub(super) fn look_for_obstacles(
        &mut self,
        id: CharacterId,
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
        self.near_obstacles(id, world, &mut worker.obstacles);
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
        let context = &mut worker.plan.context;
        context.forget_poses();
        context.body().set_additive(&self.additive);
        let entered = context.body().worst_entry(&test, &playing.motion);
        // Threats are then answered again; without any, steering goes on.
        if entered.is_some() && std::mem::take(&mut self.seen) == 0 {
            self.held_until = world.now;
        }
    }
}
