//! Draws planes of the attack, with a word for each block of 8 × 4 texels. A disc is drawn block by block, all texels of a block at once.

use std::ops::Range;

use crate::{
    maps::{BlockAxis, Disc, MapRect, SUB_TEXELS},
    query::cull::TimedDisc,
};

/// Number of columns and number of rows of a block, in texels.
pub(super) const COLUMNS: usize = 8;
pub(super) const ROWS: usize = 4;
/// Number of texels of a block. A word has one bit for each.
const TEXELS: usize = COLUMNS * ROWS;

/// The size of all planes of an attack.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    /// Size of the plane, in texels.
    width: usize,
    height: usize,
}

impl Shape {
    /// Shape of the planes of a rectangle.
    pub(super) fn new(rect: MapRect) -> Self {
        Self {
            width: rect.width as usize,
            height: rect.height as usize,
        }
    }

    fn columns(self) -> usize {
        self.width.div_ceil(COLUMNS)
    }

    fn rows(self) -> usize {
        self.height.div_ceil(ROWS)
    }

    /// Bits of the texels of a block that lie in the rectangle.
    #[inline(always)]
    fn within(self, [column, row]: [usize; 2]) -> u32 {
        let columns = (self.width - column * COLUMNS).min(COLUMNS);
        let rows = (self.height - row * ROWS).min(ROWS);
        let row = (0xff >> (COLUMNS - columns)) * 0x0101_0101;
        row & (u32::MAX >> (TEXELS - rows * COLUMNS))
    }

    /// Bits of the texels of a block that a disc covers. `x` and `z` are the vector from the disc's centre to the block's first corner.
    #[inline(always)]
    fn covered([x, z]: [i32; 2], radius: i32) -> u32 {
        let half = SUB_TEXELS / 2;
        let mut covered = 0;
        for k in 0..TEXELS {
            let [u, v] = [k % COLUMNS, k / COLUMNS].map(|texel| texel as i32 * SUB_TEXELS);
            let (dx, dz) = (x + u + half, z + v + half);
            covered |= u32::from(dx * dx <= radius * radius - dz * dz) << k;
        }
        covered
    }
}

/// Bits of one plane, in blocks of 8 × 4 texels. Words of blocks without texels are 0.
#[derive(Debug, Default)]
pub(super) struct PlaneBits {
    words: Vec<u32>,
    /// Rows and columns of the blocks that may not be 0.
    rows: Range<usize>,
    columns: Range<usize>,
}

impl PlaneBits {
    /// Resizes the plane. All existing words are 0.
    pub(super) fn resize(&mut self, shape: Shape) {
        let words = shape.columns() * shape.rows();
        if self.words.len() < words {
            self.words.resize(words, 0);
        }
    }

    /// Draws discs, with the arithmetic of [`Disc::covers`].
    #[inline(always)]
    pub(super) fn draw(&mut self, shape: Shape, discs: &[TimedDisc]) {
        for one in discs {
            let disc = Disc {
                radius: one.disc.radius.min(Disc::MAX_RADIUS),
                ..one.disc
            };
            let [width, height] = [COLUMNS, ROWS].map(|side| side as i32 * SUB_TEXELS);
            let blocks = |side, count| BlockAxis { side, count };
            let columns = blocks(width, shape.columns()).near(disc.x, disc.radius);
            let rows = blocks(height, shape.rows()).near(disc.z, disc.radius);
            if columns.is_empty() || rows.is_empty() {
                continue;
            }
            for row in rows.clone() {
                let words = &mut self.words[row * shape.columns()..][columns.clone()];
                let z = row as i32 * height - disc.z;
                for (column, word) in columns.clone().zip(words) {
                    let x = column as i32 * width - disc.x;
                    *word |= Shape::covered([x, z], disc.radius);
                }
            }
            self.rows = around(&self.rows, &rows);
            self.columns = around(&self.columns, &columns);
        }
    }

    /// Adds the texels of another plane.
    #[inline(always)]
    pub(super) fn add(&mut self, shape: Shape, other: &Self) {
        for row in other.rows.clone() {
            let row = row * shape.columns();
            let places = row + other.columns.start..row + other.columns.end;
            let words = self.words[places.clone()].iter_mut();
            words
                .zip(&other.words[places])
                .for_each(|(word, more)| *word |= more);
        }
        self.rows = around(&self.rows, &other.rows);
        self.columns = around(&self.columns, &other.columns);
    }

    /// Moves the texels to the end of a list: position and word of each block with texels.
    #[inline(always)]
    pub(super) fn take(&mut self, shape: Shape, blocks: &mut Vec<[u32; 2]>) {
        let columns = std::mem::take(&mut self.columns);
        for row in std::mem::take(&mut self.rows) {
            for column in columns.clone() {
                let word = std::mem::take(&mut self.words[row * shape.columns() + column]);
                let word = word & shape.within([column, row]);
                if word != 0 {
                    blocks.push([(column | row << 16) as u32, word]);
                }
            }
        }
    }
}

/// Smallest range that contains both.
fn around(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    if a.is_empty() {
        return b.clone();
    }
    if b.is_empty() {
        return a.clone();
    }
    a.start.min(b.start)..a.end.max(b.end)
}
