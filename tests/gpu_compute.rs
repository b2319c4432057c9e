//! Promise: the compute culling path counts what the CPU's counts, texel for texel, for any
//! candidates, slabs, clocks, slices and placements; and recording allocates nothing once warm.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;
#[path = "common/counting.rs"]
mod counting;

use common::timed::{atlas, attack, candidates};
use common::{Random, desc, device, finish};
use counting::allocations;
use sabaki::avoid::cull::{AttackDrawing, AttackLayer, CullCandidate, CullInput, Overlap, cpu};
use sabaki::gpu::compute::{Culler, CullerDesc, InputWay};
use sabaki::gpu::{GpuError, Headless, HeadlessDesc, Mismatch};
use sabaki::region::{MapGrid, MapRect, RegionAtlas, Slab, SlabMaps};

/// Grids of 1 and 2 words a mask, full and not, timed and not.
fn grids() -> [MapGrid; 5] {
    let slices = |slices| MapGrid {
        slices,
        ..MapGrid::default()
    };
    [
        MapGrid::PAPER,
        slices(8),
        slices(32),
        slices(40),
        slices(64),
    ]
}

const RECT: MapRect = MapRect {
    u: -30,
    v: -25,
    width: 90,
    height: 70,
};

fn culler(device: &mut Headless, desc: &CullerDesc<'_>) -> Culler {
    device
        .make(|context, memory| Culler::new(context, memory, desc))
        .unwrap()
}

fn counted(input: &CullInput<'_>) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    cpu::count(input, &mut overlaps);
    overlaps
}

#[test]
fn thousands_of_random_candidates_agree() {
    let mut device = device();
    for (seed, grid) in (20..).zip(grids()) {
        let mut random = Random(seed);
        let atlas = atlas(&mut random, grid, 30);
        let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
        let (mut body, mut outer, mut evasion, mut missed) = (0, 0, 0, 0);
        for _ in 0..30 {
            let rect = MapRect {
                u: random.int(-80, 40),
                v: random.int(-80, 40),
                width: random.int(1, 130) as u32,
                height: random.int(1, 130) as u32,
            };
            let first = random.int(-2, 3);
            let slabs = first..first + random.int(1, 5);
            let attack = attack(&mut random, grid, (rect, slabs));
            let candidates = candidates(&mut random, &atlas, rect, 100);
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates,
            };
            let expected = counted(&input);
            body += expected.iter().filter(|one| one.body > 0).count();
            outer += expected.iter().filter(|one| one.outer > 0).count();
            evasion += expected.iter().filter(|one| one.evasion > 0).count();
            missed += expected.iter().filter(|one| one.outer == 0).count();
            assert_eq!(device.cull_compute(&mut culler, &input).unwrap(), expected);
        }
        // The test means something only if there is some of each.
        assert!(
            body > 100 && outer > 100 && evasion > 50 && missed > 100,
            "{} slices: {body} {outer} {evasion} {missed}",
            grid.slices
        );
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}

