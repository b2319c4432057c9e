//! The attack's maps as lists of small blocks of texels. They are drawn once per query and compared with every candidate.
//!
//! Each layer is drawn disc by disc onto a canvas of blocks, sixteen texels at once. Blocks with texels are then moved to the list, which clears
//! the canvas. Sixteen blocks at a time are summarised in a group.

use std::ops::Range;

use super::drawing::{AttackDrawing, AttackLayer, TimedDisc};
use super::path::Counted;
use crate::maps::{BlockAxis, Disc, MapRect, SUB_TEXELS, Slab};
use crate::math::Isa;

/// Side of a block, in texels.
pub(super) const BLOCK: usize = 4;

const SIDE: i32 = BLOCK as i32 * SUB_TEXELS;

pub(super) const BLOCK_TEXELS: usize = BLOCK * BLOCK;

/// One word of the mask of each texel of a block. Texel `k` lies `k % 4` columns and `k / 4` rows from the block's first texel.
pub(super) type BlockMasks = [u32; BLOCK_TEXELS];

/// The texels that an attack covers, in blocks of 4 × 4. Other texels of these blocks have masks of 0.
#[derive(Clone, Debug, Default)]
pub(super) struct AttackTexels {
    /// Number of words in a mask: 1 or 2.
    pub(super) lanes: usize,
    /// Layers of the drawing, in order.
    pub(super) layers: Vec<TexelLayer>,
    /// Column and row of each block's first texel, relative to the attack's rectangle.
    pub(super) places: Vec<[i32; 2]>,
    /// Masks of inner texels, `[block][lane]`.
    pub(super) inner: Vec<BlockMasks>,
    /// Masks of outer texels, `[block][lane]`; empty if outer maps are not counted.
    pub(super) outer: Vec<BlockMasks>,
    canvas: Canvas,
}

/// The attack in one slab, relative to one clock.
#[derive(Clone, Debug)]
pub(super) struct TexelLayer {
    pub(super) slab: Slab,
    pub(super) clock: u32,
    pub(super) blocks: Range<u32>,
}

/// One layer, as a dense array of blocks.
#[derive(Clone, Debug, Default)]
struct Canvas {
    rect: MapRect,
    /// Number of blocks in a row.
    columns: usize,
    /// Number of masks in a block: the lanes of the inner map, then those of the outer map.
    parts: usize,
    /// Masks of blocks, `[row][column][part]`. All are 0 between two layers.
    masks: Vec<BlockMasks>,
    /// Range of the blocks of each row that may have texels.
    bands: Vec<Range<usize>>,
}

/// A row of blocks without texels.
const NOTHING: Range<usize> = Range {
    start: usize::MAX,
    end: 0,
};

impl AttackTexels {
    /// Draws the counted maps of an attack. A mask has `lanes` words.
    pub(super) fn draw(
        &mut self,
        isa: Isa,
        attack: &AttackDrawing,
        lanes: usize,
        counted: Counted,
    ) {
        // Inner masks, and outer masks if they are counted.
        let kinds = if counted.outer { 2 } else { 1 };
        self.lanes = lanes;
        self.layers.clear();
        self.places.clear();
        self.inner.clear();
        self.outer.clear();
        self.canvas.stretch(attack.rect, kinds * lanes);
        isa.run(
            #[inline(always)]
            || {
                for layer in &attack.layers {
                    let first = self.places.len() as u32;
                    self.canvas.draw_layer(attack, layer, lanes, kinds);
                    self.take_blocks();
                    self.layers.push(TexelLayer {
                        slab: layer.slab,
                        clock: layer.clock,
                        blocks: first..self.places.len() as u32,
                    });
                }
            },
        );
    }

    /// Moves the blocks with texels from the canvas to the end of the lists.
    #[inline(always)]
    fn take_blocks(&mut self) {
        let canvas = &mut self.canvas;
        for row in 0..canvas.bands.len() {
            for column in std::mem::replace(&mut canvas.bands[row], NOTHING) {
                let start = (row * canvas.columns + column) * canvas.parts;
                let inside = inside(canvas.rect, [column, row]);
                let masks = &mut canvas.masks[start..start + canvas.parts];
                let mut any = 0;
                for mask in masks.iter_mut() {
                    if let Some(inside) = &inside {
                        mask.iter_mut().zip(inside).for_each(|(m, i)| *m &= i);
                    }
                    any |= any_of(mask);
                }
                if any != 0 {
                    let (inner, outer) = masks.split_at(self.lanes);
                    self.inner.extend_from_slice(inner);
                    self.outer.extend_from_slice(outer);
                    let place = [column, row].map(|block| (block * BLOCK) as i32);
                    self.places.push(place);
                    masks.fill([0; BLOCK_TEXELS]);
                }
            }
        }
    }
}

#[inline(always)]
pub(super) fn any_of(masks: &BlockMasks) -> u32 {
    masks.iter().fold(0, |any, mask| any | mask)
}

/// A mask of the block's texels that lie in a rectangle; `None` if all of them do.
#[inline(always)]
fn inside(rect: MapRect, block: [usize; 2]) -> Option<BlockMasks> {
    let [left, below] = [(rect.width, block[0]), (rect.height, block[1])]
        .map(|(side, block)| side as usize - block * BLOCK);
    (left < BLOCK || below < BLOCK).then(|| {
        std::array::from_fn(|k| {
            let within = k % BLOCK < left && k / BLOCK < below;
            if within { u32::MAX } else { 0 }
        })
    })
}

