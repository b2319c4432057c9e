//! A game loop without a window: a character walks in a circle, balls are thrown at it, and it dodges.
//!
//! `cargo run --release --example game_loop [BAKED]`
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki::character::{CharacterEventKind, CharacterSettings, Characters, Goal, Threat};
use sabaki::math::Rigid2;

const FRAME: f32 = 1.0 / 60.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = match std::env::args().nth(1) {
        Some(file) => sabaki::archive::read(Path::new(&file))?,
        None => sabaki_fixtures::baked::embedded().clone(),
    };
    let mut game = Characters::new(Arc::new(baked), CharacterSettings::default())?;
    let me = game.spawn(Rigid2::IDENTITY)?;
    let mut joints = vec![JointTransform::IDENTITY; game.baked().graph().skeleton().len()];
    let mut events = Vec::new();
    for frame in 0..60 * 20 {
        // Input: the stick points somewhere else in each frame.
        let heading = frame as f32 * FRAME * 0.5;
        let velocity = Vec3::new(heading.sin(), 0.0, heading.cos()) * 1.2;
        let facing = None;
        game.steer(me, Goal::Walk { velocity, facing })?;
        if frame % 180 == 90 {
            let target = joints[0].translation + velocity * 1.2;
            let from = target + Vec3::new(5.0, 0.4, 3.0);
            let thrown = game.now() + 0.5;
            game.threaten(Threat::ball(thrown, from, (target - from) / 0.7, 0.1))?;
        }
        events.clear();
        game.step(FRAME, &[], &mut events);
        // Output: what a renderer draws.
        game.pose(me, &mut joints)?;
        for event in &events {
            match event.kind {
                CharacterEventKind::MissedBy { metres, .. } => {
                    println!("{:.2} s: missed by {metres:.2} m", event.time)
                }
                CharacterEventKind::Hit { .. } => println!("{:.2} s: hit", event.time),
                _ => {}
            }
        }
    }
    Ok(())
}
