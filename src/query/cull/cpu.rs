//! The `cpu` culling path. It counts the same texels as the paths of `gpu`.
//!
//! The attack is drawn once, into blocks of 4 × 4 texels. For each candidate, the middles of sixteen blocks at once are transformed into its
//! frame, and a coarse map shows which blocks can overlap its maps. The texels of the few remaining blocks are transformed, looked up and
//! counted, again sixteen at once.
//!
//! ```text
//! for each candidate:
//!     for each layer of the attack with the candidate's clock, the largest first:
//!         for each group of 16 blocks:
//!             cells = middles of the blocks, transformed into the candidate's frame
//!             met   = blocks whose words share a bit with the coarse maps at these cells
//!             for each block of met:
//!                 places = its 16 texels, transformed into the candidate's frame
//!                 count the bits that its masks share with the candidate's masks at these places
//!         end at the first certain hit, if no other count is needed
//! ```

use super::drawing::CullInput;
use super::path::{Counted, Overlap};
use super::texels::{AttackTexels, BLOCK, BLOCK_TEXELS, BlockMasks, Group, Groups, LANES};
use crate::maps::{
    BitMap, CoarseMap, CoarseRegion, FixedTransform2, MaskMap, RegionMaps, SlabMaps,
};
use crate::math::{Isa, Lookup, Words};

/// Counts overlaps on the CPU. It reuses its memory, so that it allocates nothing after inputs of similar size.
#[derive(Clone, Debug)]
pub struct Culler {
    isa: Isa,
    counted: Counted,
    texels: AttackTexels,
    groups: Groups,
}

impl Default for Culler {
    fn default() -> Self {
        Self::with_isa(Isa::best())
    }
}

impl Culler {
    /// Creates a culler with an instruction set, or with the program's own if the machine lacks it.
    #[must_use]
    pub fn with_isa(isa: Isa) -> Self {
        Self {
            isa,
            counted: Counted::ALL,
            texels: AttackTexels::default(),
            groups: Groups::default(),
        }
    }

    /// Counts only some parts of the overlaps.
    #[must_use]
    pub fn counting(self, counted: Counted) -> Self {
        Self { counted, ..self }
    }

    /// Writes the overlap of each candidate to `overlaps`, in order.
    pub fn count(&mut self, input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
        let lanes = input.atlas.grid().lanes();
        self.texels
            .draw(self.isa, input.attack, lanes, self.counted);
        self.groups.take(self.isa, &self.texels);
        overlaps.clear();
        self.isa.look_up(Counting {
            input,
            near: input.atlas.coarse(),
            texels: &self.texels,
            groups: &self.groups,
            counted: self.counted,
            overlaps,
        });
    }
}

struct Counting<'a> {
    input: &'a CullInput<'a>,
    near: &'a [CoarseRegion],
    texels: &'a AttackTexels,
    groups: &'a Groups,
    counted: Counted,
    overlaps: &'a mut Vec<Overlap>,
}

impl Lookup for Counting<'_> {
    type Out = ();

    #[inline(always)]
    fn run<W: Words>(self, words: W) {
        let up_to_hits = self.counted.up_to_hits && self.input.atlas.grid().is_certain();
        for candidate in self.input.candidates {
            let count = CandidateCount {
                texels: self.texels,
                groups: self.groups,
                counted: self.counted,
                transform: candidate.transform,
                steps: TexelSteps::new(candidate.transform),
                words,
            };
            let near = &self.near[candidate.region.index()].slabs;
            let region = self.input.atlas.region(candidate.region);
            let clock = candidate.clock;
            let mut overlap = Overlap {
                outer: if self.counted.outer { 0 } else { u32::MAX },
                ..Overlap::default()
            };
            if up_to_hits {
                // Most candidates are hit and need no other counts.
                let first = CandidateCount {
                    counted: Counted::BODY,
                    ..count
                };
                first.count(clock, near, region, &mut overlap, |so_far| so_far.body > 0);
                if overlap.body == 0 {
                    let counted = Counted {
                        body: false,
                        ..self.counted
                    };
                    let rest = CandidateCount { counted, ..count };
                    rest.count(clock, near, region, &mut overlap, |_| false);
                }
            } else {
                count.count(clock, near, region, &mut overlap, |_| false);
            }
            self.overlaps.push(overlap);
        }
    }
}

