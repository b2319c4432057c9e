//! # Concept
//! A character walks towards a goal in a room, around a pillar and out of the way of a cart. Obstacles are half-spaces, boxes, capsules
//! and convex polygons; each may move.
//!
//! # Usage
//! `cargo run --release --example obstacles -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. Each `step` takes the obstacles as they are now: all within 10 m, plus the distance that a moving one covers within the horizon.
//! 2. Steering goes around them, and a plan that enters one is no candidate.
//! 3. What is left is removed by a shift of the body, of at most `CharacterSettings::push`.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use glam::Vec3;
use sabaki::character::{CharacterSettings, Characters, Goal};
use sabaki::math::Rigid2;
use sabaki::query::Obstacle;

const FRAME: f32 = 1.0 / 60.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut game = Characters::new(Arc::new(common::baked()?), CharacterSettings::default())?;
    let player = game.spawn(Rigid2::IDENTITY)?;
    let (pillar, radius) = (Vec3::new(0.2, 0.0, 3.0), 0.4);
    let goal = Goal::GoTo {
        point: Vec3::new(0.0, 0.0, 6.0),
        speed: 1.2,
    };
    game.steer(player, goal)?;
    let mut nearest = f32::INFINITY;
    for frame in 0..60 * 12 {
        let seconds = frame as f32 * FRAME;
        // The cart drives across the path at 0.5 m/s.
        let cart = Vec3::new(-3.0 + 0.5 * seconds, 0.5, 5.0);
        let obstacles = [
            Obstacle::half_space(Vec3::X * 4.0, Vec3::NEG_X)?,
            Obstacle::capsule(pillar, pillar + Vec3::Y * 2.0, radius)?,
            Obstacle::block(cart, Vec3::new(0.5, 0.5, 0.3), 0.0)?.moving(Vec3::X * 0.5)?,
        ];
        game.step(FRAME, &obstacles, &mut Vec::new());
        let place = game.place(player)?;
        let at = Vec3::new(place.x, 0.0, place.z);
        nearest = nearest.min(at.distance(pillar) - radius);
        if frame % 60 == 0 {
            println!("{seconds:4.1} s: at ({:5.2}, {:5.2})", at.x, at.z);
        }
    }
    println!("its middle came within {nearest:.2} m of the pillar");
    Ok(())
}