#[test]
fn edges_of_the_input_agree() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(3);
    let atlas = atlas(&mut random, grid, 12);
    let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
    let some = attack(&mut random, grid, (RECT, 0..4));
    let many = candidates(&mut random, &atlas, RECT, 300);
    let with_turn = |a: i32, b: i32| -> Vec<CullCandidate> {
        let mut turned = many.clone();
        for candidate in &mut turned {
            (candidate.turn.a, candidate.turn.b) = (a, b);
        }
        turned
    };
    // A candidate's borders through the middle of the attack, one texel further each time.
    let stepped: Vec<CullCandidate> = (-70..70)
        .flat_map(|step| {
            let mut candidate = many[0];
            candidate.turn.tz = step << 15;
            let (mut along, mut turned) = (candidate, candidate);
            (along.turn.a, along.turn.b, along.turn.tx) = (1 << 14, 0, 0);
            (turned.turn.a, turned.turn.b, turned.turn.tx) = (0, 1 << 14, 0);
            [along, turned]
        })
        .collect();
    let no_discs = AttackDrawing {
        discs: Vec::new(),
        layers: (some.layers.iter())
            .map(|layer| AttackLayer {
                inner: 0..0,
                outer: 0..0,
                ..*layer
            })
            .collect(),
        ..some.clone()
    };
    let mut other_clocks = some.clone();
    other_clocks
        .layers
        .iter_mut()
        .for_each(|layer| layer.clock += 77);
    let mut highest = some.clone();
    highest
        .layers
        .iter_mut()
        .for_each(|layer| layer.slab = Slab(i32::MAX));
    let mut mixed = some.clone();
    mixed.layers.reverse();
    let elsewhere = attack(&mut random, grid, (RECT, 50..53));
    let below = attack(&mut random, grid, (RECT, -9..-4));
    let (none, twice, small) = (
        with_turn(0, 0),
        with_turn(32_768, -32_768),
        with_turn(99, 1),
    );
    let cases: [(&str, &AttackDrawing, &[CullCandidate]); 15] = [
        ("no candidates", &some, &[]),
        ("no slabs", &AttackDrawing::default(), &many),
        ("neither", &AttackDrawing::default(), &[]),
        ("no discs", &no_discs, &many),
        ("clocks that no candidate has", &other_clocks, &many),
        ("a slab that no region has", &highest, &many),
        ("slabs above all regions", &elsewhere, &many),
        ("slabs below all regions", &below, &many),
        ("layers in any order", &mixed, &many),
        ("a turn that is none", &some, &none),
        ("a turn that makes larger", &some, &twice),
        ("a turn that makes small", &some, &small),
        ("borders", &some, &stepped),
        ("one", &some, &many[..1]),
        ("a whole cull after all that", &some, &many),
    ];
    for (case, attack, candidates) in cases {
        let input = CullInput {
            atlas: &atlas,
            attack,
            candidates,
        };
        let counts = device.cull_compute(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input), "{case}");
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn atlases_without_a_map_agree() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(8);
    let attack = attack(&mut random, grid, (RECT, 0..3));
    let mut emptied = atlas(&mut random, grid, 3).regions().to_vec();
    for region in &mut emptied {
        let maps = region.slabs.iter_mut();
        maps.for_each(|maps| *maps = SlabMaps::empty(grid.lanes()));
    }
    let of_empty_maps = RegionAtlas::new(grid, emptied, Vec::new());
    let no_regions = RegionAtlas::new(grid, Vec::new(), Vec::new());
    let some = candidates(&mut random, &of_empty_maps, RECT, 20);
    for (atlas, candidates) in [(&of_empty_maps, &some[..]), (&no_regions, &[])] {
        let mut culler = culler(&mut device, &CullerDesc::new("test", atlas));
        let input = CullInput {
            atlas,
            attack: &attack,
            candidates,
        };
        let counts = device.cull_compute(&mut culler, &input).unwrap();
        assert_eq!(counts, vec![Overlap::default(); candidates.len()]);
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}

#[test]
fn any_number_of_dispatches_and_culls_and_either_way_of_the_input_agree() {
    let mut device = device();
    let grid = MapGrid {
        slices: 64,
        ..MapGrid::default()
    };
    let mut random = Random(5);
    let atlas = atlas(&mut random, grid, 20);
    let attack = attack(&mut random, grid, (RECT, 0..4));
    let candidates = candidates(&mut random, &atlas, RECT, 700);
    for input_way in [InputWay::Staged, InputWay::Direct] {
        for (max_candidates, max_groups) in [(1, 1), (300, 7), (1000, 1), (1000, u32::MAX)] {
            let desc = CullerDesc {
                max_candidates,
                max_groups,
                input: input_way,
                ..CullerDesc::new("test", &atlas)
            };
            let mut culler = culler(&mut device, &desc);
            let some = if max_candidates == 1 { 40 } else { 700 };
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates[..some],
            };
            let counts = device.cull_compute(&mut culler, &input).unwrap();
            let case = (input_way, max_candidates, max_groups);
            assert_eq!(counts, counted(&input), "{case:?}");
            culler.destroy(device.memory().unwrap());
        }
    }
    finish(device);
}

