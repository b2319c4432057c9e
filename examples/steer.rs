//! # Concept
//! A character walks where the player points, goes to a place by itself, and stands idle. `Characters` owns the baked graph and plays
//! the clips that come closest to each goal.
//!
//! # Usage
//! `cargo run --release --example steer -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `spawn` puts a character on the ground.
//! 2. Each frame: `steer` sets the goal, `step` advances the time, `pose` gives the joints in the world.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki::character::{CharacterSettings, Characters, Goal};
use sabaki::math::Rigid2;

const FRAME: f32 = 1.0 / 60.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = Arc::new(common::baked()?);
    // `pose` fills a buffer of exactly this length.
    let mut joints = vec![JointTransform::IDENTITY; baked.graph().skeleton().len()];
    let mut game = Characters::new(baked, CharacterSettings::default())?;
    let player = game.spawn(Rigid2::IDENTITY)?;
    let mut events = Vec::new();
    for frame in 0..60 * 15 {
        let seconds = frame as f32 * FRAME;
        let goal = match seconds {
            // A stick that turns: walk in a circle, facing the direction of travel.
            ..6.0 => Goal::Walk {
                velocity: Vec3::new(seconds.sin(), 0.0, seconds.cos()) * 1.2,
                facing: None,
            },
            6.0..12.0 => Goal::GoTo {
                point: Vec3::new(0.0, 0.0, 3.0),
                speed: 1.2,
            },
            _ => Goal::Idle,
        };
        game.steer(player, goal)?;
        game.step(FRAME, &[], &mut events);
        // A renderer draws these joints.
        game.pose(player, &mut joints)?;
        if frame % 60 == 0 {
            let (at, speed) = (joints[0].translation, game.velocity(player)?.length());
            println!(
                "{seconds:4.1} s: at ({:5.2}, {:5.2}), {speed:.2} m/s",
                at.x, at.z
            );
        }
    }
    Ok(())
}
