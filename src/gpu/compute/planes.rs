//! The maps of all evasions as the shader reads them: a plane of bits for each region, slab and slice.
//!
//! A plane is stored as overlapping strips of 16 columns with a stride of 8. A word of a strip holds two rows. For any position and
//! rotation of a block of 8 × 4 texels of the attack, its texels lie in five consecutive words of one strip. This minimises the number of
//! reads, which dominate the cost.

use super::blocks::SPAN;
use crate::math::parallel::each;
use crate::{
    maps::{MapGrid, MapRect, MaskMap, RegionAtlas, RegionMaps},
    math::in_parallel,
};

const WINDOW: u32 = 5;
/// Stride of strips, in columns.
const STRIDE: u32 = 8;
/// Number of words of an entry: index of its first word, its first texel, and the number of positions of a window's first texel.
const ENTRY: usize = 3;

/// Position of a region's planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneRegion {
    /// Index of the region's first entry among the words. Order of the entries: `[slab][slices of body, slices of outer, evasion]`.
    pub(super) entries: u32,
    pub(super) first_slab: i32,
    pub(super) slabs: u32,
}

/// The atlas in the layout of the shader.
#[derive(Debug, Default)]
pub(super) struct Planes {
    /// Number of words of all regions. A region has its entries first, then its planes.
    pub(super) words: usize,
    pub(super) regions: Vec<PlaneRegion>,
    /// Planes of each region, until they have been written.
    layouts: Vec<RegionLayout>,
    pub(super) grid: MapGrid,
}

#[derive(Clone, Copy, Debug)]
struct Plane {
    /// Index of the plane's first word, counted from the region's first entry.
    start: u32,
    /// Texel at the first window position.
    origin: [i32; 2],
    /// Number of window positions along columns and along rows.
    sides: [u32; 2],
    strips: u32,
    /// Number of words of a strip.
    rows: u32,
}

/// Planes of a region, one for each entry. `None` is a plane without set texels.
#[derive(Debug)]
struct RegionLayout {
    slices: u32,
    planes: Vec<Option<Plane>>,
    /// Number of words of the entries and the planes.
    words: usize,
}

impl Planes {
    /// Lays out the planes of an atlas.
    pub(super) fn new(atlas: &RegionAtlas) -> Self {
        let (grid, regions) = (atlas.grid(), atlas.regions());
        let layouts = in_parallel(0, regions.len(), |region| {
            RegionLayout::new(&regions[region], grid.slices)
        });
        let mut words = 0;
        let place = |(region, layout): (&RegionMaps, &RegionLayout)| {
            let entries = words as u32;
            words += layout.words;
            PlaneRegion {
                entries,
                first_slab: region.first_slab.0,
                slabs: region.slabs.len() as u32,
            }
        };
        Self {
            regions: regions.iter().zip(&layouts).map(place).collect(),
            words,
            layouts,
            grid,
        }
    }

    /// Draws the planes. `atlas` is the atlas that they were laid out for. Call it before [`Planes::forget_layouts`].
    pub(super) fn write(&self, atlas: &RegionAtlas, mut out: &mut [u32]) {
        let parts = self.layouts.iter().zip(&self.regions).zip(atlas.regions());
        let parts = parts.map_while(|((layout, place), region)| {
            let to = out.split_off_mut(..layout.words)?;
            Some((to, (layout, place, region)))
        });
        each(
            parts,
            |(to, (layout, place, region)), words: &mut Vec<u32>| {
                layout.draw(region, place.entries, words);
                to.copy_from_slice(words);
            },
        );
    }

    /// Frees the layouts, which only [`Planes::write`] needs.
    pub(super) fn forget_layouts(&mut self) {
        self.layouts = Vec::new();
    }
}

impl RegionLayout {
    fn new(region: &RegionMaps, slices: u32) -> Self {
        let entries = planes_of_slab(slices) as usize * region.slabs.len();
        let mut layout = Self {
            slices,
            planes: Vec::with_capacity(entries),
            words: ENTRY * entries,
        };
        for slab in &region.slabs {
            for map in [&slab.body, &slab.outer] {
                for rect in map.slice_rects(slices) {
                    layout.push(rect);
                }
            }
            layout.push(slab.evasion.bounds());
        }
        layout
    }

