//! Random maps over time, attacks against them, and candidates.

use std::ops::Range;

use sabaki::internal::{
    AttackDrawing, AttackLayer, BitMap, CullCandidate, FixedTransform2, MapRect, MaskMap, RegionId,
    RegionMaps, Slab, SlabMaps, TimedDisc,
};
use sabaki::maps::{MapGrid, RegionAtlas};
use sabaki::math::Rigid2;

use super::Random;

/// Clocks of the attacks and candidates made here: numbers, not positions.
const CLOCKS: [u32; 3] = [0, 1, 5];

/// A map with discs of random slices, often across its border; some maps are empty.
fn masks(random: &mut Random, grid: MapGrid) -> MaskMap {
    let rect = rect(random);
    let mut map = MaskMap::new(rect, grid.lanes());
    for_discs(random, rect, |column, row, slices| {
        slices.for_each(|slice| map.set(column, row, slice % grid.slices));
    });
    map
}

fn bits(random: &mut Random) -> BitMap {
    let rect = rect(random);
    let mut map = BitMap::new(rect);
    for_discs(random, rect, |column, row, _| map.set(column, row));
    map
}

fn rect(random: &mut Random) -> MapRect {
    MapRect {
        u: random.int(-60, 30),
        v: random.int(-60, 30),
        width: random.int(0, 80) as u32,
        height: random.int(0, 80) as u32,
    }
}

fn for_discs(random: &mut Random, rect: MapRect, mut visit: impl FnMut(i32, i32, Range<u32>)) {
    for _ in 0..random.int(0, 12) {
        let (disc, first) = (random.disc(rect, 25), random.int(0, 63) as u32);
        let slices = first..first + random.int(1, 32) as u32;
        for row in 0..rect.height as i32 {
            for column in 0..rect.width as i32 {
                if disc.covers(column, row) {
                    visit(column, row, slices.clone());
                }
            }
        }
    }
}

/// Evasions of all sizes, in slabs from -1 to 6; some are empty. No map is a part of another, which
/// drawn ones are.
pub fn atlas(random: &mut Random, grid: MapGrid, regions: usize) -> RegionAtlas {
    let region = |random: &mut Random| {
        let slabs = if random.chance(0.2) { 0 } else { 6 };
        RegionMaps {
            first_slab: Slab(random.int(-1, 2)),
            slabs: (0..slabs)
                .map(|_| SlabMaps {
                    body: masks(random, grid),
                    outer: masks(random, grid),
                    evasion: bits(random),
                })
                .collect(),
            seconds: 1.0,
        }
    };
    let regions = (0..regions).map(|_| region(random)).collect();
    RegionAtlas::new(grid, regions, Vec::new())
}

/// The space of an attack.
#[derive(Clone, Debug)]
pub struct Bounds {
    pub rect: MapRect,
    pub slabs: Range<i32>,
}

/// An attack with a layer for each slab and most clocks.
pub fn attack(random: &mut Random, grid: MapGrid, bounds: Bounds) -> AttackDrawing {
    let Bounds { rect, slabs } = bounds;
    let mut attack = AttackDrawing {
        rect,
        ..AttackDrawing::default()
    };
    for slab in slabs {
        for clock in CLOCKS {
            if random.chance(0.2) {
                continue;
            }
            let mut discs = |random: &mut Random| {
                let first = attack.discs.len() as u32;
                let mut discs: Vec<TimedDisc> = (0..random.int(0, 9))
                    .map(|_| TimedDisc {
                        disc: random.disc(rect, 20),
                        slice: random.int(0, grid.slices as i32 - 1) as u32,
                    })
                    .collect();
                discs.sort_unstable_by_key(|one| one.slice);
                attack.discs.extend(discs);
                first..attack.discs.len() as u32
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

/// Candidates about an attack whose maps have the rectangle `attack`; sometimes all far away.
pub fn candidates(
    random: &mut Random,
    atlas: &RegionAtlas,
    attack: MapRect,
    count: usize,
) -> Vec<CullCandidate> {
    let reach = if random.chance(0.9) { 0.7 } else { 40.0 };
    let candidate = |_| {
        let heading = random.float(-4.0, 4.0);
        let (x, z) = (random.float(-reach, reach), random.float(-reach, reach));
        CullCandidate {
            region: RegionId(random.int(0, atlas.regions().len() as i32 - 1) as u32),
            clock: CLOCKS[random.int(0, 2) as usize],
            open: false,
            transform: FixedTransform2::new(Rigid2::new(heading, x, z), attack, atlas.grid()),
        }
    };
    (0..count).map(candidate).collect()
}
