//! Promise: every culling path of a device counts what the CPU's counts, texel for texel, for any candidates, slabs, clocks,
//! slices and placements; recording and polling allocate nothing once warm; what does not fit is refused by name.

use sabaki::gpu::{BatchEntry, Culler, CullerDesc, GpuError};
use sabaki::maps::{Disc, MapGrid, MapRect, RegionAtlas, Slab, SlabMaps};
use sabaki::query::cull::{
    AttackDrawing, AttackLayer, Counted, CullCandidate, CullInput, CullPath, Overlap, TimedDisc,
};
use sabaki_fixtures::cull::{
    CullCase, DEVICE_PATHS, GRIDS, atlas, attack, candidates, counted, culler, map_rect, sliced,
};
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::shim;
use sabaki_fixtures::with;
use sabaki_fixtures::{desc, device, finish};

use super::{destroy, each_culler, shimmed_device};

const RECT: MapRect = map_rect(-30, -25, 90, 70);

/// Calls `run` with a culler of each path, of as many slots, for an atlas of the default maps.
fn on_each_path(
    seed: u64,
    slots: u32,
    mut run: impl FnMut(&mut Headless, &mut Random, &RegionAtlas, (CullPath, &mut Culler)),
) {
    let (mut device, mut random) = (device(), Random::new(seed));
    let atlas = atlas(&mut random, MapGrid::default(), 20);
    let mut cullers = each_culler(&mut device, &atlas, slots);
    for (path, culler) in &mut cullers {
        run(&mut device, &mut random, &atlas, (*path, culler));
    }
    destroy(&mut device, cullers);
    finish(device);
}

#[test]
fn thousands_of_random_candidates_agree() {
    let mut device = device();
    for (seed, grid) in (20..).zip(GRIDS) {
        let mut random = Random::new(seed);
        let atlas = atlas(&mut random, grid, 30);
        let mut cullers = each_culler(&mut device, &atlas, 1);
        let mut all = Vec::new();
        for _ in 0..30 {
            let case = CullCase::any(&mut random, &atlas, 100);
            let expected = counted(&case.input(&atlas));
            all.extend_from_slice(&expected);
            for (path, culler) in &mut cullers {
                let counts = device.cull(culler, &case.input(&atlas)).unwrap();
                assert_eq!(counts, expected, "{path:?}, {grid:?}");
            }
        }
        // The test means something only if there is some of each.
        let count = |is: fn(&&Overlap) -> bool| all.iter().filter(is).count();
        let met = [
            count(|one| one.body > 0),
            count(|one| one.outer > 0),
            count(|one| one.evasion > 0),
        ];
        assert!(met.iter().all(|&some| some > 50), "{grid:?}: {met:?}");
        assert!(count(|one| one.outer == 0) > 100, "{grid:?}");
        destroy(&mut device, cullers);
    }
    finish(device);
}

/// Attacks of one kind of edge each.
fn odd_attacks(random: &mut Random, grid: MapGrid) -> Vec<(&'static str, AttackDrawing)> {
    let some = attack(random, grid, RECT, 0..4);
    let with_layers = |change: &dyn Fn(&mut AttackLayer)| {
        let mut changed = some.clone();
        changed.layers.iter_mut().for_each(change);
        changed
    };
    let mut no_discs = with_layers(&|layer| (layer.inner, layer.outer) = (0..0, 0..0));
    no_discs.discs.clear();
    let mut reversed = some.clone();
    reversed.layers.reverse();
    vec![
        ("no slabs", AttackDrawing::default()),
        ("no discs", no_discs),
        ("no texels", attack(random, grid, MapRect::default(), 0..2)),
        (
            "clocks that no candidate has",
            with_layers(&|layer| layer.clock += 77),
        ),
        (
            "a slab that no region has",
            with_layers(&|layer| layer.slab = Slab(i32::MAX)),
        ),
        (
            "slabs above all regions",
            attack(random, grid, RECT, 50..53),
        ),
        (
            "slabs below all regions",
            attack(random, grid, RECT, -9..-4),
        ),
        ("layers in any order", reversed),
        ("some", some),
    ]
}

