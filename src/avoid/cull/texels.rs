//! The attack's maps as lists of small blocks of texels, which the CPU draws once a query and
//! every candidate is held against.

use std::ops::Range;

use super::{AttackDrawing, TimedDisc};
use crate::region::{MapRect, Slab, for_each_row};

/// Side of a block, texels.
pub const BLOCK: usize = 4;
/// Texels of a block.
pub const BLOCK_TEXELS: usize = BLOCK * BLOCK;

/// The texels that an attack covers, in blocks of 4 × 4.
///
/// Texel `k` of a block lies `k % 4` columns and `k / 4` rows from the block's first one. Texels
/// that nothing covers, and those beyond the attack's rectangle, have masks of 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AttackTexels {
    /// Words of a mask: 1 or 2.
    pub lanes: usize,
    /// Those of the drawing, in order.
    pub layers: Vec<TexelLayer>,
    /// Column and row of each block's first texel, counted from the attack's rectangle.
    pub places: Vec<[i32; 2]>,
    /// `[block][lane][texel of the block]`.
    pub inner: Vec<u32>,
    /// `[block][lane][texel of the block]`.
    pub outer: Vec<u32>,
    /// Scratch: for each block of the rectangle one more than its number in the list, 0 for none.
    numbers: Vec<u32>,
}

/// The attack in one slab, by one clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TexelLayer {
    /// Which height.
    pub slab: Slab,
    /// Which clock.
    pub clock: u32,
    /// Its blocks.
    pub blocks: Range<u32>,
}

impl AttackTexels {
    /// Draws an attack, with masks of `lanes` words. Allocates nothing once it has held as much.
    pub fn draw(&mut self, attack: &AttackDrawing, lanes: usize) {
        self.lanes = lanes;
        self.layers.clear();
        self.places.clear();
        self.inner.clear();
        self.outer.clear();
        let across = (attack.rect.width as usize).div_ceil(BLOCK);
        let down = (attack.rect.height as usize).div_ceil(BLOCK);
        self.numbers.clear();
        self.numbers.resize(across * down, 0);
        for layer in &attack.layers {
            let first = self.places.len();
            let [inner, outer] = attack.discs_of(layer);
            for &disc in inner {
                self.fill(disc, attack.rect, true);
            }
            for &disc in outer {
                self.fill(disc, attack.rect, false);
            }
            for &[u, v] in &self.places[first..] {
                self.numbers[v as usize / BLOCK * across + u as usize / BLOCK] = 0;
            }
            self.layers.push(TexelLayer {
                slab: layer.slab,
                clock: layer.clock,
                blocks: first as u32..self.places.len() as u32,
            });
        }
    }

    fn fill(&mut self, TimedDisc { disc, slice }: TimedDisc, rect: MapRect, is_inner: bool) {
        let across = (rect.width as usize).div_ceil(BLOCK);
        let lane = slice as usize / 32;
        let bit = 1 << (slice % 32);
        for_each_row(disc, rect, |row, first, last| {
            for column in first / BLOCK..=last / BLOCK {
                let block = self.block(row / BLOCK * across + column, [column, row / BLOCK]);
                let start = (block * self.lanes + lane) * BLOCK_TEXELS + row % BLOCK * BLOCK;
                let masks = if is_inner {
                    &mut self.inner
                } else {
                    &mut self.outer
                };
                let from = first.max(column * BLOCK) - column * BLOCK;
                let to = last.min(column * BLOCK + BLOCK - 1) - column * BLOCK;
                for mask in &mut masks[start + from..=start + to] {
                    *mask |= bit;
                }
            }
        });
    }

    /// The number of a block in the list, where it is put if it is not there.
    fn block(&mut self, index: usize, [column, row]: [usize; 2]) -> usize {
        if self.numbers[index] == 0 {
            self.places
                .push([(column * BLOCK) as i32, (row * BLOCK) as i32]);
            self.numbers[index] = self.places.len() as u32;
            let words = self.places.len() * self.lanes * BLOCK_TEXELS;
            self.inner.resize(words, 0);
            self.outer.resize(words, 0);
        }
        self.numbers[index] as usize - 1
    }
}
