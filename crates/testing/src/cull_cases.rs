//! The cases that every culling path of a device is held to, against the CPU's counts.

use sabaki::gpu::{BatchEntry, Counting, Culler, CullerDesc, GpuError};
use sabaki::internal::{AttackDrawing, AttackLayer, CullCandidate, MapRect, Slab, SlabMaps};
use sabaki::maps::{MapGrid, RegionAtlas};
use sabaki::query::cull::{CullInput, CullPath, Overlap};
use sabaki_app::headless::Headless;

use super::cull::{counted, culler};
use super::timed::{Bounds, atlas, attack, candidates};
use super::{Random, device, finish};

/// A culling path of the device, and how it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    pub path: CullPath,
    /// Of the stencil path.
    pub counting: Counting,
}

impl Way {
    pub const STENCIL: Self = Self {
        path: CullPath::Stencil,
        counting: Counting::Queries,
    };
    pub const ATOMICS: Self = Self {
        path: CullPath::Stencil,
        counting: Counting::Atomics,
    };
    pub const COMPUTE: Self = Self {
        path: CullPath::Compute,
        counting: Counting::Queries,
    };
    pub const ALL: [Self; 3] = [Self::STENCIL, Self::ATOMICS, Self::COMPUTE];

    /// Default settings.
    pub fn desc(self, atlas: &RegionAtlas) -> CullerDesc<'_> {
        let mut desc = CullerDesc::new(self.path, atlas);
        desc.stencil.counting = Some(self.counting);
        desc
    }

    fn culler(self, device: &mut Headless, atlas: &RegionAtlas, frames: u32) -> Culler {
        let desc = CullerDesc {
            frames_in_flight: frames,
            ..self.desc(atlas)
        };
        culler(device, &desc)
    }
}

const RECT: MapRect = MapRect {
    u: -30,
    v: -25,
    width: 90,
    height: 70,
};

/// Grids of 1 and 2 words a mask, full and not, timed and not, of all pitches.
fn grids() -> [MapGrid; 6] {
    let slices = |slices, attack_pitch| MapGrid {
        texel: 0.02,
        attack_pitch,
        slices,
        ..MapGrid::default()
    };
    [
        MapGrid::PAPER,
        slices(8, 1),
        slices(32, 1),
        slices(32, 2),
        slices(40, 4),
        slices(64, 2),
    ]
}

/// Thousands of random candidates, attacks and maps.
pub fn random_candidates_agree(way: Way) {
    let mut device = device();
    for (seed, grid) in (20..).zip(grids()) {
        let mut random = Random(seed);
        let atlas = atlas(&mut random, grid, 30);
        let mut culler = way.culler(&mut device, &atlas, 1);
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
            let attack = attack(&mut random, grid, Bounds { rect, slabs });
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
            let counts = device.cull(&mut culler, &input).unwrap();
            assert_eq!(counts, expected, "{way:?}, {grid:?}");
        }
        // The test means something only if there is some of each.
        assert!(
            body > 50 && outer > 50 && evasion > 50 && missed > 100,
            "{grid:?}: {body} {outer} {evasion} {missed}"
        );
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}

/// Attacks of one kind of edge each.
fn odd_attacks(random: &mut Random, grid: MapGrid) -> Vec<(&'static str, AttackDrawing)> {
    let some = attack(
        random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..4,
        },
    );
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
        (
            "no texels",
            attack(
                random,
                grid,
                Bounds {
                    rect: MapRect::default(),
                    slabs: 0..2,
                },
            ),
        ),
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
            attack(
                random,
                grid,
                Bounds {
                    rect: RECT,
                    slabs: 50..53,
                },
            ),
        ),
        (
            "slabs below all regions",
            attack(
                random,
                grid,
                Bounds {
                    rect: RECT,
                    slabs: -9..-4,
                },
            ),
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
    let mut one_larger = many.to_vec();
    (one_larger[1].transform.a, one_larger[1].transform.b) = (20_000, 9_000);
    vec![
        ("none", Vec::new()),
        ("one", many[..1].to_vec()),
        ("a turn that is none", with_turn(0, 0)),
        ("a turn that makes larger", with_turn(32_768, -32_768)),
        ("one of many that makes larger", one_larger),
        ("a turn that makes small", with_turn(99, 1)),
        ("borders", stepped.collect()),
        ("many", many.to_vec()),
    ]
}

