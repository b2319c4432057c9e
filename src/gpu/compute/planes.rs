//! The maps of all evasions as the shader reads them: for each region, slab and slice a plane of bits.
//!
//! A plane is cut into strips of 16 columns, one every 8, and a strip's word holds two rows. Wherever a block of the attack's
//! 8 × 4 texels falls, however it is turned, its texels lie in five words in a row of one strip: few reads for many texels,
//! which is what reads from memory cost most for.

use crate::{
    gpu::{GpuError, error::within},
    region::{MapRect, MaskMap, RegionAtlas, RegionMaps},
};

/// Texels from a window's first one to its last one, in each axis; `SPAN` in `shaders/count.comp.glsl`.
const SPAN: i32 = 8;
/// Words of a window.
const WINDOW: u32 = 5;
/// Columns from one strip to the next.
const STRIDE: u32 = 8;
/// Words of an entry: where its words start; its first texel; how many places for a window's first texel there are.
const ENTRY: usize = 3;

/// Where a region's planes are.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneRegion {
    /// Word of its first entry: `[slab][slices of body, slices of outer, evasion]`.
    pub(super) entries: u32,
    pub(super) first_slab: i32,
    pub(super) slabs: u32,
}

/// The atlas, laid out for the shader.
#[derive(Debug)]
pub(super) struct Planes {
    /// Entries, then planes.
    pub(super) words: Vec<u32>,
    pub(super) regions: Vec<PlaneRegion>,
    pub(super) slices: u32,
}

/// One slice of a map.
struct Plane {
    rect: MapRect,
    texels: Vec<(i32, i32)>,
}

impl Planes {
    /// `most` bytes.
    pub(super) fn new(atlas: &RegionAtlas, most: u64) -> Result<Self, GpuError> {
        let slices = atlas.grid().slices;
        let mut planes = Self {
            words: Vec::new(),
            regions: Vec::with_capacity(atlas.regions().len()),
            slices,
        };
        let each = ENTRY as u32 * planes_of_slab(slices);
        let mut entries = 0;
        for region in atlas.regions() {
            planes.regions.push(PlaneRegion {
                entries,
                first_slab: region.first_slab.0,
                slabs: region.slabs.len() as u32,
            });
            entries += each * region.slabs.len() as u32;
        }
        planes.words.resize(entries as usize, 0);
        let mut entry = 0;
        for region in atlas.regions() {
            planes.draw(region, &mut entry);
            let bytes = 4 * planes.words.len() as u64;
            within("maxStorageBufferRange", bytes, most)?;
        }
        Ok(planes)
    }

    fn draw(&mut self, region: &RegionMaps, entry: &mut usize) {
        for slab in &region.slabs {
            let mut slices = sliced(&slab.body, self.slices);
            slices.append(&mut sliced(&slab.outer, self.slices));
            let mut evasion = Vec::new();
            slab.evasion
                .for_each(|column, row| evasion.push((column, row)));
            slices.push(Plane::around(evasion, slab.evasion.rect()));
            for plane in slices {
                self.push(&plane, *entry);
                *entry += ENTRY;
            }
        }
    }

    fn push(&mut self, plane: &Plane, entry: usize) {
        let rect = plane.rect;
        if rect.is_empty() {
            return;
        }
        let start = self.words.len();
        // A window that holds some texel of the map starts at one of these places.
        let origin = [rect.u - SPAN, rect.v - SPAN];
        let side = [rect.width, rect.height].map(|side| side + SPAN as u32);
        let strips = (side[0] - 1) / STRIDE + 1;
        let rows = (side[1] - 1) / 2 + WINDOW;
        self.words[entry] = start as u32;
        self.words[entry + 1] = halves(origin.map(|texel| texel as u32));
        self.words[entry + 2] = halves(side);
        self.words.resize(start + (strips * rows) as usize, 0);
        for &(u, v) in &plane.texels {
            let (x, z) = ((u - origin[0]) as u32, (v - origin[1]) as u32);
            let last = x / STRIDE;
            for strip in last.saturating_sub(1)..=last.min(strips - 1) {
                let word = start as u32 + strip * rows + z / 2;
                self.words[word as usize] |= 1 << (16 * (z % 2) + x - STRIDE * strip);
            }
        }
    }
}

impl Plane {
    /// Texels of a map, in its frame, and the rectangle around them.
    fn around(mut texels: Vec<(i32, i32)>, map: MapRect) -> Self {
        let mut rect = MapRect::default();
        for (u, v) in &mut texels {
            (*u, *v) = (*u + map.u, *v + map.v);
            rect = rect.union(MapRect {
                u: *u,
                v: *v,
                width: 1,
                height: 1,
            });
        }
        Self { rect, texels }
    }
}

/// Planes of a slab.
pub(super) fn planes_of_slab(slices: u32) -> u32 {
    2 * slices + 1
}

/// A map slice by slice.
fn sliced(map: &MaskMap, slices: u32) -> Vec<Plane> {
    let mut texels = vec![Vec::new(); slices as usize];
    let width = map.rect().width as usize;
    for (index, mask) in map.masks().chunks_exact(map.lanes()).enumerate() {
        let place = ((index % width) as i32, (index / width) as i32);
        for (lane, &word) in mask.iter().enumerate() {
            let mut left = word;
            while left != 0 {
                texels[32 * lane + left.trailing_zeros() as usize].push(place);
                left &= left - 1;
            }
        }
    }
    let plane = |texels| Plane::around(texels, map.rect());
    texels.into_iter().map(plane).collect()
}

/// Two numbers of 16 bits in a word.
fn halves([low, high]: [u32; 2]) -> u32 {
    (low & 0xffff) | high << 16
}
