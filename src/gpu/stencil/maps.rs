//! The evasions' maps as shaders read them, and the bounding rectangle of each slice.

use super::pairs::Pairs;
use crate::{
    gpu::{Counting, GpuError, error::within},
    maps::{MapRect, MaskMap, PackedAtlas, PackedMap, PackedMaps, RegionAtlas, Slab, SlabMaps},
    query::cull::{Counted, CullCandidate},
};

/// Kind of a slab's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    Body,
    Outer,
    Evasion,
    /// Body and evasion map in one ([`Pairs`]).
    Both,
}

impl Part {
    const ALL: [Self; 4] = [Self::Body, Self::Outer, Self::Evasion, Self::Both];

    /// Parts of an overlap that a map of this kind is counted into, in the order of their numbers.
    pub(super) fn counts(self) -> &'static [Self] {
        match self {
            Self::Body => &[Self::Body],
            Self::Outer => &[Self::Outer],
            Self::Evasion => &[Self::Evasion],
            Self::Both => &[Self::Body, Self::Evasion],
        }
    }
}

/// Position of a map in its frame, and of its bits in the atlas's words: `[row][column][slice]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MapBits {
    pub(super) u: i32,
    pub(super) v: i32,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) first_bit: u32,
    pub(super) row_bits: u32,
    pub(super) texel_bits_log2: u32,
}

/// A rectangle given by its centre and half sides, in texels of the evasion's frame. Negative half sides mean that it is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) middle: [f32; 2],
    pub(super) half: [f32; 2],
}

/// A candidate's map in a slab.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateMap<'a> {
    pub(super) bits: &'a MapBits,
    /// Bounding rectangles: of all slices first, then of each slice.
    pub(super) reaches: &'a [Reach],
}

/// The maps of an atlas.
#[derive(Debug)]
pub(super) struct Maps {
    /// The words are freed once they have been staged.
    packed: PackedAtlas,
    /// `[map of the packed atlas][part]`.
    bits: Vec<[MapBits; 4]>,
    /// `[map of the packed atlas][part][whole, then by slice]`.
    reaches: Vec<Reach>,
    slices: usize,
    regions: usize,
    /// Whether body and evasion maps are counted at once.
    are_pairs: bool,
}

impl Maps {
    pub(super) fn new(atlas: &RegionAtlas, counting: Counting) -> Result<Self, GpuError> {
        let slices = atlas.grid().slices as usize;
        let mut packed = atlas.pack();
        let pairs = match slices {
            1 => Pairs::new(atlas),
            _ => None,
        };
        let are_pairs = pairs.is_some() && counting == Counting::Atomics;
        let bits: Vec<[MapBits; 3]> = match pairs {
            Some(pairs) => {
                packed.words = pairs.words;
                pairs.bits
            }
            None => packed
                .maps
                .iter()
                .map(|maps| mask_bits(maps, packed.lanes))
                .collect(),
        };
        within(
            "bits of maps on the device",
            32 * packed.words.len() as u64,
            u64::from(u32::MAX),
        )?;
        let mut reaches = Vec::new();
        let slabs = atlas.regions().iter().flat_map(|region| &region.slabs);
        slabs.for_each(|slab| push_reaches(slab, slices, &mut reaches));
        Ok(Self {
            packed,
            // Both maps begin with the body's.
            bits: bits
                .into_iter()
                .map(|[body, outer, evasion]| [body, outer, evasion, body])
                .collect(),
            reaches,
            slices,
            regions: atlas.regions().len(),
            are_pairs,
        })
    }

    /// Maximum number of counts that a box adds to.
    pub(super) fn counts_of_a_box(&self) -> u32 {
        1 + u32::from(self.are_pairs)
    }

    /// Kinds of maps that are drawn for what is counted.
    pub(super) fn parts(&self, counted: Counted) -> impl Iterator<Item = Part> + use<> {
        let both = self.are_pairs && counted.body && counted.evasion;
        let is_drawn = move |part: &Part| match part {
            Part::Body => counted.body && !both,
            Part::Outer => counted.outer,
            Part::Evasion => counted.evasion && !both,
            Part::Both => both,
        };
        Part::ALL.into_iter().filter(is_drawn)
    }

