//! # Concept
//! Your physics takes the body over, as a ragdoll does after a hit, and gives it back. The character gets up from the last pose, with its
//! speed, at the nearest moment of the clips.
//!
//! # Usage
//! `cargo run --release --example ragdoll -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `local_pose` is the pose that is seen: the root in the world, and the rotation of each joint relative to its parent.
//! 2. `release` stops `step` from moving the character.
//! 3. `resume` takes the last two poses and the time between them. The difference to the clips fades out.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::Pose;
use sabaki::character::{CharacterSettings, Characters, Goal};
use sabaki::math::Rigid2;

const FRAME: f32 = 1.0 / 60.0;

/// A physics engine that knows one thing: the body slides to the side and slows down.
fn simulated(pose: &Pose, velocity: &mut Vec3) -> Pose {
    *velocity *= 0.97;
    Pose {
        root: pose.root + *velocity * FRAME,
        ..pose.clone()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut game = Characters::new(Arc::new(common::baked()?), CharacterSettings::default())?;
    let player = game.spawn(Rigid2::IDENTITY)?;
    let (velocity, facing) = (Vec3::Z * 1.2, None);
    game.steer(player, Goal::Walk { velocity, facing })?;
    let mut events = Vec::new();
    (0..90).for_each(|_| game.step(FRAME, &[], &mut events));

    // The physics starts from the pose that is seen.
    let (mut before, mut now) = (Pose::default(), Pose::default());
    game.local_pose(player, &mut now)?;
    game.release(player)?;
    let mut push = Vec3::X * 2.0;
    for _ in 0..60 {
        (before, now) = (now.clone(), simulated(&now, &mut push));
        game.step(FRAME, &[], &mut events);
    }
    println!("the ragdoll lies at {:.2}", now.root);

    game.resume(player, [&before, &now], FRAME)?;
    let mut pose = Pose::default();
    for frame in 0..120 {
        game.step(FRAME, &[], &mut events);
        game.local_pose(player, &mut pose)?;
        if frame % 30 == 0 {
            let moved = pose.root.distance(now.root);
            println!(
                "{:.1} s after it got up: {moved:.3} m away",
                FRAME * (frame + 1) as f32
            );
        }
    }
    Ok(())
}