/// Candidates of one kind of edge each.
fn odd_candidates(many: &[CullCandidate]) -> Vec<(&'static str, Vec<CullCandidate>)> {
    let with_turn = |a: i32, b: i32| -> Vec<CullCandidate> {
        let mut turned = many.to_vec();
        for candidate in &mut turned {
            (candidate.transform.a, candidate.transform.b) = (a, b);
        }
        turned
    };
    // A candidate's borders through the middle of the attack, one texel further each time.
    let stepped = (-70..70).flat_map(|step| {
        let mut candidate = many[0];
        candidate.transform.tz = step << 15;
        let (mut along, mut turned) = (candidate, candidate);
        (along.transform.a, along.transform.b, along.transform.tx) = (1 << 14, 0, 0);
        (turned.transform.a, turned.transform.b, turned.transform.tx) = (0, 1 << 14, 0);
        [along, turned]
    });
    vec![
        ("none", Vec::new()),
        ("one", many[..1].to_vec()),
        ("a turn that is none", with_turn(0, 0)),
        ("a turn that makes small", with_turn(99, 1)),
        ("borders", stepped.collect()),
        ("many", many.to_vec()),
    ]
}

/// Every odd attack against every odd set of candidates, one after the other with the same culler.
#[test]
fn edges_of_the_input_agree() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random::new(3);
    let atlas = atlas(&mut random, grid, 12);
    let mut cullers = each_culler(&mut device, &atlas, 1);
    let many = candidates(&mut random, &atlas, RECT, 120);
    for (attack_case, attack) in odd_attacks(&mut random, grid) {
        for (case, candidates) in odd_candidates(&many) {
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates,
            };
            let expected = counted(&input);
            for (path, culler) in &mut cullers {
                let counts = device.cull(culler, &input).unwrap();
                assert_eq!(counts, expected, "{path:?}: {attack_case}, {case}");
            }
        }
    }
    destroy(&mut device, cullers);
    finish(device);
}

/// Maps of no texels, and none at all.
#[test]
fn atlases_without_a_map_agree() {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random::new(8);
    let mut emptied = atlas(&mut random, grid, 3).regions().to_vec();
    for region in &mut emptied {
        let maps = region.slabs.iter_mut();
        maps.for_each(|maps| *maps = SlabMaps::empty(grid.lanes()));
    }
    let of_empty_maps = RegionAtlas::new(grid, emptied, Vec::new());
    let no_regions = RegionAtlas::new(grid, Vec::new(), Vec::new());
    for (atlas, count) in [(&of_empty_maps, 20), (&no_regions, 0)] {
        let mut cullers = each_culler(&mut device, atlas, 1);
        let case = CullCase::new(&mut random, atlas, RECT, 0..3, count);
        for (_, culler) in &mut cullers {
            let counts = device.cull(culler, &case.input(atlas)).unwrap();
            assert_eq!(counts, vec![Overlap::default(); count]);
        }
        destroy(&mut device, cullers);
    }
    finish(device);
}

