//! The attack as blocks of 8 × 4 texels with one bit each, by plane and clock, in chunks that shaders read as uniform buffers.

use std::ops::Range;

use super::plane_bits::{COLUMNS, PlaneBits, ROWS, Shape};
use crate::{
    gpu::{GpuError, error::within},
    maps::{FixedTransform2, MapGrid},
    math::Isa,
    query::cull::{AttackDrawing, AttackLayer, Counted, TimedDisc},
};

/// Number of words of a chunk: 16 KiB, the size of uniform buffers that all devices support.
pub(super) const CHUNK: usize = 4096;
/// Distance from the first to the last texel of a window.
pub(super) const SPAN: i32 = 8;
/// Number of words of a plane: slab, plane of the slab, first block, end block.
const PLANE: usize = 4;
/// Number of words of a block: its position, and a bit for each texel.
const BLOCK: usize = 2;

/// Number of blocks that a shader filters together, one bit each.
const BATCH: usize = 32;

#[derive(Clone, Debug)]
struct ClockPlanes {
    clock: u32,
    chunk: u32,
    planes: Range<u32>,
}

/// Blocks of one plane, or a part of them.
#[derive(Clone, Copy, Debug)]
struct Plane {
    clock: u32,
    slab: i32,
    /// Index of the plane in its slab: first the slices of the body, then those of the outer map, then the evasion.
    number: u32,
    first: u32,
    end: u32,
}

/// The attack of one cull. The memory is reused; after inputs of similar size nothing is allocated.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Words of all chunks. In each chunk, planes are stored from the front and their blocks from the back.
    pub(super) words: Vec<u32>,
    clocks: Vec<ClockPlanes>,
    planes: Vec<Plane>,
    blocks: Vec<[u32; BLOCK]>,
    shape: Shape,
    slices: u32,
    slice: PlaneBits,
    /// Scratch: the union of the planes of all slices.
    all: PlaneBits,
}

/// Refuses a transform that enlarges: a block's rotated texels may then exceed a window of `shaders/count.comp.glsl`.
pub(super) fn check_turn(turn: FixedTransform2) -> Result<(), GpuError> {
    let [a, b] = [turn.a, turn.b].map(|part| u64::from(part.unsigned_abs()));
    let [columns, rows] = [COLUMNS, ROWS].map(|side| side as u64 - 1);
    let longest = (columns * a + rows * b).max(columns * b + rows * a);
    let most = (SPAN as u64) << (FixedTransform2::SHIFT - 1);
    within("size of a rotated block", longest, most - 1)
}

impl Blocks {
    /// Draws an attack for maps of a grid. Returns the number of blocks.
    pub(super) fn draw(
        &mut self,
        attack: &AttackDrawing,
        grid: MapGrid,
        counted: Counted,
    ) -> usize {
        self.planes.clear();
        self.blocks.clear();
        self.shape = Shape::new(attack.rect);
        self.slices = grid.slices;
        self.slice.resize(self.shape);
        self.all.resize(self.shape);
        Isa::best().run(
            #[inline(always)]
            || {
                for layer in &attack.layers {
                    self.layer(layer, attack.discs_of(layer), counted);
                }
            },
        );
        self.planes
            .sort_unstable_by_key(|plane| (plane.clock, plane.number, plane.slab));
        self.pack();
        self.blocks.len()
    }

    /// Adds the planes of one slab and clock.
    #[inline(always)]
    fn layer(&mut self, layer: &AttackLayer, [inner, outer]: [&[TimedDisc]; 2], counted: Counted) {
        let (shape, slices) = (self.shape, self.slices);
        if counted.body {
            for discs in inner.chunk_by(|a, b| a.slice == b.slice) {
                self.slice.draw(shape, discs);
                if counted.evasion {
                    self.all.add(shape, &self.slice);
                }
                let first = self.blocks.len();
                self.slice.take(shape, &mut self.blocks);
                self.plane(layer, discs[0].slice, first);
            }
        } else if counted.evasion {
            self.all.draw(shape, inner);
        }
        if counted.outer {
            for discs in outer.chunk_by(|a, b| a.slice == b.slice) {
                let first = self.blocks.len();
                self.slice.draw(shape, discs);
                self.slice.take(shape, &mut self.blocks);
                self.plane(layer, slices + discs[0].slice, first);
            }
        }
        if counted.evasion {
            let first = self.blocks.len();
            self.all.take(shape, &mut self.blocks);
            self.plane(layer, 2 * slices, first);
        }
    }

    /// Adds the plane of the blocks from `first` on, divided into groups that are filtered together. Adds nothing if there are no blocks.
    #[inline(always)]
    fn plane(&mut self, layer: &AttackLayer, number: u32, first: usize) {
        for start in (first..self.blocks.len()).step_by(BATCH) {
            self.planes.push(Plane {
                clock: layer.clock,
                slab: layer.slab.0,
                number,
                first: start as u32,
                end: self.blocks.len().min(start + BATCH) as u32,
            });
        }
    }

    /// Assigns planes to chunks. A plane that does not fit is divided.
    fn pack(&mut self) {
        self.words.clear();
        self.clocks.clear();
        let (mut front, mut back) = (CHUNK, CHUNK);
        for plane in &self.planes {
            let mut first = plane.first;
            while first < plane.end {
                if back - front < PLANE + BLOCK {
                    self.words.resize(self.words.len() + CHUNK, 0);
                    (front, back) = (0, CHUNK);
                }
                let room = (back - front - PLANE) / BLOCK;
                let count = room.min((plane.end - first) as usize);
                let chunk = self.words.len() / CHUNK - 1;
                let words = &mut self.words[chunk * CHUNK..];
                let blocks = &self.blocks[first as usize..first as usize + count];
                let end = back;
                back -= BLOCK * count;
                words[back..end].copy_from_slice(blocks.as_flattened());
                let range = [back, end].map(|word| (word / BLOCK) as u32);
                words[front..front + PLANE].copy_from_slice(&[
                    plane.slab as u32,
                    plane.number,
                    range[0],
                    range[1],
                ]);
                let number = (front / PLANE) as u32;
                let (clock, chunk) = (plane.clock, chunk as u32);
                match self.clocks.last_mut() {
                    Some(last) if (last.clock, last.chunk) == (clock, chunk) => {
                        last.planes.end = number + 1;
                    }
                    _ => self.clocks.push(ClockPlanes {
                        clock,
                        chunk,
                        planes: number..number + 1,
                    }),
                }
                front += PLANE;
                first += count as u32;
            }
        }
    }

    pub(super) fn planes_of(&self, chunk: u32, clock: u32) -> Range<u32> {
        let mut clocks = self.clocks.iter();
        let found = clocks.find(|one| (one.chunk, one.clock) == (chunk, clock));
        found.map_or(0..0, |one| one.planes.clone())
    }

    /// Maximum number of planes of one clock in one chunk.
    pub(super) fn most_planes(&self) -> u32 {
        let planes = self.clocks.iter().map(|one| one.planes.len() as u32);
        planes.max().unwrap_or(0)
    }

    pub(super) fn chunks(&self) -> u32 {
        (self.words.len() / CHUNK) as u32
    }

    /// Maximum number of chunks of an attack with a number of blocks. Only the last chunk has room for a plane of one block.
    pub(super) fn most_chunks(blocks: u32) -> u64 {
        u64::from(blocks).div_ceil((CHUNK / (PLANE + BLOCK)) as u64)
    }
}
