//! Promise: what is saved goes on to the same bit, in bytes and by serde; damaged bytes are refused or harmless.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki::character::{CharacterEventKind, CharacterSettings, Characters, CharactersState};
use sabaki_testing::random::Random;

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

#[test]
fn damaged_bytes_are_refused_or_harmless() {
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
        match game.load(&damaged) {
            Ok(()) => drop(play(&mut game, 2)),
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 100, "{refused}");
}
