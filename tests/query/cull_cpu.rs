//! Promise: the CPU counts what the definition counts, texel for texel, with every instruction set,
//! for any maps, attacks and places.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::maps::oracle;
use common::random::Random;
use sabaki::internal::{AttackDrawing, AttackLayer, CullCandidate, TimedDisc};
use sabaki::maps::{
    BitMap, Disc, FixedTransform2, MapGrid, MapRect, MaskMap, RegionAtlas, RegionId, RegionMaps,
    Slab, SlabMaps,
};
use sabaki::math::{Isa, Rigid2};
use sabaki::query::cull::cpu::Culler;
use sabaki::query::cull::{CullInput, Overlap};

fn between(random: &mut Random, low: i32, high: i32) -> i32 {
    low + random.below((high - low + 1) as usize) as i32
}

fn share(random: &mut Random) -> f32 {
    random.below(1 << 20) as f32 / (1 << 20) as f32
}

fn rect(random: &mut Random, side: i32) -> MapRect {
    // One in ten is empty.
    let empty = random.below(10) == 0;
    MapRect {
        u: between(random, -side, side / 2),
        v: between(random, -side, side / 2),
        width: if empty {
            0
        } else {
            between(random, 1, side) as u32
        },
        height: between(random, 0, side) as u32,
    }
}

/// Blobs in some slices, or dust.
fn masks(random: &mut Random, grid: MapGrid) -> MaskMap {
    let rect = rect(random, 50);
    let mut map = MaskMap::new(rect, grid.lanes());
    if rect.width == 0 || rect.height == 0 {
        return map;
    }
    for _ in 0..random.below(120) {
        let (u, v) = (
            random.below(rect.width as usize) as i32,
            random.below(rect.height as usize) as i32,
        );
        let (slice, size) = (
            random.below(grid.slices as usize) as u32,
            between(random, 0, 9),
        );
        for dv in 0..=size {
            for du in 0..=size {
                if u + du < rect.width as i32 && v + dv < rect.height as i32 {
                    map.set(u + du, v + dv, slice);
                }
            }
        }
    }
    map
}

fn bits(random: &mut Random) -> BitMap {
    let map = masks(random, MapGrid::PAPER);
    let mut bits = BitMap::new(map.rect());
    for v in 0..map.rect().height as i32 {
        for u in 0..map.rect().width as i32 {
            if map.get(u, v) != 0 {
                bits.set(u, v);
            }
        }
    }
    bits
}

fn grid(slices: u32, attack_pitch: u32) -> MapGrid {
    MapGrid {
        texel: 0.02,
        attack_pitch,
        slices,
        ..MapGrid::default()
    }
}

/// Maps that have nothing to do with each other: not even that the outer one holds the others.
fn atlas(random: &mut Random, grid: MapGrid) -> RegionAtlas {
    let regions = (0..12).map(|_| RegionMaps {
        first_slab: Slab(between(random, -2, 2)),
        slabs: (0..random.below(9))
            .map(|_| SlabMaps {
                body: masks(random, grid),
                outer: masks(random, grid),
                evasion: bits(random),
            })
            .collect(),
        seconds: 1.0,
    });
    let regions = regions.collect();
    RegionAtlas::new(grid, regions, Vec::new())
}

fn attack(random: &mut Random, slices: u32) -> AttackDrawing {
    let mut attack = AttackDrawing {
        rect: rect(random, 70),
        ..AttackDrawing::default()
    };
    for clock in 0..1 + random.below(2) as u32 {
        let first = between(random, -3, 2);
        for slab in first..first + between(random, 0, 7) {
            let mut discs = |random: &mut Random| {
                let start = attack.discs.len() as u32;
                for _ in 0..random.below(20) {
                    let disc = Disc {
                        x: between(random, -200, 1300),
                        z: between(random, -200, 1300),
                        radius: between(random, 0, 200),
                    };
                    let slice = random.below(slices as usize) as u32;
                    attack.discs.push(TimedDisc { disc, slice });
                }
                start..attack.discs.len() as u32
            };
            let (inner, outer) = (discs(random), discs(random));
            attack.layers.push(AttackLayer {
                slab: Slab(slab),
                clock,
                inner,
                outer,
            });
        }
    }
    attack
}

fn candidate(random: &mut Random, grid: MapGrid, attack: &AttackDrawing) -> CullCandidate {
    let reach = [0.4, 0.4, 0.8, 3.0, 700.0][random.below(5)];
    let place = |random: &mut Random| (2.0 * share(random) - 1.0) * reach;
    let heading = match random.below(4) {
        // Along the axes, where texels fall on texels.
        0 => random.below(4) as f32 * std::f32::consts::FRAC_PI_2,
        _ => 7.0 * share(random),
    };
    let placement = Rigid2::new(heading, place(random), place(random));
    CullCandidate {
        region: RegionId(random.below(12) as u32),
        clock: random.below(2) as u32,
        transform: FixedTransform2::new(placement, attack.rect, grid),
        open: false,
    }
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
        let grid = grid(slices, [1, 2, 4][round / 6 % 3]);
        let atlas = atlas(&mut random, grid);
        let attack = attack(&mut random, slices);
        let candidates: Vec<_> = (0..200)
            .map(|_| candidate(&mut random, grid, &attack))
            .collect();
        let input = CullInput {
            atlas: &atlas,
            attack: &attack,
            candidates: &candidates,
        };
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
        met.iter().all(|&some| some > 150) && missed > 300,
        "{met:?} {missed}"
    );
}

#[test]
fn what_is_no_turn_and_what_is_not_there_is_counted_too() {
    let mut random = Random::new(18);
    let grid = grid(32, 2);
    let atlas = atlas(&mut random, grid);
    let attack = attack(&mut random, 32);
    let mut candidates: Vec<_> = (0..60)
        .map(|_| candidate(&mut random, grid, &attack))
        .collect();
    for (index, candidate) in candidates.iter_mut().enumerate() {
        let (a, b) = [(0, 0), (32_768, 32_768), (-60_000, 40_000), (0, 80_000)][index % 4];
        (candidate.transform.a, candidate.transform.b) = (a, b);
    }
    let (mut culler, mut overlaps) = (Culler::default(), vec![Overlap::default(); 3]);
    for (attack, candidates) in [
        (&attack, candidates.as_slice()),
        (&attack, &[]),
        (&AttackDrawing::default(), candidates.as_slice()),
        (&attack, candidates.as_slice()),
    ] {
        let input = CullInput {
            atlas: &atlas,
            attack,
            candidates,
        };
        culler.count(&input, &mut overlaps);
        assert_eq!(overlaps, oracle(&input));
    }
}
