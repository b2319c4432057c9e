//! # Concept
//! Two characters of one graph fight: one strikes, the other one dodges, and the roles change. A blow is an attack like a ball: spheres
//! that move through space.
//!
//! # Usage
//! `cargo run --release --example two_fighters -- out/fighter.sabaki`
//!
//! `cargo run --release` writes that file. `cargo run --release -- bake --clips clips/ --events events.json --out fighter.sabaki` bakes
//! your own clips.
//!
//! # How it works
//! 1. `AttackGrid` knows, for each node of the graph and each cell of space around it, which path strikes there soonest.
//! 2. `Duel::challenge` lets the fighters step about until a blow would land, and announces it.
//! 3. A query answers it. Any culling path will do; here it is the CPU's.
//! 4. `Duel::settle` plays both.

#[path = "common/baked.rs"]
mod common;

use sabaki::duel::{Duel, DuelSettings};
use sabaki::maps::{AttackGrid, AttackGridSettings};
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let baked = common::baked()?;
    let grid = AttackGrid::new(&baked, &AttackGridSettings::default());
    let mut duel = Duel::new(&baked, &grid, &DuelSettings::default())?;
    let settings = QuerySettings::default();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    while duel.exchanges().len() < 8 {
        let challenge = duel.challenge()?;
        Query::new(&baked, &settings).answer(challenge.request(), &mut context, &mut answer);
        if let Some(exchange) = duel.settle(&challenge, &answer) {
            println!(
                "{:?} strikes; avoided: {}, by {:.2} m",
                exchange.attacker,
                exchange.avoided,
                answer.clearance().metres
            );
        }
    }
    Ok(())
}
