//! A cull's input, laid out for the device: the attack's blocks clock by clock, and candidates that know their clock's.

use std::ops::Range;

use super::pages::Pages;
use crate::{
    avoid::cull::{AttackTexels, BLOCK, BLOCK_TEXELS, CullInput},
    gpu::{
        GpuError, Mismatch,
        error::within,
        shader_table::{COUNTS, CountSettings, Paged},
    },
    region::MapGrid,
};

/// The most that a culler takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capacity {
    pub(super) candidates: u32,
    pub(super) blocks: u32,
    /// Work groups in one dispatch.
    pub(super) groups: u32,
    /// Words of a mask.
    pub(super) lanes: usize,
}

impl Capacity {
    /// Groups that a small cull is divided into, so that it does not leave a device idle.
    const WANTED_GROUPS: u32 = 64;
    const MOST_PARTS: u32 = 8;
    /// Where the attack's words start: a multiple of every device's `minStorageBufferOffsetAlignment`.
    const ALIGNMENT: u64 = 256;

    /// Groups for each of so many candidates.
    pub(super) fn parts(candidates: u32) -> u32 {
        (Self::WANTED_GROUPS / candidates.max(1)).clamp(1, Self::MOST_PARTS)
    }

    /// Words of the counts of any cull.
    pub(super) fn counts(&self) -> u64 {
        u64::from(self.candidates.max(Self::WANTED_GROUPS)) * COUNTS as u64
    }

    /// Bytes before the attack's words.
    pub(super) fn attack_offset(&self) -> u64 {
        let candidates = u64::from(self.candidates) * size_of::<Paged>() as u64;
        candidates.max(4).next_multiple_of(Self::ALIGNMENT)
    }

    /// Bytes of an attack.
    pub(super) fn attack_bytes(&self) -> u64 {
        let words = 2 + self.lanes * (1 + 2 * BLOCK_TEXELS);
        4 * u64::from(self.blocks.max(1)) * words as u64
    }
}

/// One cull on its way to the device. Used again and again: it allocates nothing once it has held as much.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) candidates: Vec<Paged>,
    texels: AttackTexels,
    /// Place and slab; number of its texels.
    blocks: Vec<[u32; 2]>,
    /// What a block's texels have, inner or outer, `[block][lane]`.
    masks: Vec<u32>,
    /// Layers by clock.
    layers: Vec<(u32, u32)>,
    /// Sorted: a clock and its blocks.
    clocks: Vec<(u32, Range<u32>)>,
}

impl Gathered {
    /// Lays an input out.
    pub(super) fn fill(
        &mut self,
        input: &CullInput<'_>,
        pages: &Pages,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        let candidates = input.candidates.len() as u64;
        let most = u64::from(capacity.candidates);
        within("CullerDesc::max_candidates", candidates, most)?;
        let rect = input.attack.rect;
        for side in [rect.width, rect.height] {
            let most = MapGrid::MAX_SIDE;
            within("side of an attack's maps", side.into(), most.into())?;
        }
        self.texels.draw(input.attack, pages.lanes);
        let blocks = self.texels.places.len() as u64;
        within("CullerDesc::max_blocks", blocks, capacity.blocks.into())?;
        self.blocks(pages);
        self.candidates(input, pages)
    }

    /// What the shader is told besides, but for the groups.
    pub(super) fn constants(&self) -> CountSettings {
        let masks = 2 * self.blocks.len();
        let inner = masks + self.masks.len();
        CountSettings {
            first: 0,
            parts: Capacity::parts(self.candidates.len() as u32),
            lanes: self.texels.lanes as u32,
            masks: masks as u32,
            inner: inner as u32,
            outer: (inner + self.texels.inner.len()) as u32,
        }
    }

    /// The attack's words, part after part.
    pub(super) fn attack(&self) -> [&[u8]; 4] {
        [
            bytemuck::cast_slice(&self.blocks),
            bytemuck::cast_slice(&self.masks),
            bytemuck::cast_slice(&self.texels.inner),
            bytemuck::cast_slice(&self.texels.outer),
        ]
    }

    /// Lists the blocks of each clock in slabs that some region has.
    fn blocks(&mut self, pages: &Pages) {
        self.blocks.clear();
        self.masks.clear();
        self.clocks.clear();
        self.layers.clear();
        let texels = &self.texels;
        let by_clock = (0..).zip(&texels.layers);
        self.layers
            .extend(by_clock.map(|(index, layer)| (layer.clock, index)));
        self.layers.sort_unstable();
        for &(clock, layer) in &self.layers {
            let layer = &texels.layers[layer as usize];
            let first = self.blocks.len() as u32;
            for block in layer.blocks.clone() {
                let Some(slab) = pages.slab(layer.slab) else {
                    break;
                };
                let [column, row] = texels.places[block as usize].map(|place| place as u32);
                let [column, row] = [column, row].map(|texel| texel / BLOCK as u32);
                let place = column | (row << 9) | (slab << 18);
                self.blocks.push([place, block]);
                for lane in 0..texels.lanes {
                    let start = (block as usize * texels.lanes + lane) * BLOCK_TEXELS;
                    let words = start..start + BLOCK_TEXELS;
                    let both = texels.inner[words.clone()].iter().zip(&texels.outer[words]);
                    self.masks
                        .push(both.fold(0, |mask, (inner, outer)| mask | inner | outer));
                }
            }
            let end = self.blocks.len() as u32;
            match self.clocks.last_mut() {
                Some((last, blocks)) if *last == clock => blocks.end = end,
                _ => self.clocks.push((clock, first..end)),
            }
        }
    }

    fn candidates(&mut self, input: &CullInput<'_>, pages: &Pages) -> Result<(), GpuError> {
        self.candidates.clear();
        for (index, candidate) in input.candidates.iter().enumerate() {
            let region = pages.regions.get(candidate.region.index());
            let region = region.ok_or(Mismatch::Region {
                candidate: index,
                region: candidate.region.0,
                regions: pages.regions.len(),
            })?;
            let clock = (self.clocks).binary_search_by_key(&candidate.clock, |(clock, _)| *clock);
            let blocks = clock.map_or(0..0, |clock| self.clocks[clock].1.clone());
            let turn = candidate.turn;
            self.candidates.push(Paged {
                turn: [turn.a, turn.b, turn.tx, turn.tz],
                origin: region.origin,
                side: region.side,
                tiles: region.tiles,
                first_slab: region.first_slab,
                slabs: region.slabs,
                first_block: blocks.start,
                end_block: blocks.end,
                padding: [0; 3],
            });
        }
        Ok(())
    }
}
