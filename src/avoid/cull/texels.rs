//! The attack's maps as lists of small blocks of texels, which are drawn once a query and every
//! candidate is held against.
//!
//! A layer is drawn into dense rows of masks first, disc by disc and row by row, and then taken
//! from there block by block; what was drawn is wiped on the way.

use std::ops::Range;

use super::{AttackDrawing, AttackLayer, Counted, TimedDisc};
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
    canvas: Canvas,
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

/// One layer, dense: scratch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Canvas {
    /// Columns of whole blocks.
    columns: usize,
    /// `[inner, outer][lane][row][column]`; all 0 between two layers.
    masks: Vec<u32>,
    /// For each row of blocks what is drawn into.
    bands: Vec<Band>,
}

/// Columns of blocks, from the first one to the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Band {
    first: usize,
    end: usize,
}

impl Band {
    const EMPTY: Self = Self {
        first: usize::MAX,
        end: 0,
    };
}

impl AttackTexels {
    /// Draws an attack, with masks of `lanes` words. Allocates nothing once it has held as much.
    pub fn draw(&mut self, attack: &AttackDrawing, lanes: usize) {
        self.draw_only(attack, lanes, Counted::ALL);
    }

    /// The same without outer masks where those are not counted: there are none then.
    pub(super) fn draw_only(&mut self, attack: &AttackDrawing, lanes: usize, counted: Counted) {
        self.lanes = lanes;
        self.layers.clear();
        self.places.clear();
        self.inner.clear();
        self.outer.clear();
        self.canvas.stretch(attack.rect, lanes);
        for layer in &attack.layers {
            let first = self.places.len() as u32;
            self.canvas.draw(attack, layer, (lanes, counted));
            self.take_blocks(counted);
            self.layers.push(TexelLayer {
                slab: layer.slab,
                clock: layer.clock,
                blocks: first..self.places.len() as u32,
            });
        }
    }

    /// Moves what is drawn from the canvas to the end of the lists.
    fn take_blocks(&mut self, counted: Counted) {
        let kinds = if counted.outer { 2 } else { 1 };
        let Canvas {
            columns,
            masks,
            bands,
        } = &mut self.canvas;
        let plane = bands.len() * BLOCK * *columns;
        for (band, drawn) in bands.iter_mut().enumerate() {
            let Band { first, end } = std::mem::replace(drawn, Band::EMPTY);
            for block in first..end {
                let mut any = 0;
                let lists = [&mut self.inner, &mut self.outer].into_iter().take(kinds);
                for (kind, list) in lists.enumerate() {
                    for lane in 0..self.lanes {
                        let start = (kind * self.lanes + lane) * plane;
                        for row in 0..BLOCK {
                            let at = start + (band * BLOCK + row) * *columns + block * BLOCK;
                            let texels = &mut masks[at..at + BLOCK];
                            any |= texels.iter().fold(0, |any, mask| any | mask);
                            list.extend_from_slice(texels);
                            texels.fill(0);
                        }
                    }
                }
                if any == 0 {
                    let words = self.places.len() * self.lanes * BLOCK_TEXELS;
                    self.inner.truncate(words);
                    self.outer.truncate(words);
                } else {
                    self.places
                        .push([(block * BLOCK) as i32, (band * BLOCK) as i32]);
                }
            }
        }
    }
}

impl Canvas {
    /// Makes room for maps of a rectangle.
    fn stretch(&mut self, rect: MapRect, lanes: usize) {
        let bands = (rect.height as usize).div_ceil(BLOCK);
        self.columns = (rect.width as usize).next_multiple_of(BLOCK);
        self.bands.clear();
        self.bands.resize(bands, Band::EMPTY);
        // What is there is 0, whatever its place was.
        let words = 2 * lanes * bands * BLOCK * self.columns;
        if self.masks.len() < words {
            self.masks.resize(words, 0);
        }
    }

    fn draw(
        &mut self,
        attack: &AttackDrawing,
        layer: &AttackLayer,
        (lanes, counted): (usize, Counted),
    ) {
        let plane = self.bands.len() * BLOCK * self.columns;
        let [inner, outer] = attack.discs_of(layer);
        let outer = if counted.outer { outer } else { &[] };
        for (kind, discs) in [inner, outer].into_iter().enumerate() {
            for &TimedDisc { disc, slice } in discs {
                let lane = slice as usize / 32;
                let bit = 1 << (slice % 32);
                let start = (kind * lanes + lane) * plane;
                let masks = &mut self.masks[start..start + plane];
                let (columns, bands) = (self.columns, &mut self.bands);
                for_each_row(disc, attack.rect, |row, first, last| {
                    let band = &mut bands[row / BLOCK];
                    band.first = band.first.min(first / BLOCK);
                    band.end = band.end.max(last / BLOCK + 1);
                    let row = row * columns;
                    for mask in &mut masks[row + first..=row + last] {
                        *mask |= bit;
                    }
                });
            }
        }
    }
}