#[test]
fn slots_in_flight_keep_their_own_counts() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(4);
    let atlas = atlas(&mut random, grid, 20);
    let desc = CullerDesc {
        frames_in_flight: 3,
        ..CullerDesc::new("test", &atlas)
    };
    let mut culler = culler(&mut device, &desc);
    for _ in 0..4 {
        let inputs: Vec<_> = (0..3)
            .map(|_| {
                let count = random.int(1, 120) as usize;
                (
                    attack(&mut random, grid, (RECT, 0..3)),
                    candidates(&mut random, &atlas, RECT, count),
                )
            })
            .collect();
        let input = |index: usize| CullInput {
            atlas: &atlas,
            attack: &inputs[index].0,
            candidates: &inputs[index].1,
        };
        let mut overlaps = Vec::new();
        let tickets = device
            .run(|cmd| {
                let mut tickets = Vec::new();
                for slot in 0..3 {
                    // SAFETY: `run` gives a buffer that is being recorded; the slots' earlier culls
                    // have been waited for.
                    let ticket = unsafe { culler.record(cmd, slot, &input(slot as usize)) }?;
                    assert!(!culler.poll(ticket, &mut overlaps)?, "nothing has run yet");
                    tickets.push(ticket);
                }
                Ok(tickets)
            })
            .unwrap();
        for index in [1, 0, 2] {
            assert!(culler.poll(tickets[index], &mut overlaps).unwrap());
            assert_eq!(overlaps, counted(&input(index)), "slot {index}");
        }
        // SAFETY: the first run has uploaded the maps, and it has been waited for.
        unsafe { culler.release_staging(device.memory().unwrap()) };
        // SAFETY: as above.
        let late = device
            .run(|cmd| unsafe { culler.record(cmd, 0, &input(2)) })
            .unwrap();
        assert!(matches!(
            culler.poll(tickets[0], &mut overlaps),
            Err(GpuError::Mismatch(Mismatch::Ticket))
        ));
        assert!(culler.poll(late, &mut overlaps).unwrap());
        assert_eq!(overlaps, counted(&input(2)));
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(6);
    let atlas = atlas(&mut random, grid, 4);
    let attack = attack(&mut random, grid, (RECT, 0..3));
    let candidates = candidates(&mut random, &atlas, RECT, 9);
    let desc = CullerDesc {
        max_candidates: 8,
        max_blocks: 4,
        ..CullerDesc::new("test", &atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let wide = AttackDrawing {
        rect: MapRect {
            width: MapGrid::MAX_SIDE + 1,
            ..RECT
        },
        ..AttackDrawing::default()
    };
    let mut unknown = candidates.clone();
    unknown[2].region.0 = 4;
    let mut refused = |attack: &AttackDrawing, candidates: &[CullCandidate], slot: u32| {
        let input = CullInput {
            atlas: &atlas,
            attack,
            candidates,
        };
        // SAFETY: `run` gives a buffer that is being recorded.
        let recorded = device.run(|cmd| unsafe { culler.record(cmd, slot, &input) });
        recorded.unwrap_err().to_string()
    };
    let none = AttackDrawing::default();
    assert!(refused(&none, &candidates, 0).starts_with("CullerDesc::max_candidates: 9 needed"));
    assert!(refused(&attack, &candidates[..1], 0).starts_with("CullerDesc::max_blocks"));
    assert!(refused(&wide, &candidates[..1], 0).starts_with("side of an attack's maps"));
    assert!(refused(&none, &unknown[..4], 0).contains("candidate 2 names region 4"));
    assert!(refused(&none, &[], 2).contains("slot 2 of 2"));
    let input = CullInput {
        atlas: &atlas,
        attack: &none,
        candidates: &candidates[..8],
    };
    let counts = device.cull_compute(&mut culler, &input).unwrap();
    assert_eq!(counts, counted(&input), "it is of use all the same");
    culler.destroy(device.memory().unwrap());

    assert_eq!(device.memory().unwrap().live_blocks(), 0);
    finish(device);
}

#[test]
fn a_cull_allocates_nothing() {
    // Without validation, which allocates for itself on this thread's behalf.
    let mut device = Headless::new(&HeadlessDesc {
        validation: false,
        ..desc()
    })
    .unwrap();
    let grid = MapGrid::default();
    let mut random = Random(1);
    let atlas = atlas(&mut random, grid, 6);
    let attack = attack(&mut random, grid, (RECT, 0..3));
    let candidates = candidates(&mut random, &atlas, RECT, 100);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
    let mut overlaps = Vec::new();
    for cull in 0..4 {
        let (ticket, recording) = device
            .run(|cmd| {
                let before = allocations();
                // SAFETY: `run` gives a buffer that is being recorded, and has waited for the cull
                // before.
                let ticket = unsafe { culler.record(cmd, 0, &input) }?;
                Ok((ticket, allocations() - before))
            })
            .unwrap();
        let before = allocations();
        assert!(culler.poll(ticket, &mut overlaps).unwrap());
        let polling = allocations() - before;
        if cull > 0 {
            assert_eq!((recording, polling), (0, 0), "cull {cull}");
        }
    }
    culler.destroy(device.memory().unwrap());
    assert!(device.destroy().is_empty());
}
