//! Input of a cull in the layout of the device: the blocks of the attack, and candidates in groups of one clock.

use super::{
    blocks::{self, Blocks, CHUNK},
    planes::Planes,
    planes::planes_of_slab,
};
use crate::{
    gpu::{
        GpuError,
        error::within,
        shader_table::{COUNTS, CountCandidates, GroupRange, PlaneCandidate},
    },
    maps::MapGrid,
    query::cull::{Counted, CullCandidate, CullInput},
};

/// Number of candidates of a work group, one for each invocation: `local_size_x` in `shaders/count.comp.glsl`.
const GROUP: usize = 32;

#[derive(Clone, Copy, Debug)]
pub(super) struct Capacity {
    pub(super) candidates: u32,
    pub(super) blocks: u32,
}

/// Offsets of the parts of a cull's input, in bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offsets {
    pub(super) groups: u64,
    pub(super) chunks: u64,
    pub(super) end: u64,
}

impl Capacity {
    /// Number of groups that a small cull is divided into to occupy the device.
    const WANTED_GROUPS: u32 = 128;
    const MOST_PARTS: u32 = 16;
    /// Alignment of offsets, a multiple of those of all devices.
    const ALIGNMENT: u64 = 256;

    pub(super) fn offsets(&self) -> Offsets {
        let aligned = |bytes: u64| bytes.max(4).next_multiple_of(Self::ALIGNMENT);
        let candidates = u64::from(self.candidates) * size_of::<PlaneCandidate>() as u64;
        let groups = aligned(candidates);
        let bytes = self.most_groups() * size_of::<GroupRange>() as u64;
        let chunks = groups + aligned(bytes);
        let end = chunks + self.most_chunks() * (4 * CHUNK) as u64;
        Offsets {
            groups,
            chunks,
            end,
        }
    }

    fn most_chunks(&self) -> u64 {
        Blocks::most_chunks(self.blocks).max(1)
    }

    /// Maximum number of groups of all chunks if each candidate has its own clock.
    fn most_groups(&self) -> u64 {
        u64::from(self.candidates) * self.most_chunks()
    }

    /// Maximum number of words of a cull's counts. If a sum has several parts, there are at most [`WANTED_GROUPS`](Self::WANTED_GROUPS)
    /// groups of all chunks and parts together. Otherwise there is one count for each candidate and chunk.
    pub(super) fn counts(&self) -> u64 {
        let whole = u64::from(self.candidates) * self.most_chunks();
        let in_parts = u64::from(Self::WANTED_GROUPS) * GROUP as u64;
        let most = whole * u64::from(Self::MOST_PARTS);
        in_parts.max(whole).min(most) * COUNTS as u64
    }
}

/// Input of one cull for the device. The memory is reused; after inputs of similar size nothing is allocated.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// Candidates, by clock.
    pub(super) candidates: Vec<PlaneCandidate>,
    /// Groups of each chunk, as many for each, by clock.
    pub(super) groups: Vec<GroupRange>,
    pub(super) blocks: Blocks,
    /// Clock and index of each candidate, sorted.
    order: Vec<(u32, u32)>,
    slices: u32,
    up_to_hits: bool,
}

impl Gathered {
    /// Computes the layout of an input.
    pub(super) fn fill(
        &mut self,
        input: &CullInput<'_>,
        counted: Counted,
        planes: &Planes,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        let rect = input.attack.rect;
        for side in [rect.width, rect.height] {
            let most = MapGrid::MAX_SIDE;
            within("side of an attack's maps", side.into(), most.into())?;
        }
        let grid = planes.grid;
        self.slices = grid.slices;
        self.up_to_hits = counted.up_to_hits && grid.is_certain();
        let blocks = self.blocks.draw(input.attack, grid, counted) as u64;
        within("CullerDesc::max_blocks", blocks, capacity.blocks.into())?;
        self.order.clear();
        let clocks = input.candidates.iter().map(|candidate| candidate.clock);
        self.order.extend(clocks.zip(0..));
        self.order.sort_unstable();
        self.place(input.candidates, planes)?;
        self.group();
        Ok(())
    }

    pub(super) fn constants(&self) -> CountCandidates {
        CountCandidates {
            first: 0,
            parts: self.parts(),
            candidates: self.candidates.len() as u32,
            sums: 0,
            slices: self.slices,
            planes: planes_of_slab(self.slices),
            up_to_hits: self.up_to_hits.into(),
        }
    }

    /// Number of groups for the same candidates and chunk.
    pub(super) fn parts(&self) -> u32 {
        let groups = self.groups.len().max(1) as u32;
        let most = (Capacity::WANTED_GROUPS / groups).clamp(1, Capacity::MOST_PARTS);
        // The planes are divided as evenly as possible.
        let planes = self.blocks.most_planes().max(1);
        planes.div_ceil(planes.div_ceil(most))
    }

    /// Number of counts of each candidate. Their sum is the candidate's count.
    pub(super) fn sums(&self) -> u32 {
        self.blocks.chunks() * self.parts()
    }

    fn place(&mut self, candidates: &[CullCandidate], planes: &Planes) -> Result<(), GpuError> {
        self.candidates.clear();
        for &(_, index) in &self.order {
            let candidate = &candidates[index as usize];
            let region = planes.regions[candidate.region.index()];
            let turn = candidate.transform;
            blocks::check_turn(turn)?;
            self.candidates.push(PlaneCandidate {
                turn: [turn.a, turn.b, turn.tx, turn.tz],
                entries: region.entries,
                first_slab: region.first_slab,
                slabs: region.slabs,
                index,
            });
        }
        Ok(())
    }

    /// Groups the candidates of a clock for each chunk, also for chunks without planes of that clock, whose count is 0.
    fn group(&mut self) {
        self.groups.clear();
        for chunk in 0..self.blocks.chunks() {
            let mut start = 0;
            for alike in self.order.chunk_by(|a, b| a.0 == b.0) {
                let end = start + alike.len() as u32;
                let planes = self.blocks.planes_of(chunk, alike[0].0);
                for some in (start..end).step_by(GROUP) {
                    self.groups.push(GroupRange {
                        first: some,
                        end: end.min(some + GROUP as u32),
                        first_plane: planes.start,
                        end_plane: planes.end,
                    });
                }
                start = end;
            }
        }
    }
}