/// Three culls in one command buffer, polled in any order; a ticket fits its cull alone.
#[test]
fn slots_in_flight_keep_their_own_counts() {
    on_each_path(4, 3, |device, random, atlas, (path, culler)| {
        for _ in 0..4 {
            let cases = [0; 3].map(|_| {
                let count = random.int(1, 120) as usize;
                CullCase::new(random, atlas, RECT, 0..3, count)
            });
            let mut overlaps = Vec::new();
            let tickets = device
                .run(|cmd| {
                    let mut tickets = Vec::new();
                    for (slot, case) in (0..).zip(&cases) {
                        // SAFETY: `run` gives a buffer that is being recorded; the slots' earlier culls have been waited for.
                        let ticket = unsafe { culler.record(cmd, slot, &case.input(atlas)) }?;
                        assert!(!culler.poll(ticket, &mut overlaps)?, "nothing has run yet");
                        tickets.push(ticket);
                    }
                    Ok(tickets)
                })
                .unwrap();
            for index in [1, 0, 2] {
                assert!(culler.poll(tickets[index], &mut overlaps).unwrap());
                let expected = counted(&cases[index].input(atlas));
                assert_eq!(overlaps, expected, "{path:?}, slot {index}");
            }
            // SAFETY: the first run has uploaded the maps, and it has been waited for.
            unsafe { culler.release_staging(device.memory().unwrap()) };
            let input = cases[2].input(atlas);
            // SAFETY: as above.
            let late = device.run(|cmd| unsafe { culler.record(cmd, 0, &input) });
            let stale = culler.poll(tickets[0], &mut overlaps);
            assert!(matches!(stale, Err(GpuError::StaleTicket)));
            assert!(culler.poll(late.unwrap(), &mut overlaps).unwrap());
            assert_eq!(overlaps, counted(&input));
        }
    });
}

/// As many culls as there are slots in one recording, in any order of slots; then again with fewer.
#[test]
fn a_batch_counts_what_its_culls_count_alone() {
    let slots = 9;
    on_each_path(7, slots, |device, random, atlas, (path, culler)| {
        for round in 0..3 {
            let one = |_| {
                let count = random.below(91);
                CullCase::new(random, atlas, RECT, 0..3, count)
            };
            let cases: Vec<_> = (0..slots - round).map(one).collect();
            let mut batch = Vec::new();
            for (index, case) in (0..).zip(&cases) {
                batch.push(BatchEntry {
                    slot: (index * 2 + round) % slots,
                    input: case.input(atlas),
                    ticket: None,
                });
            }
            // SAFETY: `run` gives a buffer that is being recorded, and has waited for the batch before.
            let recorded = device.run(|cmd| unsafe { culler.record_batch(cmd, &mut batch) });
            recorded.unwrap();
            let mut overlaps = Vec::new();
            for entry in &batch {
                let ticket = entry.ticket.unwrap();
                assert!(culler.poll(ticket, &mut overlaps).unwrap());
                assert_eq!(overlaps, counted(&entry.input), "{path:?}, round {round}");
            }
            let first = batch[0].slot;
            batch[1].slot = first;
            // SAFETY: as above.
            let twice = device.run(|cmd| unsafe { culler.record_batch(cmd, &mut batch) });
            assert!(matches!(twice, Err(GpuError::NoSuchSlot { slot, .. }) if slot == first));
        }
    });
}

/// What is not counted says so; by compute, a candidate that is hit is still one where no more is asked.
#[test]
fn what_is_asked_for_is_counted_alone() {
    on_each_path(9, 1, |device, random, atlas, (path, _)| {
        let case = CullCase::new(random, atlas, RECT, 0..4, 200);
        let input = case.input(atlas);
        let whole = counted(&input);
        assert!(whole.iter().any(|one| one.body > 0) && whole.iter().any(|one| one.body == 0));
        for bits in 0..16 {
            let wanted = Counted {
                body: bits & 1 != 0,
                outer: bits & 2 != 0,
                evasion: bits & 4 != 0,
                up_to_hits: bits & 8 != 0,
            };
            let mut desc = CullerDesc::new(path, atlas);
            (desc.counted, desc.max_blocks) = (wanted, 1 << 17);
            let mut culler = culler(device, &desc);
            let counts = device.cull(&mut culler, &input).unwrap();
            culler.destroy(device.memory().unwrap());
            for (found, whole) in counts.iter().zip(&whole) {
                if wanted.up_to_hits && wanted.body && whole.body > 0 {
                    let some = 1..=whole.body;
                    assert!(some.contains(&found.body), "{path:?}: {wanted:?}");
                    continue;
                }
                let expected = Overlap {
                    body: if wanted.body { whole.body } else { 0 },
                    outer: if wanted.outer { whole.outer } else { u32::MAX },
                    evasion: if wanted.evasion { whole.evasion } else { 0 },
                };
                assert_eq!(*found, expected, "{path:?}: {wanted:?}");
            }
        }
    });
}

