//! The maps of all evasions as the shader reads them: a plane of bits for each region, slab and slice.
//!
//! A plane is stored as overlapping strips of 16 columns with a stride of 8. A word of a strip holds two rows. For any position and
//! rotation of a block of 8 × 4 texels of the attack, its texels lie in five consecutive words of one strip. This minimises the number of
//! reads, which dominate the cost.

use std::ops::Range;

use super::blocks::SPAN;
use crate::{
    gpu::{GpuError, error::within},
    maps::{MapGrid, MapRect, MaskMap, RegionAtlas, RegionMaps},
};

/// Number of words of a window.
const WINDOW: u32 = 5;
/// Stride of strips, in columns.
const STRIDE: u32 = 8;
/// Words of an entry: index of its first word, its first texel, and the number of positions of a window's first texel.
const ENTRY: usize = 3;

/// Alignment of pages, in words: 256 bytes, the largest alignment that a device may require.
const ALIGNMENT: usize = 64;

/// Position of a region's planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneRegion {
    /// Index in [`Planes::pages`].
    pub(super) page: u32,
    /// Word of the page at which its first entry starts: `[slab][slices of body, slices of outer, evasion]`.
    pub(super) entries: u32,
    pub(super) first_slab: i32,
    pub(super) slabs: u32,
}

/// The atlas in the layout of the shader.
#[derive(Debug, Default)]
pub(super) struct Planes {
    /// Entries, then planes, region by region.
    pub(super) words: Vec<u32>,
    pub(super) regions: Vec<PlaneRegion>,
    /// Words that are bound at a time, each some regions whole: no more than a device reads from one buffer.
    pub(super) pages: Vec<Range<usize>>,
    pub(super) grid: MapGrid,
}

/// Maximum size of a page.
#[derive(Clone, Copy, Debug)]
pub(super) struct PageLimit {
    /// The setting or the limit of the device that it comes from.
    pub(super) name: &'static str,
    pub(super) bytes: u64,
}

/// One region's words, counted from its first entry.
struct Drawing {
    words: Vec<u32>,
    entries: usize,
    slices: u32,
}

/// Where the bits of a plane go.
#[derive(Clone, Copy)]
struct Plane {
    /// Word.
    start: u32,
    /// Texel of the first place.
    origin: [i32; 2],
    strips: u32,
    /// Words of a strip.
    rows: u32,
}

impl Planes {
    /// Draws the planes of an atlas. Fails if the words of one region exceed a page.
    pub(super) fn new(atlas: &RegionAtlas, limit: PageLimit) -> Result<Self, GpuError> {
        let grid = atlas.grid();
        let mut planes = Self {
            words: Vec::new(),
            regions: Vec::with_capacity(atlas.regions().len()),
            pages: Vec::new(),
            grid,
        };
        for region in atlas.regions() {
            let drawing = Drawing::new(region, grid.slices);
            within(limit.name, 4 * drawing.words.len() as u64, limit.bytes)?;
            planes.add(region, drawing, limit.bytes);
        }
        Ok(planes)
    }

    /// Puts a region's words on the last page, or, where they do not fit, on a new one.
    fn add(&mut self, region: &RegionMaps, drawing: Drawing, most: u64) {
        let end = self.words.len() + drawing.words.len();
        let fits = |page: &Range<usize>| 4 * (end - page.start) as u64 <= most;
        if !self.pages.last().is_some_and(fits) {
            self.words
                .resize(self.words.len().next_multiple_of(ALIGNMENT), 0);
            self.pages.push(self.words.len()..self.words.len());
        }
        let page = self.pages.len() - 1;
        let entries = (self.words.len() - self.pages[page].start) as u32;
        self.regions.push(PlaneRegion {
            page: page as u32,
            entries,
            first_slab: region.first_slab.0,
            slabs: region.slabs.len() as u32,
        });
        self.words.extend(drawing.placed(entries));
        self.pages[page].end = self.words.len();
    }
}

impl Drawing {
    fn new(region: &RegionMaps, slices: u32) -> Self {
        let entries = ENTRY * planes_of_slab(slices) as usize * region.slabs.len();
        let mut drawing = Self {
            words: vec![0; entries],
            entries,
            slices,
        };
        let mut entry = 0;
        for slab in &region.slabs {
            for map in [&slab.body, &slab.outer] {
                drawing.draw_slices(map, entry);
                entry += ENTRY * slices as usize;
            }
            let (rect, evasion) = (slab.evasion.bounds(), slab.evasion.rect());
            if let Some(plane) = drawing.open(rect, entry) {
                let rows = slab
                    .evasion
                    .words()
                    .chunks(slab.evasion.words_per_row().max(1));
                for (row, v) in rows.zip(evasion.v..) {
                    for (&texels, u) in row.iter().zip((evasion.u..).step_by(RUN)) {
                        plane.set_run(&mut drawing.words, [u, v], texels);
                    }
                }
            }
            entry += ENTRY;
        }
        drawing
    }

    /// The words, where the first one is word `first` of a page.
    fn placed(mut self, first: u32) -> Vec<u32> {
        for entry in self.words[..self.entries].chunks_exact_mut(ENTRY) {
            // Also where there is no plane: its start is not read.
            entry[0] += first;
        }
        self.words
    }

