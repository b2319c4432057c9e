//! No input bytes crash a reader, and input that is accepted can be used. The inputs are the
//! corpora of the fuzzers (`tests/fuzz`) and random damage of them.

use std::path::PathBuf;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use sabaki_fixtures::memory::{alone, held_at_most};
use sabaki_fixtures::small::small;

use super::targets;

/// Bytes that a target may hold, however small its input is.
pub(super) const MOST: usize = 300 << 20;

/// The inputs of a target, by name; of baked files the small graph too.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/corpus")
        .join(target);
    let files = std::fs::read_dir(folder).unwrap();
    let read = |path: PathBuf| (path.display().to_string(), std::fs::read(&path).unwrap());
    let inputs = files.map(|entry| read(entry.unwrap().path()));
    let mut inputs: Vec<(String, Vec<u8>)> = inputs.collect();
    inputs.sort();
    if target == "baked" {
        let bytes = sabaki::archive::to_bytes(small()).unwrap();
        inputs.push(("small".to_owned(), targets::without_header(&bytes).to_vec()));
    }
    inputs
}

#[test]
fn the_corpora_are_read_in_bounded_memory() {
    alone(|| {
        // So that it is made once, and not counted.
        small();
        for (target, run) in targets::TARGETS {
            let inputs = corpus(target);
            assert!(!inputs.is_empty(), "{target}");
            for (name, input) in inputs {
                let ((), held) = held_at_most(|| run(&input));
                assert!(held < MOST, "{name}: {} MB", held >> 20);
            }
        }
    });
}

/// What is done to an input at a place, a share of its length.
#[derive(Clone, Debug)]
enum Damage {
    Flip(f64, u8),
    Set(f64, u8),
    Cut(f64, usize),
    Repeat(f64, usize),
    Insert(f64, Vec<u8>),
    /// The next number of the text becomes a word.
    Number(f64, &'static str),
}

/// Inputs that break readers: numbers at the ends of their ranges, and brackets that are never closed.
const WORDS: &str = "-1|0|1e39|-1e-45|NaN|inf|4294967296|18446744073709551615|{|}|[|\"|\\u0000|JOINT x\n{\n|null|\u{e9}";

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let word = || prop::sample::select(WORDS.split('|').collect::<Vec<_>>());
    let bytes = word().prop_map(|word| word.as_bytes().to_vec());
    let bytes = prop_oneof![bytes, prop::collection::vec(any::<u8>(), 1..9)];
    let place = || 0.0..1.0f64;
    let damage = prop_oneof![
        (place(), 0u8..8).prop_map(|(at, bit)| Damage::Flip(at, bit)),
        (place(), any::<u8>()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        (place(), 1usize..40).prop_map(|(at, length)| Damage::Cut(at, length)),
        (place(), 1usize..200).prop_map(|(at, length)| Damage::Repeat(at, length)),
        (place(), bytes).prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        (place(), word()).prop_map(|(at, word)| Damage::Number(at, word)),
    ];
    prop::collection::vec(damage, 1..6)
}

fn damaged(input: &[u8], damages: &[Damage]) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for damage in damages {
        let place = |share: f64| (share * bytes.len() as f64) as usize;
        match damage {
            _ if bytes.is_empty() => {}
            Damage::Flip(at, bit) => {
                let at = place(*at);
                bytes[at] ^= 1 << bit;
            }
            Damage::Set(at, byte) => {
                let at = place(*at);
                bytes[at] = *byte;
            }
            Damage::Cut(at, length) => {
                let at = place(*at);
                bytes.drain(at..(at + length).min(bytes.len()));
            }
            Damage::Repeat(at, length) => {
                let at = place(*at);
                let part = bytes[at..(at + length).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            Damage::Insert(at, insert) => {
                let at = place(*at);
                bytes.splice(at..at, insert.iter().copied());
            }
            Damage::Number(at, word) => {
                let is_digit = |byte: &&u8| byte.is_ascii_digit();
                let from = place(*at);
                let from = from + bytes[from..].iter().take_while(|b| !is_digit(b)).count();
                let digits = bytes[from..].iter().take_while(is_digit).count();
                bytes.splice(from..from + digits, word.bytes());
            }
        }
    }
    bytes
}

/// Damages a target's corpus a number of times: what is left is refused or can be used.
fn damage(target: &str, cases: u32) {
    let run = targets::of_name(target);
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let strategy = (prop::sample::select(corpus(target)), damages());
    let tried = TestRunner::new(config).run(&strategy, |((_, input), damages)| {
        run(&damaged(&input, &damages));
        Ok(())
    });
    tried.unwrap();
}

#[test]
fn damaged_motion_files() {
    for target in ["bvh", "gltf", "asf"] {
        damage(target, 4000);
    }
}

#[test]
fn damaged_events_and_meshes() {
    damage("events", 4000);
    damage("obj", 4000);
}

#[test]
fn damaged_attacks_and_graphs() {
    damage("attack", 1500);
    damage("baked", 1500);
}