impl Canvas {
    fn stretch(&mut self, rect: MapRect, parts: usize) {
        let rows = (rect.height as usize).div_ceil(BLOCK);
        self.rect = rect;
        self.columns = (rect.width as usize).div_ceil(BLOCK);
        self.parts = parts;
        self.bands.clear();
        self.bands.resize(rows, NOTHING);
        // All existing masks are 0.
        let blocks = rows * self.columns * parts;
        if self.masks.len() < blocks {
            self.masks.resize(blocks, [0; BLOCK_TEXELS]);
        }
    }

    #[inline(always)]
    fn draw_layer(
        &mut self,
        attack: &AttackDrawing,
        layer: &AttackLayer,
        lanes: usize,
        kinds: usize,
    ) {
        let discs = attack.discs_of(layer).into_iter().take(kinds);
        for (kind, discs) in discs.enumerate() {
            for &TimedDisc { disc, slice } in discs {
                self.draw(disc, kind * lanes + slice as usize / 32, 1 << (slice % 32));
            }
        }
    }

    /// Draws a disc block by block, with the arithmetic of [`Disc::covers`]: sets a bit in one of the masks of each block.
    #[inline(always)]
    fn draw(&mut self, disc: Disc, part: usize, bit: u32) {
        let radius = disc.radius.min(Disc::MAX_RADIUS);
        let [rows, columns] =
            [self.bands.len(), self.columns].map(|count| BlockAxis { side: SIDE, count });
        let (rows, columns) = (rows.near(disc.z, radius), columns.near(disc.x, radius));
        if columns.is_empty() {
            return;
        }
        for row in rows {
            let band = &mut self.bands[row];
            *band = band.start.min(columns.start)..band.end.max(columns.end);
            let mut left = [0; BLOCK_TEXELS];
            for (k, left) in left.iter_mut().enumerate() {
                let dz = centre(row, k / BLOCK) - disc.z;
                *left = radius * radius - dz * dz;
            }
            for column in columns.clone() {
                let at = (row * self.columns + column) * self.parts + part;
                let masks = &mut self.masks[at];
                for (k, (mask, left)) in masks.iter_mut().zip(&left).enumerate() {
                    let dx = centre(column, k % BLOCK) - disc.x;
                    *mask |= if dx * dx <= *left { bit } else { 0 };
                }
            }
        }
    }
}

/// Centre of a texel of a block along one axis, in sub-texels.
#[inline(always)]
fn centre(block: usize, texel: usize) -> i32 {
    (block * BLOCK + texel) as i32 * SUB_TEXELS + SUB_TEXELS / 2
}

/// Number of blocks in a group.
pub(super) const LANES: usize = 16;

/// Summaries of sixteen blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    /// Position of each block's middle, in half texels.
    pub u: [i32; LANES],
    pub v: [i32; LANES],
    /// Union of the slices of each block's texels, `[lane][block]`.
    pub outer: [[u32; LANES]; 2],
    pub inner: [[u32; LANES]; 2],
    /// For each block, all bits set if it has an inner texel, otherwise 0.
    pub any_inner: [u32; LANES],
    pub has_inner: bool,
    /// A bit for each block that exists in the group.
    pub blocks: u32,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    /// First group and first block of each layer. The last entry is the end of all groups and blocks.
    layers: Vec<(usize, usize)>,
    /// The layers, the largest first, because a hit is most likely there.
    pub(super) largest_first: Vec<usize>,
}

impl Groups {
    pub(super) fn take(&mut self, isa: Isa, texels: &AttackTexels) {
        self.groups.clear();
        self.layers.clear();
        isa.run(
            #[inline(always)]
            || {
                for layer in &texels.layers {
                    let (start, end) = (layer.blocks.start as usize, layer.blocks.end as usize);
                    self.layers.push((self.groups.len(), start));
                    for first in (start..end).step_by(LANES) {
                        self.groups.push(Group::new(texels, first, end));
                    }
                }
            },
        );
        self.layers.push((self.groups.len(), 0));
        self.largest_first.clear();
        self.largest_first.extend(0..texels.layers.len());
        let blocks = |index: usize| texels.layers[index].blocks.len();
        self.largest_first
            .sort_unstable_by_key(|&index| (std::cmp::Reverse(blocks(index)), index));
    }

    /// The groups of one layer, each with its first block.
    pub(super) fn of_layer(&self, layer: usize) -> impl Iterator<Item = (&Group, usize)> {
        let (start, first) = self.layers[layer];
        let groups = &self.groups[start..self.layers[layer + 1].0];
        groups.iter().zip((first..).step_by(LANES))
    }
}

impl Group {
    #[inline(always)]
    fn new(texels: &AttackTexels, first: usize, end: usize) -> Self {
        let mut group = Self::default();
        for (at, block) in (first..end.min(first + LANES)).enumerate() {
            let [u, v] = texels.places[block];
            (group.u[at], group.v[at]) = (2 * u + BLOCK as i32, 2 * v + BLOCK as i32);
            group.blocks |= 1 << at;
            for lane in 0..texels.lanes {
                let index = block * texels.lanes + lane;
                // There may be no outer texels.
                group.outer[lane][at] = texels.outer.get(index).map_or(0, any_of);
                group.inner[lane][at] = any_of(&texels.inner[index]);
                if group.inner[lane][at] != 0 {
                    group.any_inner[at] = u32::MAX;
                    group.has_inner = true;
                }
            }
        }
        group
    }
}
