//! Promise: the stencil culling path counts what the CPU's counts, texel for texel, for any
//! candidates, slabs and placements.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::cull::{GRIDS, any_input, atlas, atlas_on, attack, candidates, counted, culler};
use common::cull_cases::{self, Way};
use common::maps::attack_of;
use common::{FALLBACK_FORMATS, Random, device, device_on, drifting, finish};
use sabaki::gpu::{Counting, CullerDesc, GpuError, StencilSettings, Terms};
use sabaki::internal::{AttackDrawing, AttackLayer, CullCandidate, TimedDisc};
use sabaki::maps::{Disc, MapGrid, MapRect, RegionId, Slab};
use sabaki::query::cull::{Counted, CullInput, Overlap};

#[test]
fn thousands_of_random_candidates_agree() {
    cull_cases::random_candidates_agree(Way::STENCIL);
    cull_cases::random_candidates_agree(Way::ATOMICS);
}

#[test]
fn edges_of_the_input_agree() {
    cull_cases::edges_agree(Way::STENCIL);
    cull_cases::edges_agree(Way::ATOMICS);
}

#[test]
fn atlases_without_a_map_agree() {
    cull_cases::atlases_without_a_map_agree(Way::STENCIL);
    cull_cases::atlases_without_a_map_agree(Way::ATOMICS);
}

#[test]
fn slots_in_flight_keep_their_own_counts() {
    cull_cases::slots_in_flight_keep_their_own_counts(Way::STENCIL);
    cull_cases::slots_in_flight_keep_their_own_counts(Way::ATOMICS);
}

#[test]
fn a_batch_counts_what_its_culls_count_alone() {
    cull_cases::a_batch_counts_what_its_culls_count_alone(Way::STENCIL);
    cull_cases::a_batch_counts_what_its_culls_count_alone(Way::ATOMICS);
}

#[test]
fn thousands_of_drawn_candidates_agree() {
    let mut device = device();
    for (grid, seed) in GRIDS.into_iter().zip(20..) {
        let mut random = Random(seed);
        let atlas = atlas_on(grid, &mut random, 20);
        let mut cullers = [Way::STENCIL, Way::ATOMICS].map(|way| {
            let desc = CullerDesc {
                max_candidates: 64,
                ..way.desc(&atlas)
            };
            culler(&mut device, &desc)
        });
        let (mut met, mut met_outer, mut met_evasion, mut missed) = (0, 0, 0, 0);
        for _ in 0..10 {
            let (attack, candidates) = any_input(&mut random, &atlas, 100);
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates,
            };
            let expected = counted(&input);
            met += expected.iter().filter(|one| one.body > 0).count();
            met_outer += expected.iter().filter(|one| one.outer > 0).count();
            met_evasion += expected.iter().filter(|one| one.evasion > 0).count();
            missed += expected.iter().filter(|one| one.body == 0).count();
            for culler in &mut cullers {
                assert_eq!(device.cull(culler, &input).unwrap(), expected);
            }
        }
        // The test means something only if there is some of each.
        assert!(
            met > 40 && met_outer > 40 && met_evasion > 40 && missed > 100,
            "{grid:?}: {met} {met_outer} {met_evasion} {missed}"
        );
        for culler in cullers {
            culler.destroy(device.memory().unwrap());
        }
    }
    finish(device);
}

/// Candidates are drawn along a band, and not where their maps miss it.
#[test]
fn attacks_that_cross_at_any_angle_agree() {
    let mut device = device();
    for (grid, seed) in GRIDS.into_iter().zip(70..) {
        let mut random = Random(seed);
        let atlas = atlas_on(grid, &mut random, 20);
        let mut cullers =
            [Way::STENCIL, Way::ATOMICS].map(|way| culler(&mut device, &way.desc(&atlas)));
        let (mut met, mut missed) = (0, 0);
        for _ in 0..12 {
            let rect = MapRect {
                u: random.int(-60, 0),
                v: random.int(-60, 0),
                width: random.int(40, 130) as u32,
                height: random.int(40, 130) as u32,
            };
            let attack = band(&mut random, grid, rect);
            let candidates = candidates(&mut random, &atlas, rect, 150);
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates,
            };
            let expected = counted(&input);
            let meets = |one: &&Overlap| one.body > 0 || one.evasion > 0;
            met += expected.iter().filter(meets).count();
            missed += expected.iter().filter(|one| one.outer == 0).count();
            for culler in &mut cullers {
                assert_eq!(device.cull(culler, &input).unwrap(), expected, "{grid:?}");
            }
        }
        // The test means something only if there is some of each.
        assert!(met > 100 && missed > 100, "{grid:?}: {met} {missed}");
        for culler in cullers {
            culler.destroy(device.memory().unwrap());
        }
    }
    finish(device);
}

