//! What the culling paths of a device are tested with: any maps, any attacks, any candidates.

use sabaki::gpu::{Block, Culler, CullerDesc, GpuError, Memory, MemoryDesc, MemoryUse};
use sabaki::internal::{
    AttackDrawing, CullCandidate, FixedTransform2, MapRect, RegionId, RegionMaps, Section, Slab,
    SlabMaps,
};
use sabaki::maps::{MapGrid, RegionAtlas};
use sabaki::math::Rigid2;
use sabaki::query::cull::{CullInput, Overlap, cpu};
use sabaki_app::headless::Headless;

use super::maps::{TimedAttack, attack_of, timed, timed_attack, untimed};
use super::{Random, drifting, random};

/// The paper's maps, and slices that fill a stencil, one word, a part of two words, and both.
pub const GRIDS: [MapGrid; 5] = [
    MapGrid::PAPER,
    sliced(8),
    sliced(32),
    sliced(41),
    sliced(64),
];

pub const fn sliced(slices: u32) -> MapGrid {
    MapGrid {
        slices,
        section: Section::Plane,
        slab_height: 0.05,
        ..MapGrid::PAPER
    }
}

/// Evasions of all sizes, in slabs from -1 to 6; some are empty.
pub fn atlas_on(grid: MapGrid, random: &mut Random, regions: usize) -> RegionAtlas {
    let mut masks = random::Random::new(random.bits());
    let mut slab_maps = |random: &mut Random| {
        let rect = MapRect {
            u: random.int(-60, 30),
            v: random.int(-60, 30),
            width: random.int(0, 80) as u32,
            height: random.int(0, 80) as u32,
        };
        let (frames, discs) = (random.int(1, 12), random.int(0, 7));
        let drawn = untimed(&drifting(random, rect, frames as usize, discs as usize));
        let outer = MapRect {
            u: rect.u - random.int(0, 9),
            width: rect.width + random.int(0, 20) as u32,
            ..rect
        };
        SlabMaps {
            body: match grid.is_timed() {
                true => timed(&mut masks, rect, grid),
                false => drawn.body,
            },
            outer: timed(&mut masks, outer, grid),
            evasion: drawn.evasion,
        }
    };
    let mut region = || RegionMaps {
        first_slab: Slab(random.int(-1, 2)),
        slabs: (0..random.int(0, 6)).map(|_| slab_maps(random)).collect(),
        seconds: 1.0,
    };
    let regions = (0..regions).map(|_| region()).collect();
    RegionAtlas::new(grid, regions, Vec::new())
}

pub fn atlas(random: &mut Random, regions: usize) -> RegionAtlas {
    atlas_on(MapGrid::PAPER, random, regions)
}

pub fn attack(random: &mut Random, rect: MapRect, slabs: std::ops::Range<i32>) -> AttackDrawing {
    attack_of(slabs.map(|slab| (Slab(slab), drifting(random, rect, 6, 4))))
}

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
            clock: 0,
            open: false,
            transform: FixedTransform2::new(Rigid2::new(heading, x, z), attack, atlas.grid()),
        }
    };
    (0..count).map(candidate).collect()
}

/// Memory as of a device that has its own: the host cannot write to what the device uses, so that it is copied from staging buffers.
pub struct Unmapped<'a>(pub &'a mut dyn Memory);

impl Memory for Unmapped<'_> {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        let block = self.0.allocate(desc)?;
        Ok(match desc.usage {
            MemoryUse::Device => Block {
                mapped: None,
                ..block
            },
            MemoryUse::Upload | MemoryUse::Readback => block,
        })
    }

    fn free(&mut self, block: Block) {
        self.0.free(block);
    }
}

/// A culler whose maps are copied from a staging buffer.
pub fn culler(device: &mut Headless, desc: &CullerDesc<'_>) -> Culler {
    device
        .make(|context, memory| Culler::new(context, &mut Unmapped(memory), desc))
        .unwrap()
}

pub fn counted(input: &CullInput<'_>) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    cpu::count(input, &mut overlaps);
    overlaps
}

/// An attack of any place and size by up to three clocks, and candidates about it.
pub fn any_input(
    random: &mut Random,
    atlas: &RegionAtlas,
    count: usize,
) -> (AttackDrawing, Vec<CullCandidate>) {
    let rect = MapRect {
        u: random.int(-80, 40),
        v: random.int(-80, 40),
        width: random.int(1, 130) as u32,
        height: random.int(1, 130) as u32,
    };
    let first = random.int(-2, 3);
    let (slabs, clocks) = (first..first + random.int(1, 5), random.int(1, 3));
    let mut discs = random::Random::new(random.bits());
    let desc = TimedAttack {
        rect,
        grid: atlas.grid(),
        slabs,
        clocks: clocks as u32,
    };
    let attack = timed_attack(&mut discs, desc);
    let mut candidates = candidates(random, atlas, rect, count);
    for candidate in &mut candidates {
        candidate.clock = random.int(0, clocks - 1) as u32;
    }
    (attack, candidates)
}
