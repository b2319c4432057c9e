//! # Concept
//! A saved game continues bit-identically: what `load` restores plays the same poses as the game that went on.
//!
//! # Usage
//! `cargo run --release --example save_and_load -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `save` writes characters, threats and time as bytes. The graph is not in them.
//! 2. `load` reads them into `Characters` with the same graph and settings. Bytes that are damaged, of another graph, or of a version
//!    that saves something else are refused.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use glam::Vec3;
use sabaki::anim::Pose;
use sabaki::character::{CharacterError, CharacterId, CharacterSettings, Characters, Goal, Threat};
use sabaki::math::Rigid2;

/// Ten seconds of a walk under fire, and the pose at their end.
fn play(game: &mut Characters, player: CharacterId) -> Result<Pose, CharacterError> {
    for frame in 0..60 * 10 {
        let (velocity, facing) = (Vec3::Z * 1.2, None);
        game.steer(player, Goal::Walk { velocity, facing })?;
        if frame % 150 == 60 {
            let place = game.place(player)?;
            let target = Vec3::new(place.x, 1.3, place.z + 1.2);
            let from = target + Vec3::new(5.0, 0.2, 3.0);
            let thrown = game.now() + 0.3;
            game.threaten(Threat::ball(thrown, from, (target - from) / 0.7, 0.1))?;
        }
        game.step(1.0 / 60.0, &[], &mut Vec::new());
    }
    let mut pose = Pose::default();
    game.local_pose(player, &mut pose)?;
    Ok(pose)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = Arc::new(common::baked()?);
    let mut game = Characters::new(Arc::clone(&baked), CharacterSettings::default())?;
    let player = game.spawn(Rigid2::IDENTITY)?;
    play(&mut game, player)?;
    let bytes = game.save()?;
    println!("{} bytes after {:.1} s", bytes.len(), game.now());

    let mut loaded = Characters::new(baked, CharacterSettings::default())?;
    loaded.load(&bytes)?;
    let same = play(&mut game, player)? == play(&mut loaded, player)?;
    println!("ten seconds later, bit-identical: {same}");

    let refused = loaded.load(&bytes[1..]).err();
    println!("damaged bytes: {}", refused.ok_or("they were taken")?);
    Ok(())
}