    /// A map slice by slice, from the first one's entry on.
    fn draw_slices(&mut self, map: &MaskMap, entry: usize) {
        let rects = map.slice_rects(self.slices);
        let planes: Vec<_> = (entry..)
            .step_by(ENTRY)
            .zip(rects)
            .map(|(entry, rect)| self.open(rect, entry))
            .collect();
        let (rect, lanes) = (map.rect(), map.lanes());
        let rows = map.masks().chunks((rect.width as usize * lanes).max(1));
        for (row, v) in rows.zip(rect.v..) {
            for (masks, u) in row.chunks(RUN * lanes).zip((rect.u..).step_by(RUN)) {
                for (lane, planes) in planes.chunks(RUN).enumerate() {
                    let mut runs = [0; RUN];
                    let of_lane = masks.iter().skip(lane).step_by(lanes);
                    runs.iter_mut()
                        .zip(of_lane)
                        .for_each(|(run, &mask)| *run = mask);
                    transpose(&mut runs);
                    for (plane, &texels) in planes.iter().zip(&runs) {
                        if let Some(plane) = plane {
                            plane.set_run(&mut self.words, [u, v], texels);
                        }
                    }
                }
            }
        }
    }

    /// Makes room for a plane of the texels in a rectangle; none for an empty one.
    fn open(&mut self, rect: MapRect, entry: usize) -> Option<Plane> {
        if rect.is_empty() {
            return None;
        }
        let start = self.words.len() as u32;
        // A window that holds some texel of the map starts at one of these places.
        let origin = [rect.u - SPAN, rect.v - SPAN];
        let side = [rect.width, rect.height].map(|side| side + SPAN as u32);
        let plane = Plane {
            start,
            origin,
            strips: (side[0] - 1) / STRIDE + 1,
            rows: (side[1] - 1) / 2 + WINDOW,
        };
        self.words[entry] = start;
        self.words[entry + 1] = halves(origin.map(|texel| texel as u32));
        self.words[entry + 2] = halves(side);
        let end = start + plane.strips * plane.rows;
        self.words.resize(end as usize, 0);
        Some(plane)
    }
}

impl Plane {
    /// Sets texels of a row from a place on, given as bits, in the strips that hold them. All set texels lie in the plane.
    #[inline]
    fn set_run(&self, words: &mut [u32], [u, v]: [i32; 2], texels: u32) {
        if texels == 0 {
            return;
        }
        let x = u - self.origin[0];
        let (x, texels) = match x {
            ..0 => (0, u64::from(texels) >> -x),
            _ => (x as u32, u64::from(texels)),
        };
        let z = (v - self.origin[1]) as u32;
        let first = (x / STRIDE).saturating_sub(1);
        let end = ((x + RUN as u32 - 1) / STRIDE + 1).min(self.strips);
        for strip in first..end {
            let left = STRIDE * strip;
            let of_strip = match left < x {
                true => texels << (x - left),
                false => texels >> (left - x),
            };
            let word = self.start + strip * self.rows + z / 2;
            words[word as usize] |= (of_strip as u32 & 0xffff) << (16 * (z % 2));
        }
    }
}

/// Number of texels of a run: a word has a bit for each.
const RUN: usize = 32;

/// Exchanges rows and columns of a square of bits: bit `i` of word `k` becomes bit `k` of word `i`.
///
/// Source: Warren, Hacker's Delight, section 7-3: blocks off the diagonal change places, from halves down to single bits.
fn transpose(words: &mut [u32; RUN]) {
    let mut mask = u32::MAX;
    for side in [16, 8, 4, 2, 1] {
        mask ^= mask << side;
        for first in (0..RUN).step_by(2 * side) {
            let (low, high) = words[first..first + 2 * side].split_at_mut(side);
            for (low, high) in low.iter_mut().zip(high) {
                let changed = (*low >> side ^ *high) & mask;
                *low ^= changed << side;
                *high ^= changed;
            }
        }
    }
}

/// Planes of a slab.
pub(super) fn planes_of_slab(slices: u32) -> u32 {
    2 * slices + 1
}

/// Two numbers of 16 bits in a word.
fn halves([low, high]: [u32; 2]) -> u32 {
    (low & 0xffff) | high << 16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn rows_become_columns(words in prop::array::uniform32(any::<u32>())) {
            let mut turned = words;
            transpose(&mut turned);
            for (row, word) in words.iter().enumerate() {
                for (column, of_column) in turned.iter().enumerate() {
                    prop_assert_eq!(word >> column & 1, of_column >> row & 1);
                }
            }
        }

        #[test]
        fn each_strip_has_the_texels_of_its_columns(
            [u, v] in [-40..90i32, -3..8i32],
            texels in any::<u32>(),
        ) {
            let plane = Plane { start: 3, origin: [-5, -4], strips: 10, rows: 9 };
            let is_inside = |bit: &i32| (0..STRIDE as i32 * 9).contains(&(u + bit - plane.origin[0]));
            let inside: Vec<i32> = (0..32).filter(is_inside).filter(|bit| texels >> bit & 1 == 1).collect();
            let texels = inside.iter().fold(0, |texels, bit| texels | 1 << bit);
            let mut words = vec![0; 3 + 10 * 9];
            plane.set_run(&mut words, [u, v], texels);
            let mut expected = vec![0; words.len()];
            for bit in inside {
                let (x, z) = (u + bit - plane.origin[0], v - plane.origin[1]);
                for strip in 0..10 {
                    let column = x - 8 * strip;
                    if (0..16).contains(&column) {
                        expected[(3 + strip * 9 + z / 2) as usize] |= 1 << (16 * (z % 2) + column);
                    }
                }
            }
            prop_assert_eq!(words, expected);
        }
    }
}
