//! CPU rasterizer. It has the same functions as the stencil passes in `gpu` and produces identical
//! maps.
//!
//! Source: Masaoka & Oshita, section 4.3. A disc is filled row by row. In each row it covers a
//! range of columns, which an exact integer square root finds and whole-word writes fill.

use std::ops::Range;

use super::bit_map::{BitMap, Drawing, MapRect};
use super::map_grid::{Disc, SUB_TEXELS};

/// Maps that [`every_frame`] draws.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EvasionMaps {
    /// Texels that are covered in every frame.
    pub body: BitMap,
    /// Texels that are covered in the first frame but not in every frame.
    pub evasion: BitMap,
}

/// Draws the texels that are covered in every frame, and the texels that are covered in the first
/// frame but not in every frame.
pub fn every_frame(drawing: &Drawing) -> EvasionMaps {
    let mut body = BitMap::new(drawing.rect);
    let mut evasion = body.clone();
    let mut now = body.clone();
    for frame in 0..drawing.frames() {
        let target = if frame == 0 { &mut body } else { &mut now };
        for disc in drawing.frame(frame) {
            fill(*disc, target);
        }
        if frame == 0 {
            evasion.words_mut().copy_from_slice(body.words());
            continue;
        }
        for (body, now) in body.words_mut().iter_mut().zip(now.words_mut()) {
            *body &= std::mem::take(now);
        }
    }
    for (evasion, body) in evasion.words_mut().iter_mut().zip(body.words()) {
        *evasion &= !body;
    }
    EvasionMaps { body, evasion }
}

/// Draws the texels that are covered in at least one frame.
pub fn any_frame(drawing: &Drawing) -> BitMap {
    let mut map = BitMap::new(drawing.rect);
    for disc in &drawing.discs {
        fill(*disc, &mut map);
    }
    map
}

/// Sets the texels of a map that a disc covers. The disc is relative to the map's first texel.
fn fill(disc: Disc, map: &mut BitMap) {
    let rect = map.rect();
    let words = map.words_per_row();
    let all = map.words_mut();
    for_each_row(disc, rect, |row, first, last| {
        let row = &mut all[row * words..(row + 1) * words];
        let (from, to) = (first / 32, last / 32);
        let (low, high) = (u32::MAX << (first % 32), u32::MAX >> (31 - last % 32));
        if from == to {
            row[from] |= low & high;
            return;
        }
        row[from] |= low;
        row[from + 1..to].fill(u32::MAX);
        row[to] |= high;
    });
}

/// Blocks of texels along one axis of a map.
#[derive(Clone, Copy)]
pub(crate) struct BlockAxis {
    /// Side of a block, in sub-texels.
    pub(crate) side: i32,
    pub(crate) count: usize,
}

impl BlockAxis {
    /// Range of blocks that a disc may cover. They are close enough to the disc that squared distances fit 32 bits.
    #[inline(always)]
    pub(crate) fn near(self, centre: i32, radius: i32) -> Range<usize> {
        let Self { side, count } = self;
        let centre = centre.clamp(-FAR, FAR);
        let block = |place: i32| place.div_euclid(side).clamp(0, count as i32);
        block(centre - radius) as usize..block(centre + radius + side) as usize
    }
}

/// Maximum coordinate of a disc, in sub-texels. Maps lie far closer to the origin, and sums of
/// clamped coordinates fit 32 bits.
const FAR: i32 = 1 << 29;

/// Calls `visit` with each row that a disc covers, its first covered column and its last covered
/// column.
fn for_each_row(disc: Disc, rect: MapRect, mut visit: impl FnMut(usize, usize, usize)) {
    let (x, z) = (disc.x.clamp(-FAR, FAR), disc.z.clamp(-FAR, FAR));
    let radius = disc.radius.min(Disc::MAX_RADIUS);
    let half = SUB_TEXELS / 2;
    // Texels whose centres lie between `low` and `high`.
    let span = |low: i32, high: i32, texels: u32| {
        let first = -(half - low).div_euclid(SUB_TEXELS);
        let last = (high - half).div_euclid(SUB_TEXELS);
        (first.max(0), last.min(texels as i32 - 1))
    };
    let (first_row, last_row) = span(z - radius, z + radius, rect.height);
    for row in first_row..=last_row {
        let dz = row * SUB_TEXELS + half - z;
        let reach = integer_sqrt(radius * radius - dz * dz);
        let (first, last) = span(x - reach, x + reach, rect.width);
        if first <= last {
            visit(row as usize, first as usize, last as usize);
        }
    }
}

/// Largest integer whose square is at most `value`. `value` must not be negative.
#[inline(always)]
fn integer_sqrt(value: i32) -> i32 {
    // The single-precision root is off by at most one.
    let root = (value as f32).sqrt() as i32;
    let root = root - i32::from(root * root > value);
    root + i32::from((root + 1) * (root + 1) <= value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn roots_are_exact(root in 0..=Disc::MAX_RADIUS, beyond in 0i32..64_001) {
            prop_assert_eq!(integer_sqrt(root * root), root);
            let value = root * root + beyond.min(2 * root);
            prop_assert_eq!(integer_sqrt(value), root);
            prop_assert_eq!(integer_sqrt(i32::max(root * root - 1, 0)), i32::max(root - 1, 0));
        }
    }
}