/// A sphere that crosses some slabs along a line, partly outside of its rectangle.
fn band(random: &mut Random, grid: MapGrid, rect: MapRect) -> AttackDrawing {
    const STEPS: i32 = 40;
    let mut attack = AttackDrawing {
        rect,
        ..AttackDrawing::default()
    };
    let ends = [rect.width, rect.height].map(|side| {
        let side = 16 * side as i32;
        [0, 1].map(|_| random.int(-100, side + 100))
    });
    let radius = random.int(10, 120);
    for slab in 0..4 {
        let mut discs = |radius: i32| {
            let first = attack.discs.len() as u32;
            attack.discs.extend((0..STEPS).map(|step| {
                let [x, z] = ends.map(|[start, end]| start + (end - start) * step / STEPS);
                TimedDisc {
                    disc: Disc { x, z, radius },
                    slice: step as u32 * grid.slices / STEPS as u32,
                }
            }));
            first..attack.discs.len() as u32
        };
        let (inner, outer) = (discs(radius), discs(radius + 20));
        attack.layers.push(AttackLayer {
            slab: Slab(slab),
            clock: 0,
            inner,
            outer,
        });
    }
    attack
}

#[test]
fn small_targets_pools_and_buffers_agree() {
    let mut device = device();
    for (grid, seed) in GRIDS.into_iter().zip(40..) {
        let mut random = Random(seed);
        let atlas = atlas_on(grid, &mut random, 8);
        let whole = Way::STENCIL.desc(&atlas);
        let descs = [
            // Some planes; several passes, of cells that are cut; several turns of a pass.
            StencilSettings {
                target: [256, 128],
                ..whole.stencil
            },
            StencilSettings {
                target: [24, 40],
                ..whole.stencil
            },
            StencilSettings {
                max_queries: 7,
                ..whole.stencil
            },
            StencilSettings {
                target: [64, 64],
                max_queries: 1,
                max_boxes: 1500,
                ..whole.stencil
            },
        ];
        let summed = descs.map(|stencil| StencilSettings {
            counting: Some(Counting::Atomics),
            ..stencil
        });
        for stencil in descs.into_iter().chain(summed) {
            let desc = CullerDesc { stencil, ..whole };
            let mut culler = culler(&mut device, &desc);
            for _ in 0..2 {
                let (attack, candidates) = any_input(&mut random, &atlas, 20);
                let input = CullInput {
                    atlas: &atlas,
                    attack: &attack,
                    candidates: &candidates,
                };
                let counts = device.cull(&mut culler, &input).unwrap();
                assert_eq!(counts, counted(&input), "{grid:?} {stencil:?}");
            }
            culler.destroy(device.memory().unwrap());
        }
    }
    finish(device);
}