    /// Makes room for a plane of the texels in a rectangle, if there are any.
    fn push(&mut self, rect: MapRect) {
        let plane = (!rect.is_empty()).then(|| {
            let sides = [rect.width, rect.height].map(|side| side + SPAN as u32);
            Plane {
                start: self.words as u32,
                // A window that holds some texel of the map starts at one of these places.
                origin: [rect.u - SPAN, rect.v - SPAN],
                sides,
                strips: (sides[0] - 1) / STRIDE + 1,
                rows: (sides[1] - 1) / 2 + WINDOW,
            }
        });
        self.words += plane.map_or(0, |plane| (plane.strips * plane.rows) as usize);
        self.planes.push(plane);
    }

    /// Draws all planes of the region, whose first entry is word `first`.
    fn draw(&self, region: &RegionMaps, first: u32, words: &mut Vec<u32>) {
        words.clear();
        words.resize(self.words, 0);
        for (entry, plane) in words.chunks_exact_mut(ENTRY).zip(&self.planes) {
            if let Some(plane) = plane {
                entry[0] = first + plane.start;
                entry[1] = halves(plane.origin.map(|texel| texel as u32));
                entry[2] = halves(plane.sides);
            }
        }
        let of_slabs = self
            .planes
            .chunks_exact(planes_of_slab(self.slices) as usize);
        for (slab, planes) in region.slabs.iter().zip(of_slabs) {
            let (body, planes) = planes.split_at(self.slices as usize);
            let (outer, evasion) = planes.split_at(self.slices as usize);
            draw_slices(&slab.body, body, words);
            draw_slices(&slab.outer, outer, words);
            if let ([Some(plane)], MapRect { u, v, .. }) = (evasion, slab.evasion.rect()) {
                slab.evasion
                    .for_each(|column, row| plane.set(words, [u + column, v + row]));
            }
        }
    }
}

fn draw_slices(map: &MaskMap, planes: &[Option<Plane>], words: &mut [u32]) {
    let (rect, lanes) = (map.rect(), map.lanes().max(1));
    for (texel, mask) in (0..).zip(map.masks().chunks_exact(lanes)) {
        for (&of_lane, planes) in mask.iter().zip(planes.chunks(32)) {
            let mut left = of_lane;
            while left != 0 {
                if let Some(plane) = &planes[left.trailing_zeros() as usize] {
                    let width = rect.width as i32;
                    plane.set(words, [rect.u + texel % width, rect.v + texel / width]);
                }
                left &= left - 1;
            }
        }
    }
}

impl Plane {
    /// Sets a texel, which lies in the plane, in all strips that hold it.
    #[inline]
    fn set(&self, words: &mut [u32], [u, v]: [i32; 2]) {
        let (x, z) = ((u - self.origin[0]) as u32, (v - self.origin[1]) as u32);
        let last = x / STRIDE;
        for strip in last.saturating_sub(1)..(last + 1).min(self.strips) {
            let word = self.start + strip * self.rows + z / 2;
            words[word as usize] |= 1 << (16 * (z % 2) + x - STRIDE * strip);
        }
    }
}

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
        fn each_strip_has_the_texels_of_its_columns(x in 0..16 + 8 * 9, z in 0..10) {
            let plane = Plane { start: 3, origin: [-5, -4], sides: [80, 10], strips: 10, rows: 9 };
            let mut words = vec![0; 3 + 10 * 9];
            plane.set(&mut words, [x + plane.origin[0], z + plane.origin[1]]);
            let mut expected = vec![0; words.len()];
            for strip in 0..10 {
                let column = x - 8 * strip;
                if (0..16).contains(&column) {
                    expected[(3 + strip * 9 + z / 2) as usize] |= 1u32 << (16 * (z % 2) + column);
                }
            }
            prop_assert_eq!(words, expected);
        }
    }
}
