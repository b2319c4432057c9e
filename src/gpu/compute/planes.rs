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
#[derive(Debug)]
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
                slab.evasion.for_each(|column, row| {
                    plane.set(&mut drawing.words, [column + evasion.u, row + evasion.v]);
                });
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
        let rect = map.rect();
        for (mask, index) in map.masks().chunks_exact(map.lanes()).zip(0..) {
            let place = [
                rect.u + index % rect.width as i32,
                rect.v + index / rect.width as i32,
            ];
            for (lane, &word) in mask.iter().enumerate() {
                let mut left = word;
                while left != 0 {
                    let slice = 32 * lane + left.trailing_zeros() as usize;
                    left &= left - 1;
                    if let Some(plane) = &planes[slice] {
                        plane.set(&mut self.words, place);
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
    /// Sets a texel's bit in the strips that hold it.
    #[inline]
    fn set(&self, words: &mut [u32], [u, v]: [i32; 2]) {
        let (x, z) = ((u - self.origin[0]) as u32, (v - self.origin[1]) as u32);
        let last = x / STRIDE;
        for strip in last.saturating_sub(1)..=last.min(self.strips - 1) {
            let word = self.start + strip * self.rows + z / 2;
            words[word as usize] |= 1 << (16 * (z % 2) + x - STRIDE * strip);
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