    /// Bits of all maps, until [`Maps::forget_words`] frees them.
    pub(super) fn words(&self) -> &[u32] {
        &self.packed.words
    }

    /// Frees the words after their upload.
    pub(super) fn forget_words(&mut self) {
        self.packed.words = Vec::new();
    }

    /// Number of slices of a texel.
    pub(super) fn slices(&self) -> u32 {
        self.slices as u32
    }

    /// Checks that candidates belong to this atlas.
    pub(super) fn check(&self, candidates: &[CullCandidate]) -> Result<(), GpuError> {
        let stranger = |one: &CullCandidate| one.region.index() >= self.regions;
        match candidates.iter().position(stranger) {
            Some(candidate) => Err(GpuError::NoSuchRegion {
                candidate,
                region: candidates[candidate].region.0,
                regions: self.regions,
            }),
            None => Ok(()),
        }
    }

    /// A candidate's map in a slab, or `None` if its region does not reach the slab.
    pub(super) fn find(
        &self,
        candidate: &CullCandidate,
        slab: Slab,
        part: Part,
    ) -> Option<CandidateMap<'_>> {
        let entry = self.packed.find(candidate.region, slab)?;
        let each = self.slices + 1;
        let first = (entry as usize * Part::ALL.len() + part as usize) * each;
        let bits = &self.bits[entry as usize][part as usize];
        Some(CandidateMap {
            bits,
            reaches: &self.reaches[first..first + each],
        })
    }
}

/// Maps of masks: body, outer, evasion.
fn mask_bits(maps: &PackedMaps, lanes: u32) -> [MapBits; 3] {
    let log2 = 4 + lanes.max(1);
    [
        map_bits(maps.body, log2),
        map_bits(maps.outer, log2),
        map_bits(maps.evasion, 0),
    ]
}

fn map_bits(map: PackedMap, texel_bits_log2: u32) -> MapBits {
    MapBits {
        u: map.u,
        v: map.v,
        width: map.width,
        height: map.height,
        first_bit: 32 * map.word,
        row_bits: 32 * map.words_per_row,
        texel_bits_log2,
    }
}

fn push_reaches(slab: &SlabMaps, slices: usize, reaches: &mut Vec<Reach>) {
    for masks in [&slab.body, &slab.outer] {
        reaches.push(Reach::of(masks.rect()));
        push_slices(masks, slices, reaches);
    }
    // All of the evasion map's texels are of its only slice.
    let whole = Reach::of(slab.evasion.rect());
    reaches.extend(std::iter::repeat_n(whole, slices + 1));
    let both = Reach::of(slab.body.rect().union(slab.evasion.rect()));
    reaches.extend(std::iter::repeat_n(both, slices + 1));
}

/// Bounding rectangle of each slice.
fn push_slices(masks: &MaskMap, slices: usize, reaches: &mut Vec<Reach>) {
    let rect = masks.rect();
    let (width, height) = (rect.width as usize, rect.height as usize);
    let (mut columns, mut rows) = (vec![0u64; width], vec![0u64; height]);
    for (v, row) in rows.iter_mut().enumerate() {
        for (u, column) in columns.iter_mut().enumerate() {
            let mask = masks.get(u as i32, v as i32);
            *row |= mask;
            *column |= mask;
        }
    }
    let ends = |of: &[u64], slice: usize| {
        let has = |mask: &u64| mask >> slice & 1 == 1;
        let first = of.iter().position(has)?;
        let last = of.iter().rposition(has)?;
        Some((first as i32, (last - first + 1) as u32))
    };
    for slice in 0..slices {
        let reach = match (ends(&columns, slice), ends(&rows, slice)) {
            (Some((u, width)), Some((v, height))) => Reach::of(MapRect {
                u: rect.u + u,
                v: rect.v + v,
                width,
                height,
            }),
            _ => Reach::of(MapRect::default()),
        };
        reaches.push(reach);
    }
}

impl Reach {
    fn of(rect: MapRect) -> Self {
        if rect.is_empty() {
            return Self {
                middle: [0.0; 2],
                half: [-1.0; 2],
            };
        }
        let half = [rect.width as f32 * 0.5, rect.height as f32 * 0.5];
        Self {
            middle: [rect.u as f32 + half[0], rect.v as f32 + half[1]],
            half,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.half[0] < 0.0
    }
}