#[test]
fn what_is_not_counted_says_so() {
    let mut device = device();
    let mut random = Random(60);
    let atlas = atlas_on(MapGrid::default(), &mut random, 12);
    let none = Counted {
        body: false,
        outer: false,
        evasion: false,
        up_to_hits: false,
    };
    let desc = CullerDesc {
        counted: none,
        ..Way::STENCIL.desc(&atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let (attack, candidates) = any_input(&mut random, &atlas, 100);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    let expected = counted(&input);
    for bits in 0..8 {
        let counted = Counted {
            body: bits & 1 != 0,
            outer: bits & 2 != 0,
            evasion: bits & 4 != 0,
            up_to_hits: false,
        };
        if bits > 0 {
            culler.count_only(counted);
        }
        let counts = device.cull(&mut culler, &input).unwrap();
        for (found, expected) in counts.iter().zip(&expected) {
            let wanted = Overlap {
                body: if counted.body { expected.body } else { 0 },
                outer: if counted.outer {
                    expected.outer
                } else {
                    u32::MAX
                },
                evasion: if counted.evasion { expected.evasion } else { 0 },
            };
            assert_eq!(*found, wanted, "{counted:?}");
        }
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn the_maps_outlive_a_first_cull_that_is_never_submitted() {
    let mut device = device();
    let mut random = Random(61);
    let atlas = atlas(&mut random, 12);
    let mut culler = culler(&mut device, &Way::STENCIL.desc(&atlas));
    let rect = MapRect {
        u: -30,
        v: -30,
        width: 90,
        height: 70,
    };
    let attack = attack(&mut random, rect, 0..3);
    let candidates = candidates(&mut random, &atlas, rect, 100);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    let lost = device.run(|cmd| {
        // SAFETY: `run` gives a buffer that is being recorded.
        unsafe { culler.record(cmd, 0, &input) }?;
        Err::<(), _>(GpuError::Unfinished)
    });
    assert!(matches!(lost, Err(GpuError::Unfinished)));
    let expected = counted(&input);
    assert!(expected.iter().any(|one| one.body > 0));
    for _ in 0..2 {
        assert_eq!(device.cull(&mut culler, &input).unwrap(), expected);
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn every_stencil_format_agrees() {
    let mut random = Random(12);
    let atlas = atlas(&mut random, 10);
    let rect = MapRect {
        u: -40,
        v: -20,
        width: 70,
        height: 90,
    };
    let attack = attack(&mut random, rect, 0..4);
    let candidates = candidates(&mut random, &atlas, rect, 60);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    for (terms, format) in FALLBACK_FORMATS {
        let mut device = device_on(terms);
        assert_eq!(device.context().unwrap().stencil_format(), format);
        let mut culler = culler(&mut device, &Way::STENCIL.desc(&atlas));
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input), "{format:?}");
        culler.destroy(device.memory().unwrap());
        finish(device);
    }
}

#[test]
fn without_precise_queries_some_and_none_are_still_right() {
    let mut device = device_on(Terms {
        without_precise_queries: true,
        ..Terms::default()
    });
    let mut random = Random(5);
    let atlas = atlas(&mut random, 20);
    let mut culler = culler(&mut device, &Way::STENCIL.desc(&atlas));
    let rect = MapRect {
        u: -30,
        v: -30,
        width: 90,
        height: 70,
    };
    let attack = attack(&mut random, rect, 0..3);
    let candidates = candidates(&mut random, &atlas, rect, 200);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &candidates,
    };
    assert!(!culler.counts_exact());
    // SAFETY: `run` gives a buffer that is being recorded.
    let ticket = device
        .run(|cmd| unsafe { culler.record(cmd, 0, &input) })
        .unwrap();
    let mut overlaps = Vec::new();
    assert!(culler.poll(ticket, &mut overlaps).unwrap());
    for (found, expected) in overlaps.iter().zip(counted(&input)) {
        assert_eq!(found.body > 0, expected.body > 0);
        assert_eq!(found.evasion > 0, expected.evasion > 0);
    }
    // What scores are made of is counted all the same, by whoever can.
    for (found, expected) in device
        .cull(&mut culler, &input)
        .unwrap()
        .iter()
        .zip(counted(&input))
    {
        assert_eq!(found.body > 0, expected.body > 0);
        assert_eq!(found.evasion, expected.evasion);
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let mut device = device();
    let mut random = Random(6);
    let atlas = atlas(&mut random, 4);
    let desc = CullerDesc {
        max_candidates: 8,
        stencil: StencilSettings {
            max_discs: 100,
            ..StencilSettings::default()
        },
        ..Way::STENCIL.desc(&atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let rect = MapRect {
        u: -32,
        v: -32,
        width: 64,
        height: 64,
    };
    // Inner and outer discs alike.
    let of_discs = |random: &mut Random, discs: usize| {
        attack_of([(Slab(1), drifting(random, rect, discs, 1))])
    };
    let fits = of_discs(&mut random, 50);
    let discs = of_discs(&mut random, 80);
    let few = candidates(&mut random, &atlas, rect, 8);
    let many = candidates(&mut random, &atlas, rect, 9);
    let mut stranger = few.clone();
    stranger[3].region = RegionId(4);

    let mut refused = |attack: &AttackDrawing, candidates: &[CullCandidate]| {
        let input = CullInput {
            atlas: &atlas,
            attack,
            candidates,
        };
        // SAFETY: `run` gives a buffer that is being recorded.
        let result = device.run(|cmd| unsafe { culler.record(cmd, 0, &input) });
        result.map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(refused(&fits, &few), Ok(()));
    let says = |result: Result<(), String>, words: &str| {
        let error = result.unwrap_err();
        assert!(error.contains(words), "{error}");
    };
    says(refused(&fits, &many), "max_candidates: 9 needed, 8");
    says(refused(&discs, &few), "StencilSettings::max_discs");
    says(refused(&fits, &stranger), "candidate 3 names region 4");
    assert_eq!(refused(&fits, &few), Ok(()), "and the culler goes on");
    culler.destroy(device.memory().unwrap());

    let tight = CullerDesc {
        stencil: StencilSettings {
            max_boxes: 1,
            ..StencilSettings::default()
        },
        ..Way::STENCIL.desc(&atlas)
    };
    let mut tight = common::cull::culler(&mut device, &tight);
    let attack = attack(&mut random, rect, -1..6);
    let input = CullInput {
        atlas: &atlas,
        attack: &attack,
        candidates: &many,
    };
    // SAFETY: as above.
    let result = device.run(|cmd| unsafe { tight.record(cmd, 0, &input) });
    says(
        result.map(|_| ()).map_err(|error| error.to_string()),
        "StencilSettings::max_boxes",
    );
    tight.destroy(device.memory().unwrap());
    finish(device);
}
