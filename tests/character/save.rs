//! Promise: a saved game continues bit-identically, in bytes and by serde; damaged bytes are refused or harmless.

use glam::Vec3;
use sabaki::character::{CharacterEventKind, CharacterSettings, Characters, CharactersState, Goal};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::random::Random;
use serde_json::Value;

use super::world::{ball, characters, play, spawn};

/// Characters in the middle of a dodge.
fn dodging() -> Characters {
    let mut random = Random::new(17);
    let mut characters = characters(CharacterSettings {
        delay: 2,
        ..CharacterSettings::default()
    });
    let ids = spawn(&mut characters, 4);
    play(&mut characters, 50);
    for &id in &ids {
        let threat = ball(&mut characters, id, &mut random);
        characters.threaten(threat).unwrap();
    }
    let events = play(&mut characters, 12);
    let planned = |kind: &CharacterEventKind| matches!(kind, CharacterEventKind::Planned { .. });
    assert!(events.iter().any(|event| planned(&event.kind)));
    characters
}

fn fresh() -> Characters {
    characters(CharacterSettings {
        delay: 2,
        ..CharacterSettings::default()
    })
}

#[test]
fn what_is_saved_goes_on_to_the_same_bit() {
    let mut game = dodging();
    let (bytes, text) = (
        game.save().unwrap(),
        serde_json::to_string(&game.state()).unwrap(),
    );
    let events = play(&mut game, 100);
    let end = game.save().unwrap();
    let mut from_bytes = fresh();
    from_bytes.load(&bytes).unwrap();
    assert_eq!(play(&mut from_bytes, 100), events);
    assert!(from_bytes.save().unwrap() == end);
    let mut from_text = fresh();
    let state: CharactersState = serde_json::from_str(&text).unwrap();
    from_text.restore(state).unwrap();
    assert_eq!(play(&mut from_text, 100), events);
    assert!(from_text.save().unwrap() == end);
}

#[test]
fn what_is_saved_does_not_depend_on_the_threads() {
    let with_threads = |threads| {
        characters(CharacterSettings {
            delay: 2,
            threads,
            ..CharacterSettings::default()
        })
    };
    let (mut game, mut shared) = (with_threads(1), with_threads(2));
    let ids = spawn(&mut game, 8);
    assert_eq!(spawn(&mut shared, 8), ids);
    let mut random = Random::new(31);
    for round in 0..8 {
        for &id in &ids {
            let threat = ball(&mut game, id, &mut random);
            game.threaten(threat.clone()).unwrap();
            shared.threaten(threat).unwrap();
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
    let mut game = fresh();
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
    let mut game = fresh();
    let mut refusal = |bytes: &[u8]| game.load(bytes).unwrap_err().to_string();
    let graph = sabaki::archive::to_bytes(embedded()).unwrap();
    assert_eq!(refusal(&graph), "the saved state is a baked graph");
    assert_eq!(refusal(&[]), "the saved state is too short");
    let mut other = bytes.clone();
    other[8] += 1;
    let words = "the saved state was written by another version of sabaki";
    assert_eq!(refusal(&other), words);
    other = bytes.clone();
    // The number of the graph comes first.
    other[16] ^= 1;
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
    let mut game = characters(CharacterSettings::default());
    let id = game.spawn(Rigid2::new(0.0, 0.0, 4_999.0)).unwrap();
    let velocity = Vec3::new(0.0, 0.0, 4.0);
    let facing = None;
    game.steer(id, Goal::Walk { velocity, facing }).unwrap();
    play(&mut game, 100);
    // Where it would be after an hour.
    let mut state = serde_json::to_value(game.state()).unwrap();
    moved(&mut state, 5_200.0);
    game.restore(serde_json::from_value(state).unwrap())
        .unwrap();
    play(&mut game, 100);
    assert!(game.place(id).unwrap().z > 10_100.0);
    let bytes = game.save().unwrap();
    let mut other = characters(CharacterSettings::default());
    other.load(&bytes).unwrap();
    play(&mut game, 100);
    play(&mut other, 100);
    assert!(game.save().unwrap() == other.save().unwrap());
}
