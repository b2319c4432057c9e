//! # Concept
//! Balls fly at a walking character, and it dodges them. A threat is a set of spheres with a time, a position and a velocity. Announce it
//! as early as your game knows of it: more warning leaves more ways to dodge.
//!
//! # Usage
//! `cargo run --release --example threats -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `threaten` announces a ball that will be thrown in half a second.
//! 2. `step` plans: it searches the graph for a path and a playback speed with which all known threats narrowly miss.
//! 3. Events say what was planned, what missed by how much, and what hit.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki::character::{CharacterEventKind, CharacterSettings, Characters, Goal, Threat};
use sabaki::math::Rigid2;

const FRAME: f32 = 1.0 / 60.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = Arc::new(common::baked()?);
    let mut joints = vec![JointTransform::IDENTITY; baked.graph().skeleton().len()];
    let mut game = Characters::new(baked, CharacterSettings::default())?;
    let player = game.spawn(Rigid2::IDENTITY)?;
    let mut events = Vec::new();
    for frame in 0..60 * 20 {
        let (velocity, facing) = (Vec3::Z * 0.8, None);
        game.steer(player, Goal::Walk { velocity, facing })?;
        if frame % 180 == 90 {
            // It leaves the thrower's hand in 0.5 s and flies for 0.7 s, to where the chest will be.
            let target = joints[0].translation + velocity * 1.2 + Vec3::Y * 0.3;
            let from = target + Vec3::new(5.0, 0.2, 3.0);
            let thrown = game.now() + 0.5;
            game.threaten(Threat::ball(thrown, from, (target - from) / 0.7, 0.1))?;
        }
        events.clear();
        game.step(FRAME, &[], &mut events);
        game.pose(player, &mut joints)?;
        for event in &events {
            let what = match event.kind {
                CharacterEventKind::Planned { clearance, .. } => {
                    format!("a plan that it misses by {clearance:.2} m")
                }
                CharacterEventKind::MissedBy { metres, .. } => format!("missed by {metres:.2} m"),
                CharacterEventKind::Hit { .. } => "hit".to_owned(),
                CharacterEventKind::Cannot => "no motion avoids it".to_owned(),
                _ => continue,
            };
            println!("{:5.2} s: {what}", event.time);
        }
    }
    Ok(())
}
