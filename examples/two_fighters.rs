//! # Concept
//! Two characters fight: one strikes, the other one dodges, and the roles change. A striking limb is a threat like a ball.
//!
//! # Usage
//! `cargo run --release --example two_fighters -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `Goal::Strike` lets a character come into reach of the other one, and strike with the attacks of the clips.
//! 2. The other one sees the limb from the beginning of the strike on, and dodges by itself.
//! 3. `Struck` and `MissedBy` say how it went. When the strike has ended, it is the other one's turn.

#[path = "common/baked.rs"]
mod common;

use std::sync::Arc;

use sabaki::character::{
    CharacterEventKind, CharacterSettings, Characters, Goal, StrikeAt, StrikeKind,
};
use sabaki::math::Rigid2;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings = CharacterSettings {
        body_radius: 0.15,
        ..CharacterSettings::default()
    };
    let mut game = Characters::new(Arc::new(common::baked()?), settings)?;
    let white = game.spawn(Rigid2::new(0.0, 0.0, -0.5))?;
    let blue = game.spawn(Rigid2::new(std::f32::consts::PI, 0.0, 0.5))?;
    let (mut striker, mut other, mut strikes) = (white, blue, 0);
    let mut events = Vec::new();
    let kind = StrikeKind::Any;
    let at = StrikeAt::Character(other);
    game.steer(striker, Goal::Strike { at, kind })?;
    while strikes < 8 && game.now() < 60.0 {
        events.clear();
        game.step(1.0 / 60.0, &[], &mut events);
        for event in &events {
            let name = if event.character == white {
                "white"
            } else {
                "blue"
            };
            match event.kind {
                CharacterEventKind::Strikes { contact, .. } => {
                    let lead = contact - event.time;
                    println!(
                        "{:6.2} s: {name} strikes, seen {lead:.2} s before",
                        event.time
                    );
                }
                CharacterEventKind::MissedBy { metres, .. } => {
                    println!("{:6.2} s: {name} is missed by {metres:.2} m", event.time);
                }
                CharacterEventKind::Struck { speed, .. } => {
                    println!("{:6.2} s: {name} is struck at {speed:.1} m/s", event.time);
                }
                CharacterEventKind::StrikeEnded { .. } => {
                    strikes += 1;
                    game.steer(striker, Goal::Idle)?;
                    (striker, other) = (other, striker);
                    let at = StrikeAt::Character(other);
                    game.steer(striker, Goal::Strike { at, kind })?;
                }
                _ => {}
            }
        }
    }
    Ok(())
}
