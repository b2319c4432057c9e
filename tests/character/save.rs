//! Promise: a saved game continues bit-identically, in bytes and by serde; damaged bytes are refused or harmless.

use glam::Vec3;
use sabaki::character::{CharacterEventKind, CharacterSettings, Characters};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;
use serde_json::Value;

use super::world::{characters, count, game, play, play_from_saved, spawn, throw_at, walk};

/// A goal is changed two frames later.
fn delayed() -> CharacterSettings {
    with(|s: &mut CharacterSettings| s.delay = 2)
}

/// Characters in the middle of a dodge.
fn dodging() -> Characters {
    let mut random = Random::new(17);
    let mut characters = characters(delayed());
    let ids = spawn::<4>(&mut characters);
    play(&mut characters, 50);
    throw_at(&mut characters, &ids, &mut random);
    let events = play(&mut characters, 12);
    let planned = |kind| matches!(kind, CharacterEventKind::Planned { .. });
    assert!(count(&events, planned) > 0);
    characters
}

#[test]
fn what_is_saved_goes_on_to_the_same_bit() {
    play_from_saved(&mut dodging(), delayed(), 100);
}

#[test]
fn what_is_saved_does_not_depend_on_the_threads() {
    let [mut game, mut shared] = [1, 2].map(|threads| {
        characters(CharacterSettings {
            threads,
            ..delayed()
        })
    });
    let ids = spawn::<8>(&mut game);
    assert_eq!(spawn(&mut shared), ids);
    for round in 0..8 {
        for game in [&mut game, &mut shared] {
            throw_at(game, &ids, &mut Random::new(31 + round));
        }
        assert_eq!(play(&mut game, 60), play(&mut shared, 60));
        let same = game.save().unwrap() == shared.save().unwrap();
        assert!(same, "round {round}");
    }
}

/// Writes the checksum of what follows it.
fn seal(saved: &mut [u8]) {
    let checksum = crc32fast::hash(&saved[16..]);
    saved[12..16].copy_from_slice(&checksum.to_le_bytes());
}

#[test]
fn damaged_bytes_are_refused_and_those_with_a_checksum_are_harmless() {
    let bytes = dodging().save().unwrap();
    let mut random = Random::new(23);
    let mut game = characters(delayed());
    let mut refused = 0;
    for _ in 0..300 {
        let mut damaged = bytes.clone();
        match random.below(3) {
            0 => damaged.truncate(random.below(bytes.len())),
            _ => damaged[random.below(bytes.len())] ^= 1 << random.below(8),
        }
        assert!(game.load(&damaged).is_err());
        if damaged.len() > 16 {
            seal(&mut damaged);
        }
        match game.load(&damaged) {
            Ok(()) => drop(play(&mut game, 2)),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 100, "{refused}");
}

#[test]
fn what_is_not_a_saved_game_of_this_graph_is_refused_by_name() {
    let bytes = dodging().save().unwrap();
    let mut game = characters(delayed());
    let mut refusal = |bytes: &[u8]| game.load(bytes).unwrap_err().to_string();
    let graph = sabaki::archive::to_bytes(embedded()).unwrap();
    assert_eq!(refusal(&graph), "the saved state is a baked graph");
    assert_eq!(refusal(&[]), "the saved state is too short");
    let mut other = bytes.clone();
    other[8] += 1;
    let words = "the saved state was written by another version of sabaki";
    assert_eq!(refusal(&other), words);
    other = bytes.clone();
    // The number of graphs comes first, then that of the graph.
    other[17] ^= 1;
    seal(&mut other);
    assert_eq!(refusal(&other), "the saved state belongs to another graph");
}

/// Moves all that stands in the world.
fn moved(state: &mut Value, by: f64) {
    match state {
        Value::Object(fields) if fields.contains_key("cos") => {
            fields["z"] = (fields["z"].as_f64().unwrap() + by).into();
        }
        Value::Object(fields) => fields.values_mut().for_each(|field| moved(field, by)),
        Value::Array(items) => items.iter_mut().for_each(|item| moved(item, by)),
        _ => {}
    }
}

#[test]
fn a_game_far_from_the_origin_is_saved() {
    let (mut game, []) = game::<0>();
    let id = game.spawn(Rigid2::new(0.0, 0.0, 4_999.0)).unwrap();
    game.steer(id, walk(Vec3::Z * 4.0)).unwrap();
    play(&mut game, 100);
    // Where it would be after an hour.
    let mut state = serde_json::to_value(game.state()).unwrap();
    moved(&mut state, 5_200.0);
    let state = serde_json::from_value(state).unwrap();
    game.restore(state).unwrap();
    play(&mut game, 100);
    assert!(game.place(id).unwrap().z > 10_100.0);
    play_from_saved(&mut game, CharacterSettings::default(), 100);
}
