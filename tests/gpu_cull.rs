//! Promise: the stencil culling path counts what the CPU's counts, texel for texel, for any
//! candidates, slabs and placements.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use common::maps::{attack_of, empty_attack, untimed};
use common::{FALLBACK_FORMATS, Random, device, device_with, drifting, finish};
use sabaki::{
    avoid::cull::{AttackDrawing, CullCandidate, CullInput, Overlap, cpu},
    gpu::{
        GpuError, Headless, Mismatch,
        stencil::{Culler, CullerDesc},
    },
    math::Rigid2,
    region::{MapGrid, MapRect, MapTurn, RegionAtlas, RegionId, RegionMaps, Slab},
};

/// Evasions of all sizes, in slabs from -1 to 6; some are empty.
fn atlas(random: &mut Random, regions: usize) -> RegionAtlas {
    let region = |random: &mut Random| {
        let slabs = random.int(0, 6);
        let maps = |random: &mut Random| {
            let rect = MapRect {
                u: random.int(-60, 30),
                v: random.int(-60, 30),
                width: random.int(0, 80) as u32,
                height: random.int(0, 80) as u32,
            };
            let (frames, discs) = (random.int(1, 12), random.int(0, 7));
            untimed(&drifting(random, rect, frames as usize, discs as usize))
        };
        RegionMaps {
            first_slab: Slab(random.int(-1, 2)),
            slabs: (0..slabs).map(|_| maps(random)).collect(),
            seconds: 1.0,
        }
    };
    let regions = (0..regions).map(|_| region(random)).collect();
    RegionAtlas::new(MapGrid::PAPER, regions, Vec::new())
}

fn attack(random: &mut Random, rect: MapRect, slabs: std::ops::Range<i32>) -> AttackDrawing {
    attack_of(slabs.map(|slab| (Slab(slab), drifting(random, rect, 6, 4))))
}

fn candidates(
    random: &mut Random,
    atlas: &RegionAtlas,
    origin: MapRect,
    count: usize,
) -> Vec<CullCandidate> {
    let reach = if random.chance(0.9) { 0.7 } else { 40.0 };
    let candidate = |_| {
        let heading = random.float(-4.0, 4.0);
        let (x, z) = (random.float(-reach, reach), random.float(-reach, reach));
        CullCandidate {
            region: RegionId(random.int(0, atlas.regions().len() as i32 - 1) as u32),
            clock: 0,
            open: false,
            turn: MapTurn::new(
                Rigid2::new(heading, x, z),
                (origin.u, origin.v),
                atlas.grid().texel,
            ),
        }
    };
    (0..count).map(candidate).collect()
}

fn culler(device: &mut Headless, desc: &CullerDesc<'_>) -> Culler {
    device
        .make(|context, memory| Culler::new(context, memory, desc))
        .unwrap()
}

fn counted(input: &CullInput<'_>) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    cpu::count(input, &mut overlaps);
    // The device does not count the outer maps yet, and says so.
    overlaps.iter_mut().for_each(|one| one.outer = u32::MAX);
    overlaps
}