/// Without validation, which allocates for itself on this thread's behalf.
#[test]
fn a_cull_allocates_nothing() {
    let mut silent = desc();
    silent.validation = false;
    let mut device = Headless::new(&silent).unwrap();
    let mut random = Random::new(1);
    for grid in [MapGrid::PAPER, MapGrid::default()] {
        let atlas = atlas(&mut random, grid, 6);
        let case = CullCase::new(&mut random, &atlas, RECT, 0..3, 100);
        let mut cullers = each_culler(&mut device, &atlas, 1);
        for (path, culler) in &mut cullers {
            let mut overlaps = Vec::new();
            for cull in 0..4 {
                let recorded = device.run(|cmd| {
                    let before = allocations();
                    // SAFETY: `run` gives a buffer that is being recorded, and has waited for the cull before.
                    let ticket = unsafe { culler.record(cmd, 0, &case.input(&atlas)) }?;
                    Ok((ticket, allocations() - before))
                });
                let (ticket, recording) = recorded.unwrap();
                let before = allocations();
                assert!(culler.poll(ticket, &mut overlaps).unwrap());
                let polling = allocations() - before;
                if cull > 0 {
                    assert_eq!((recording, polling), (0, 0), "{path:?}, cull {cull}");
                }
            }
        }
        destroy(&mut device, cullers);
    }
    assert!(device.destroy().is_empty());
}

