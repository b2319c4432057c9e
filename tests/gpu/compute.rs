//! Promise: the compute culling path counts what the CPU's counts, texel for texel, for any
//! candidates, slabs, clocks, slices and placements; and recording allocates nothing once warm.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;
use sabaki_fixtures::memory as counting;

use common::cull::{counted, culler};
use common::cull_cases::{self, Way};
use common::timed::{Bounds, atlas, attack, candidates};
use common::{Random, desc, device, finish};
use counting::allocations;
use sabaki::gpu::{ComputeSettings, Culler, CullerDesc};
use sabaki::internal::{AttackDrawing, CullCandidate};
use sabaki::maps::{MapGrid, MapRect};
use sabaki::query::cull::{Counted, CullInput, Overlap};
use sabaki_fixtures::headless::{Headless, HeadlessDesc};

const RECT: MapRect = MapRect {
    u: -30,
    v: -25,
    width: 90,
    height: 70,
};

#[test]
fn thousands_of_random_candidates_agree() {
    cull_cases::random_candidates_agree(Way::COMPUTE);
}

#[test]
fn edges_of_the_input_agree() {
    cull_cases::edges_agree(Way::COMPUTE);
}

#[test]
fn atlases_without_a_map_agree() {
    cull_cases::atlases_without_a_map_agree(Way::COMPUTE);
}

#[test]
fn slots_in_flight_keep_their_own_counts() {
    cull_cases::slots_in_flight_keep_their_own_counts(Way::COMPUTE);
}

#[test]
fn a_batch_counts_what_its_culls_count_alone() {
    cull_cases::a_batch_counts_what_its_culls_count_alone(Way::COMPUTE);
}

/// What is not counted says so, and a candidate that is hit is still one where no more is asked.
#[test]
fn what_is_asked_for_is_counted_alone() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(9);
    let atlas = atlas(&mut random, grid, 20);
    let attack = attack(
        &mut random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..4,
        },
    );
    let candidates = candidates(&mut random, &atlas, RECT, 200);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    let whole = counted(&input);
    assert!(whole.iter().any(|one| one.body > 0) && whole.iter().any(|one| one.body == 0));
    let mut culler = culler(&mut device, &Way::COMPUTE.desc(&atlas));
    for bits in 0..16 {
        let wanted = Counted {
            body: bits & 1 != 0,
            outer: bits & 2 != 0,
            evasion: bits & 4 != 0,
            up_to_hits: bits & 8 != 0,
        };
        culler.count_only(wanted);
        let counts = device.cull(&mut culler, &input).unwrap();
        for (found, whole) in counts.iter().zip(&whole) {
            if wanted.up_to_hits && wanted.body && whole.body > 0 {
                assert!((1..=whole.body).contains(&found.body), "{wanted:?}");
                continue;
            }
            let expected = Overlap {
                body: if wanted.body { whole.body } else { 0 },
                outer: if wanted.outer { whole.outer } else { u32::MAX },
                evasion: if wanted.evasion { whole.evasion } else { 0 },
            };
            assert_eq!(*found, expected, "{wanted:?}");
        }
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

/// More planes and blocks than one chunk of the attack holds.
#[test]
fn attacks_of_many_chunks_agree() {
    let mut device = device();
    let grid = MapGrid {
        slices: 64,
        ..MapGrid::default()
    };
    let mut random = Random(10);
    let atlas = atlas(&mut random, grid, 10);
    let rect = MapRect {
        u: -200,
        v: -150,
        width: 400,
        height: 300,
    };
    let mut attack = attack(&mut random, grid, Bounds { rect, slabs: -1..7 });
    for one in &mut attack.discs {
        one.disc.radius += 1000;
    }
    let candidates = candidates(&mut random, &atlas, rect, 90);
    let desc = CullerDesc {
        compute: ComputeSettings {
            max_blocks: 1 << 20,
            ..ComputeSettings::default()
        },
        ..Way::COMPUTE.desc(&atlas)
    };
    let mut culler = culler(&mut device, &desc);
    for some in [1, 90] {
        let input = CullInput {
            atlas: &atlas,
            attack: &attack,
            candidates: &candidates[..some],
        };
        let expected = counted(&input);
        assert!(some == 1 || expected.iter().any(|one| one.body > 0));
        assert_eq!(device.cull(&mut culler, &input).unwrap(), expected);
    }
    culler.destroy(device.memory().unwrap());
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
    let attack = attack(
        &mut random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..4,
        },
    );
    let candidates = candidates(&mut random, &atlas, RECT, 700);
    let all = (u32::MAX, u64::MAX);
    let shapes = [
        (1, (1, 400_000)),
        (300, (7, 2_000_000)),
        (1000, (1, u64::MAX)),
    ];
    for direct_input in [false, true] {
        for (max_candidates, (max_groups, max_page)) in shapes.into_iter().chain([(1000, all)]) {
            let desc = CullerDesc {
                max_candidates,
                compute: ComputeSettings {
                    max_groups,
                    max_page,
                    direct_input,
                    ..ComputeSettings::default()
                },
                ..Way::COMPUTE.desc(&atlas)
            };
            let mut culler = culler(&mut device, &desc);
            let some = if max_candidates == 1 { 40 } else { 700 };
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates[..some],
            };
            let counts = device.cull(&mut culler, &input).unwrap();
            let case = (direct_input, max_candidates, max_groups, max_page);
            assert_eq!(counts, counted(&input), "{case:?}");
            culler.destroy(device.memory().unwrap());
        }
    }
    finish(device);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(6);
    let atlas = atlas(&mut random, grid, 4);
    let attack = attack(
        &mut random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..3,
        },
    );
    let candidates = candidates(&mut random, &atlas, RECT, 9);
    let desc = CullerDesc {
        max_candidates: 8,
        compute: ComputeSettings {
            max_blocks: 4,
            ..ComputeSettings::default()
        },
        ..Way::COMPUTE.desc(&atlas)
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
    assert!(refused(&attack, &candidates[..1], 0).starts_with("ComputeSettings::max_blocks"));
    assert!(refused(&wide, &candidates[..1], 0).starts_with("side of an attack's maps"));
    assert!(refused(&none, &unknown[..4], 0).contains("candidate 2 names region 4"));
    assert!(refused(&none, &[], 2).contains("slot 2 of 2"));
    let input = CullInput {
        atlas: &atlas,
        attack: &none,
        candidates: &candidates[..8],
    };
    let counts = device.cull(&mut culler, &input).unwrap();
    assert_eq!(counts, counted(&input), "it is of use all the same");
    culler.destroy(device.memory().unwrap());

    let small = CullerDesc {
        compute: ComputeSettings {
            max_page: 4096,
            ..ComputeSettings::default()
        },
        ..Way::COMPUTE.desc(&atlas)
    };
    let made = device.make(|context, memory| Culler::new(context, memory, &small));
    let why = made.unwrap_err().to_string();
    assert!(why.starts_with("ComputeSettings::max_page"), "{why}");
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
    let attack = attack(
        &mut random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..3,
        },
    );
    let candidates = candidates(&mut random, &atlas, RECT, 100);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    let mut culler = culler(&mut device, &Way::COMPUTE.desc(&atlas));
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
