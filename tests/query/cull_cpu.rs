//! Promise: the CPU counts what the definition counts, texel for texel, with every instruction set,
//! for any maps, attacks and places.

use sabaki::maps::MapGrid;
use sabaki::math::Isa;
use sabaki::query::cull::cpu::Culler;
use sabaki::query::cull::{AttackDrawing, Overlap};
use sabaki_fixtures::cull::{CullCase, atlas, oracle};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;

fn grid(slices: u32) -> MapGrid {
    with(|s: &mut MapGrid| s.slices = slices)
}

#[test]
fn thousands_of_random_candidates_are_counted_by_every_instruction_set() {
    let mut random = Random::new(17);
    let mut cullers: Vec<_> = Isa::available()
        .map(|isa| (isa, Culler::with_isa(isa)))
        .collect();
    let (mut met, mut missed) = ([0; 3], 0);
    for round in 0..60 {
        let slices = [1, 2, 31, 32, 33, 64][round % 6];
        let grid = grid(slices);
        let atlas = atlas(&mut random, grid, 12);
        let case = CullCase::any(&mut random, &atlas, 200);
        let input = case.input(&atlas);
        let expected = oracle(&input);
        for (isa, culler) in &mut cullers {
            let mut overlaps = Vec::new();
            culler.count(&input, &mut overlaps);
            assert_eq!(overlaps, expected, "{isa:?}, round {round}");
        }
        let count = |of: fn(&Overlap) -> u32| expected.iter().filter(|one| of(one) > 0).count();
        met[0] += count(|one| one.body);
        met[1] += count(|one| one.outer);
        met[2] += count(|one| one.evasion);
        missed += expected
            .iter()
            .filter(|one| **one == Overlap::default())
            .count();
    }
    // The test means something only if there is some of each.
    assert!(
        missed > 300 && met.iter().all(|&some| some > 150),
        "{met:?}"
    );
}

#[test]
fn what_is_no_turn_and_what_is_not_there_is_counted_too() {
    let mut random = Random::new(18);
    let atlas = atlas(&mut random, grid(32), 12);
    let mut turned = CullCase::any(&mut random, &atlas, 60);
    for (index, candidate) in turned.candidates.iter_mut().enumerate() {
        let (a, b) = [(0, 0), (32_768, 32_768), (-60_000, 40_000), (0, 80_000)][index % 4];
        (candidate.transform.a, candidate.transform.b) = (a, b);
    }
    let (mut culler, mut overlaps) = (Culler::default(), vec![Overlap::default(); 3]);
    let mut input = turned.input(&atlas);
    let (attack, candidates) = (input.attack, input.candidates);
    for (attack, candidates) in [
        (attack, candidates),
        (attack, &[]),
        (&AttackDrawing::default(), candidates),
        (attack, candidates),
    ] {
        (input.attack, input.candidates) = (attack, candidates);
        culler.count(&input, &mut overlaps);
        assert_eq!(overlaps, oracle(&input));
    }
}