/// Attacks that fill the target several times, and more queries and maps than one rendering takes.
#[test]
fn attacks_and_candidates_of_several_passes_agree() {
    let mut device = shimmed_device();
    let wide = map_rect(-500, -500, 1024, 1024);
    for (grid, seed) in [MapGrid::PAPER, sliced(8), GRIDS[3]].into_iter().zip(40..) {
        let mut random = Random::new(seed);
        let atlas = atlas(&mut random, grid, 8);
        let mut desc = CullerDesc::new(CullPath::Stencil, &atlas);
        desc.max_candidates = 6000;
        let mut culler = culler(&mut device, &desc);
        let mut large = CullCase::new(&mut random, &atlas, wide, -1..6, 60);
        for one in &mut large.attack.discs {
            one.disc.radius += 4000;
        }
        let near = |one: &mut CullCandidate| one.clock = 0;
        let mut many = CullCase::new(&mut random, &atlas, RECT, -1..6, 6000);
        many.candidates.iter_mut().for_each(near);
        for case in [large, many] {
            let input = case.input(&atlas);
            shim::heard();
            let counts = device.cull(&mut culler, &input).unwrap();
            assert_eq!(counts, counted(&input), "{grid:?}");
            let renderings = shim::heard().copies;
            assert!(renderings > 1, "{grid:?}: {renderings}");
        }
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}

#[test]
fn the_maps_outlive_a_first_cull_that_is_never_submitted() {
    on_each_path(61, 2, |device, random, atlas, (_, culler)| {
        let case = CullCase::new(random, atlas, RECT, 0..3, 100);
        let input = case.input(atlas);
        let expected = counted(&input);
        assert!(expected.iter().any(|one| one.body > 0));
        let lost = device.run(|cmd| {
            // SAFETY: `run` gives a buffer that is being recorded.
            unsafe { culler.record(cmd, 0, &input) }?;
            Err::<(), _>(GpuError::Unfinished)
        });
        assert!(matches!(lost, Err(GpuError::Unfinished)));
        for _ in 0..2 {
            assert_eq!(device.cull(culler, &input).unwrap(), expected);
        }
    });
}

/// More planes and blocks than one chunk of the attack holds.
#[test]
fn attacks_of_many_chunks_agree() {
    let mut device = device();
    let mut random = Random::new(10);
    let atlas = atlas(&mut random, sliced(64), 10);
    let rect = map_rect(-200, -150, 400, 300);
    let mut case = CullCase::new(&mut random, &atlas, rect, -1..7, 90);
    for one in &mut case.attack.discs {
        one.disc.radius += 1000;
    }
    let mut desc = CullerDesc::new(CullPath::Compute, &atlas);
    desc.max_blocks = 1 << 20;
    let input = case.input(&atlas);
    let mut one = input;
    one.candidates = &case.candidates[..1];
    let mut culler = culler(&mut device, &desc);
    for input in [one, input] {
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input));
    }
    culler.destroy(device.memory().unwrap());
    assert!(counted(&input).iter().any(|one| one.body > 0));
    finish(device);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let mut device = device();
    let mut random = Random::new(6);
    let atlas = atlas(&mut random, MapGrid::default(), 4);
    let case = CullCase::new(&mut random, &atlas, RECT, 0..3, 9);
    let mut stranger = case.candidates[..4].to_vec();
    stranger[2].region.0 = 4;
    let mut enlarged = case.candidates[..4].to_vec();
    (enlarged[1].transform.a, enlarged[1].transform.b) = (20_000, 9_000);
    let none = AttackDrawing::default();
    let wide = AttackDrawing {
        rect: MapRect {
            width: MapGrid::MAX_SIDE + 1,
            ..RECT
        },
        ..AttackDrawing::default()
    };
    // Each of its maps fills the target.
    let mut large = with(|s: &mut AttackDrawing| s.rect = map_rect(-500, -500, 1000, 1000));
    for (slab, clock) in (0..48).flat_map(|slab| [0, 1, 5].map(|clock| (slab % 6, clock))) {
        let first = large.discs.len() as u32;
        let disc = Disc {
            x: 8000,
            z: 8000,
            radius: 7900,
        };
        large.discs.push(TimedDisc { disc, slice: 0 });
        large.layers.push(AttackLayer {
            slab: Slab(slab),
            clock,
            inner: first..first + 1,
            outer: first..first + 1,
        });
    }
    for path in DEVICE_PATHS {
        let mut desc = CullerDesc {
            max_candidates: 8,
            ..CullerDesc::new(path, &atlas)
        };
        desc.max_blocks = 4;
        let mut culler = culler(&mut device, &desc);
        let most = "max_candidates: 9 needed, 8";
        let mut cases = vec![
            (&none, &case.candidates[..], 0, most),
            (&none, &stranger[..], 0, "candidate 2 names region 4"),
            (&wide, &case.candidates[..1], 0, "side of an attack's maps"),
            (&none, &[], 2, "slot 2 of 2"),
        ];
        if path == CullPath::Stencil {
            cases.push((&large, &case.candidates[..8], 0, "counts of a cull"));
        } else {
            let limit = "CullerDesc::max_blocks";
            cases.push((&case.attack, &case.candidates[..8], 0, limit));
            cases.push((&none, &enlarged[..], 0, "size of a rotated block"));
        }
        for (attack, candidates, slot, words) in cases {
            let input = CullInput {
                atlas: &atlas,
                attack,
                candidates,
            };
            // SAFETY: `run` gives a buffer that is being recorded.
            let refused = device.run(|cmd| unsafe { culler.record(cmd, slot, &input) });
            let error = refused.unwrap_err().to_string();
            assert!(error.contains(words), "{path:?}, {words}: {error}");
        }
        let input = CullInput {
            atlas: &atlas,
            attack: &none,
            candidates: &case.candidates[..8],
        };
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input), "{path:?} is of use all the same");
        culler.destroy(device.memory().unwrap());
    }
    let mut desc = CullerDesc::new(CullPath::Compute, &atlas);
    desc.max_candidates = u32::MAX;
    let made = device.make(|context, memory| Culler::new(context, memory, &desc));
    let error = made.unwrap_err().to_string();
    assert!(error.starts_with("maxComputeWorkGroupCount"), "{error}");
    assert_eq!(device.memory().unwrap().live_blocks(), 0);
    finish(device);
}