#[test]
fn thousands_of_random_candidates_agree() {
    let mut device = device();
    let mut random = Random(2);
    let atlas = atlas(&mut random, 40);
    let desc = CullerDesc {
        max_candidates: 64,
        max_slabs: 9,
        max_attack_texels: [130, 130],
        ..CullerDesc::new("test", &atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let (mut met, mut met_evasion, mut missed) = (0, 0, 0);
    for _ in 0..40 {
        let rect = MapRect {
            u: random.int(-80, 40),
            v: random.int(-80, 40),
            width: random.int(1, 130) as u32,
            height: random.int(1, 130) as u32,
        };
        let first = random.int(-2, 3);
        let slabs = first..first + random.int(1, 5);
        let attack = attack(&mut random, rect, slabs);
        let candidates = candidates(&mut random, &atlas, rect, 100);
        let input = CullInput {
            atlas: &atlas,
            attack: &attack,
            candidates: &candidates,
        };
        let expected = counted(&input);
        met += expected.iter().filter(|one| one.body > 0).count();
        met_evasion += expected.iter().filter(|one| one.evasion > 0).count();
        missed += expected.iter().filter(|one| one.body == 0).count();
        assert_eq!(device.cull(&mut culler, &input).unwrap(), expected);
    }
    // The test means something only if there is some of each.
    assert!(
        met > 400 && met_evasion > 200 && missed > 400,
        "{met} {met_evasion} {missed}"
    );
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn edges_of_the_input_agree() {
    let mut device = device();
    let mut random = Random(3);
    let atlas = atlas(&mut random, 12);
    let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
    let rect = MapRect {
        u: -20,
        v: 5,
        width: 60,
        height: 40,
    };
    let some = attack(&mut random, rect, 0..4);
    let many = candidates(&mut random, &atlas, rect, 300);
    let mut unplaced = many.clone();
    for candidate in &mut unplaced {
        (candidate.turn.a, candidate.turn.b) = (0, 0);
    }
    let no_texels = attack(&mut random, MapRect::default(), 0..2);
    let no_discs = empty_attack(rect, 0..3);
    let no_slabs = AttackDrawing::default();
    let first_slab = attack(&mut random, rect, 0..1);
    let elsewhere = attack(&mut random, rect, 50..53);
    let below = attack(&mut random, rect, -9..-4);
    let cases: [(&str, &AttackDrawing, &[CullCandidate]); 9] = [
        ("no candidates", &some, &[]),
        ("no slabs", &no_slabs, &many),
        ("no texels", &no_texels, &many),
        ("no discs", &no_discs, &many),
        ("slabs that no region has", &elsewhere, &many),
        ("slabs below all regions", &below, &many),
        ("a turn that is none", &some, &unplaced),
        ("one of each", &first_slab, &many[..1]),
        ("a whole cull after all that", &some, &many),
    ];
    for (case, attack, candidates) in cases {
        let input = CullInput {
            atlas: &atlas,
            attack,
            candidates,
        };
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input), "{case}");
    }
    culler.destroy(device.memory().unwrap());
    finish(device);
}

#[test]
fn slots_in_flight_keep_their_own_counts() {
    let mut device = device();
    let mut random = Random(4);
    let atlas = atlas(&mut random, 20);
    let desc = CullerDesc {
        frames_in_flight: 3,
        ..CullerDesc::new("test", &atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let rect = MapRect {
        u: -30,
        v: -30,
        width: 90,
        height: 70,
    };
    for _ in 0..5 {
        let inputs: Vec<_> = (0..3)
            .map(|_| {
                let count = random.int(1, 120) as usize;
                (
                    attack(&mut random, rect, 0..3),
                    candidates(&mut random, &atlas, rect, count),
                )
            })
            .collect();
        let input = |index: usize| CullInput {
            atlas: &atlas,
            attack: &inputs[index].0,
            candidates: &inputs[index].1,
        };
        // All three in one command buffer: they share the attack's target, and nothing else.
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
            assert!(tickets[index].counts_exact);
            assert!(culler.poll(tickets[index], &mut overlaps).unwrap());
            assert_eq!(overlaps, counted(&input(index)), "slot {index}");
        }
        // SAFETY: the first run has uploaded the maps, and it has been waited for.
        unsafe { culler.release_staging(device.memory().unwrap()) };
        let late = device
            .run(|cmd| {
                // SAFETY: as above.
                unsafe { culler.record(cmd, 0, &input(2)) }
            })
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
    for format in FALLBACK_FORMATS {
        let mut device = device_with(format);
        let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
        let counts = device.cull(&mut culler, &input).unwrap();
        assert_eq!(counts, counted(&input), "{format:?}");
        culler.destroy(device.memory().unwrap());
        finish(device);
    }
}

#[test]
fn without_precise_queries_some_and_none_are_still_right() {
    let mut device = Headless::new(&sabaki::gpu::HeadlessDesc {
        without_precise_queries: true,
        ..common::desc()
    })
    .unwrap();
    let mut random = Random(5);
    let atlas = atlas(&mut random, 20);
    let mut culler = culler(&mut device, &CullerDesc::new("test", &atlas));
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
    // SAFETY: `run` gives a buffer that is being recorded.
    let ticket = device
        .run(|cmd| unsafe { culler.record(cmd, 0, &input) })
        .unwrap();
    assert!(!ticket.counts_exact);
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
        max_slabs: 2,
        max_discs: 100,
        max_attack_texels: [64, 64],
        ..CullerDesc::new("test", &atlas)
    };
    let mut culler = culler(&mut device, &desc);
    let rect = |width, height| MapRect {
        width,
        height,
        ..MapRect::default()
    };
    let fits = attack(&mut random, rect(64, 64), 0..2);
    let few = candidates(&mut random, &atlas, rect(64, 64), 8);
    let many = candidates(&mut random, &atlas, rect(64, 64), 9);
    let slabs = attack(&mut random, rect(8, 8), 0..3);
    let wide = attack(&mut random, rect(129, 8), 0..1);
    let tall = attack(&mut random, rect(8, 65), 0..2);
    let discs =
        attack_of((0..2).map(|slab| (Slab(slab), drifting(&mut random, rect(64, 64), 17, 3))));
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
    says(refused(&slabs, &few), "max_slabs: 3 needed, 2");
    says(refused(&discs, &few), "max_discs: 102 needed, 100");
    says(refused(&wide, &few), "max_attack_texels: 129 needed, 128");
    says(refused(&tall, &few), "max_attack_texels: 65 needed, 64");
    says(refused(&fits, &stranger), "candidate 3 names region 4");
    assert_eq!(refused(&fits, &few), Ok(()), "and the culler goes on");
    culler.destroy(device.memory().unwrap());
    finish(device);
}