/// Every odd attack against every odd set of candidates, one after the other with the same culler.
pub fn edges_agree(way: Way) {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(3);
    let atlas = atlas(&mut random, grid, 12);
    let mut culler = way.culler(&mut device, &atlas, 1);
    let many = candidates(&mut random, &atlas, RECT, 120);
    for (attack_case, attack) in odd_attacks(&mut random, grid) {
        for (case, candidates) in odd_candidates(&many) {
            let input = CullInput {
                atlas: &atlas,
                attack: &attack,
                candidates: &candidates,
            };
            let counts = device.cull(&mut culler, &input).unwrap();
            let expected = counted(&input);
            assert_eq!(counts, expected, "{way:?}: {attack_case}, {case}");
        }
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

/// Maps of no texels, and none at all.
pub fn atlases_without_a_map_agree(way: Way) {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(8);
    let attack = attack(
        &mut random,
        grid,
        Bounds {
            rect: RECT,
            slabs: 0..3,
        },
    );
    let mut emptied = atlas(&mut random, grid, 3).regions().to_vec();
    for region in &mut emptied {
        let maps = region.slabs.iter_mut();
        maps.for_each(|maps| *maps = SlabMaps::empty(grid.lanes()));
    }
    let of_empty_maps = RegionAtlas::new(grid, emptied, Vec::new());
    let no_regions = RegionAtlas::new(grid, Vec::new(), Vec::new());
    let some = candidates(&mut random, &of_empty_maps, RECT, 20);
    for (atlas, candidates) in [(&of_empty_maps, &some[..]), (&no_regions, &[])] {
        let mut culler = way.culler(&mut device, atlas, 1);
        let input = CullInput {
            atlas,
            attack: &attack,
            candidates,
        };
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, vec![Overlap::default(); candidates.len()]);
        culler.destroy(device.memory().unwrap());
    }
    finish(device);
}

/// Three culls in one command buffer, polled in any order; a ticket fits its cull alone.
pub fn slots_in_flight_keep_their_own_counts(way: Way) {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(4);
    let atlas = atlas(&mut random, grid, 20);
    let mut culler = way.culler(&mut device, &atlas, 3);
    for _ in 0..4 {
        let inputs: Vec<_> = (0..3)
            .map(|_| {
                let count = random.int(1, 120) as usize;
                (
                    attack(
                        &mut random,
                        grid,
                        Bounds {
                            rect: RECT,
                            slabs: 0..3,
                        },
                    ),
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
            assert_eq!(overlaps, counted(&input(index)), "{way:?}, slot {index}");
        }
        // SAFETY: the first run has uploaded the maps, and it has been waited for.
        unsafe { culler.release_staging(device.memory().unwrap()) };
        // SAFETY: as above.
        let late = device
            .run(|cmd| unsafe { culler.record(cmd, 0, &input(2)) })
            .unwrap();
        assert!(matches!(
            culler.poll(tickets[0], &mut overlaps),
            Err(GpuError::StaleTicket)
        ));
        assert!(culler.poll(late, &mut overlaps).unwrap());
        assert_eq!(overlaps, counted(&input(2)));
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

/// As many culls as there are slots in one recording, in any order of slots; then again with fewer.
pub fn a_batch_counts_what_its_culls_count_alone(way: Way) {
    let mut device = device();
    let grid = MapGrid::default();
    let mut random = Random(7);
    let atlas = atlas(&mut random, grid, 20);
    let slots = 9;
    let mut culler = way.culler(&mut device, &atlas, slots);
    for round in 0..3 {
        let inputs: Vec<_> = (0..slots - round)
            .map(|_| {
                let count = random.int(0, 90) as usize;
                let attack = attack(
                    &mut random,
                    grid,
                    Bounds {
                        rect: RECT,
                        slabs: 0..3,
                    },
                );
                (attack, candidates(&mut random, &atlas, RECT, count))
            })
            .collect();
        let mut batch = Vec::new();
        for (index, (attack, candidates)) in (0..).zip(&inputs) {
            batch.push(BatchEntry {
                slot: (index * 2 + round) % slots,
                input: CullInput {
                    atlas: &atlas,
                    attack,
                    candidates,
                },
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
            assert_eq!(overlaps, counted(&entry.input), "{way:?}, round {round}");
        }
        let first = batch[0].slot;
        batch[1].slot = first;
        // SAFETY: as above.
        let twice = device.run(|cmd| unsafe { culler.record_batch(cmd, &mut batch) });
        assert!(matches!(
            twice,
            Err(GpuError::NoSuchSlot { slot, .. }) if slot == first
        ));
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}