/// The offsets of a block's texels from its first texel, in a candidate's frame.
#[derive(Clone, Copy)]
struct TexelSteps {
    x: [i32; BLOCK_TEXELS],
    z: [i32; BLOCK_TEXELS],
}

impl TexelSteps {
    #[inline(always)]
    fn new(transform: FixedTransform2) -> Self {
        let (mut x, mut z) = ([0; BLOCK_TEXELS], [0; BLOCK_TEXELS]);
        for k in 0..BLOCK_TEXELS {
            let (du, dv) = (2 * (k % BLOCK) as i32, 2 * (k / BLOCK) as i32);
            x[k] = transform.a * du + transform.b * dv;
            z[k] = transform.a * dv - transform.b * du;
        }
        Self { x, z }
    }
}

#[derive(Clone, Copy)]
struct CandidateCount<'a, W> {
    texels: &'a AttackTexels,
    groups: &'a Groups,
    counted: Counted,
    transform: FixedTransform2,
    steps: TexelSteps,
    words: W,
}

/// For each map, a bit for each block of a group that may overlap it.
#[derive(Clone, Copy, Debug, Default)]
struct Met {
    outer: u32,
    body: u32,
    evasion: u32,
}

impl<W: Words> CandidateCount<'_, W> {
    /// Adds the overlaps of the candidate's maps and the attack, until `is_enough`.
    #[inline(always)]
    fn count(
        &self,
        clock: u32,
        near: &[CoarseMap],
        region: &RegionMaps,
        overlap: &mut Overlap,
        is_enough: impl Fn(&Overlap) -> bool,
    ) {
        for &index in &self.groups.largest_first {
            let layer = &self.texels.layers[index];
            let slab = i64::from(layer.slab.0) - i64::from(region.first_slab.0);
            let slab = usize::try_from(slab)
                .ok()
                .filter(|&slab| layer.clock == clock && slab < near.len());
            let Some(slab) = slab else {
                continue;
            };
            for (group, first) in self.groups.of_layer(index) {
                let met = self.meets(group, &near[slab]);
                self.add(first, met, &region.slabs[slab], overlap);
            }
            if is_enough(overlap) {
                return;
            }
        }
    }

    /// Finds the blocks that may overlap the maps.
    #[inline(always)]
    fn meets(&self, group: &Group, near: &CoarseMap) -> Met {
        /// Maximum of |a| + |b| of a transform for which the coarse maps are valid, in fixed point.
        const WIDEST: i32 = 2 << (FixedTransform2::SHIFT - 1);
        let (transform, counted) = (self.transform, self.counted);
        // The reach of the cells of coarse maps is valid for rotations only.
        if transform.a.abs().saturating_add(transform.b.abs()) > WIDEST {
            let all = group.blocks;
            let of = |is_counted: bool| if is_counted { all } else { 0 };
            return Met {
                outer: of(counted.outer),
                body: of(counted.body),
                evasion: of(counted.evasion),
            };
        }
        let (mut cells, mut some) = ([0; LANES], 0);
        for (k, cell_of) in cells.iter_mut().enumerate() {
            let (x, z) = transform.half_texels(group.u[k], group.v[k]);
            let x = x.wrapping_sub(near.u) >> CoarseMap::SHIFT;
            let z = z.wrapping_sub(near.v) >> CoarseMap::SHIFT;
            let within = ((x as u32) < near.columns) & ((z as u32) < near.rows);
            let cell = (z as u32).wrapping_mul(near.columns).wrapping_add(x as u32);
            *cell_of = if within { cell } else { u32::MAX };
            some |= u32::from(within);
        }
        if some == 0 {
            return Met::default();
        }
        let mut met = Met::default();
        for lane in 0..self.texels.lanes {
            if counted.outer {
                let found = self.words.at(near.outer(lane), &cells);
                met.outer |= shared(&found, &group.outer[lane]);
            }
            if group.has_inner && counted.body {
                let found = self.words.at(near.body(lane), &cells);
                met.body |= shared(&found, &group.inner[lane]);
            }
        }
        if group.has_inner && counted.evasion {
            let found = self.words.at(near.evasion(), &cells);
            met.evasion = shared(&found, &group.any_inner);
        }
        met
    }

    /// Counts the texels of the blocks that may overlap, in the group whose first block is `first`.
    #[inline(always)]
    fn add(&self, first: usize, met: Met, maps: &SlabMaps, overlap: &mut Overlap) {
        let mut left = met.outer | met.body | met.evasion;
        while left != 0 {
            let bit = left & left.wrapping_neg();
            let block = first + left.trailing_zeros() as usize;
            left ^= bit;
            let at = self.turned(block);
            for lane in 0..self.texels.lanes {
                let index = block * self.texels.lanes + lane;
                if met.outer & bit != 0 {
                    let masks = &self.texels.outer[index];
                    overlap.outer += self.masks(masks, &maps.outer, lane, &at);
                }
                if met.body & bit != 0 {
                    let masks = &self.texels.inner[index];
                    overlap.body += self.masks(masks, &maps.body, lane, &at);
                }
            }
            if met.evasion & bit != 0 {
                overlap.evasion += self.bits(block, &maps.evasion, &at);
            }
        }
    }

    /// The positions of a block's texels in the candidate's frame.
    #[inline(always)]
    fn turned(&self, block: usize) -> [[i32; BLOCK_TEXELS]; 2] {
        let [u, v] = self.texels.places[block];
        let (x, z) = self.transform.start(2 * u + 1, 2 * v + 1);
        [
            self.steps
                .x
                .map(|step| (x + step) >> FixedTransform2::SHIFT),
            self.steps
                .z
                .map(|step| (z + step) >> FixedTransform2::SHIFT),
        ]
    }

    /// Number of bits that the masks share with one word of the masks of a map at these positions.
    #[inline(always)]
    fn masks(
        &self,
        masks: &BlockMasks,
        map: &MaskMap,
        lane: usize,
        [x, z]: &[[i32; BLOCK_TEXELS]; 2],
    ) -> u32 {
        let (rect, lanes) = (map.rect(), map.lanes() as u32);
        let mut places = [0; BLOCK_TEXELS];
        for k in 0..BLOCK_TEXELS {
            let u = x[k].wrapping_sub(rect.u) as u32;
            let v = z[k].wrapping_sub(rect.v) as u32;
            let place = v.wrapping_mul(rect.width).wrapping_add(u);
            let within = (u < rect.width) & (v < rect.height);
            let place = place.wrapping_mul(lanes).wrapping_add(lane as u32);
            places[k] = if within { place } else { u32::MAX };
        }
        let found = self.words.at(map.masks(), &places);
        let (mut shared, mut any) = ([0u32; BLOCK_TEXELS], 0);
        for (k, (found, mask)) in found.iter().zip(masks).enumerate() {
            shared[k] = found & mask;
            any |= shared[k];
        }
        if any == 0 {
            return 0;
        }
        shared.iter().map(|word| word.count_ones()).sum()
    }

    /// Number of a block's inner texels, in any slice, that lie on a set bit.
    #[inline(always)]
    fn bits(&self, block: usize, map: &BitMap, [x, z]: &[[i32; BLOCK_TEXELS]; 2]) -> u32 {
        let (rect, words) = (map.rect(), map.words_per_row() as u32);
        let mut inner = [0; BLOCK_TEXELS];
        for lane in 0..self.texels.lanes {
            let masks = &self.texels.inner[block * self.texels.lanes + lane];
            for (any, mask) in inner.iter_mut().zip(masks) {
                *any |= mask;
            }
        }
        let (mut places, mut bits) = ([0; BLOCK_TEXELS], [0; BLOCK_TEXELS]);
        for k in 0..BLOCK_TEXELS {
            let u = x[k].wrapping_sub(rect.u) as u32;
            let v = z[k].wrapping_sub(rect.v) as u32;
            let within = (u < rect.width) & (v < rect.height) & (inner[k] != 0);
            let place = v.wrapping_mul(words).wrapping_add(u >> 5);
            places[k] = if within { place } else { u32::MAX };
            bits[k] = u & 31;
        }
        let found = self.words.at(map.words(), &places);
        let set = found.iter().zip(&bits).map(|(word, bit)| word >> bit & 1);
        set.sum()
    }
}

/// Returns a bit for each lane in which two words share a bit.
#[inline(always)]
fn shared(a: &[u32; LANES], b: &[u32; LANES]) -> u32 {
    let mut lanes = 0;
    for k in 0..LANES {
        lanes |= u32::from(a[k] & b[k] != 0) << k;
    }
    lanes
}

/// Counts with a new culler, for occasional queries.
pub fn count(input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
    Culler::default().count(input, overlaps);
}
