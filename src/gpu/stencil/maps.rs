//! The evasions' maps as shaders read them, and the bounding rectangle of each slice.

use super::map_bits::MapBits;
use super::packed::{SlabNumbers, places, words};
use crate::math::parallel::each;
use crate::{
    gpu::{GpuError, error::within},
    maps::{MapRect, RegionAtlas, Slab, SlabMaps},
    query::cull::{Counted, CullCandidate},
};

/// Kind of a slab's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    Body,
    Outer,
    Evasion,
}

impl Part {
    const ALL: [Self; 3] = [Self::Body, Self::Outer, Self::Evasion];
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
    /// Bounding rectangle of all slices.
    pub(super) whole: Reach,
    /// Bounding rectangle of each slice; empty if all slices have that of `whole`.
    slices: &'a [Reach],
}

impl CandidateMap<'_> {
    /// The bounding rectangle of a slice; `None` beyond the last.
    pub(super) fn reach(&self, slice: usize) -> Option<&Reach> {
        match self.slices {
            [] => Some(&self.whole),
            slices => slices.get(slice),
        }
    }
}

/// The maps of an atlas.
#[derive(Debug)]
pub(super) struct Maps {
    slabs: SlabNumbers,
    /// Number of words of all maps.
    words: usize,
    /// Position of each map, `[slab][part]`.
    bits: Vec<[MapBits; 3]>,
    /// Bounding rectangle of all slices of each map, `[slab][part]`.
    reaches: Vec<[Reach; 3]>,
    /// Bounding rectangle of each slice, `[slab][body, outer][slice]`. Evasion maps have one slice.
    slice_reaches: Vec<Reach>,
    slices: usize,
}

impl Maps {
    pub(super) fn new(atlas: &RegionAtlas) -> Result<Self, GpuError> {
        let slices = atlas.grid().slices as usize;
        let slabs = atlas.regions().iter().flat_map(|region| &region.slabs);
        let reaches: Vec<_> = slabs.clone().map(reaches_of).collect();
        let mut slice_reaches = vec![Reach::NONE; 2 * slices * reaches.len()];
        let masks = slabs.flat_map(|slab| [&slab.body, &slab.outer]);
        let parts = slice_reaches.chunks_mut(slices).zip(masks);
        each(parts, |(reaches, masks), ()| {
            let rects = masks.slice_rects(slices as u32);
            for (reach, rect) in reaches.iter_mut().zip(rects) {
                *reach = Reach::of(rect);
            }
        });
        let maps = Self {
            slabs: SlabNumbers::new(atlas),
            words: atlas.bytes() / 4,
            bits: places(atlas),
            reaches,
            slice_reaches,
            slices,
        };
        within(
            "bits of maps on the device",
            32 * maps.word_count() as u64,
            u64::from(u32::MAX),
        )?;
        Ok(maps)
    }

    /// Kinds of maps that are drawn to count some parts of the overlaps.
    pub(super) fn parts(counted: Counted) -> impl Iterator<Item = Part> {
        let is_drawn = move |part: &Part| match part {
            Part::Body => counted.body,
            Part::Outer => counted.outer,
            Part::Evasion => counted.evasion,
        };
        Part::ALL.into_iter().filter(is_drawn)
    }

    /// Number of words of all maps.
    pub(super) fn word_count(&self) -> usize {
        self.words
    }

    /// Writes the words of all maps of an atlas.
    pub(super) fn write(atlas: &RegionAtlas, mut out: &mut [u32]) {
        let parts = words(atlas).map_while(|words| {
            let to = out.split_off_mut(..words.len())?;
            Some((to, words))
        });
        each(parts, |(to, words), ()| to.copy_from_slice(words));
    }

    /// Number of slices of a texel.
    pub(super) fn slices(&self) -> u32 {
        self.slices as u32
    }

    /// Checks that candidates belong to this atlas.
    pub(super) fn check(&self, candidates: &[CullCandidate]) -> Result<(), GpuError> {
        let stranger = |one: &CullCandidate| one.region.index() >= self.slabs.regions();
        match candidates.iter().position(stranger) {
            Some(candidate) => Err(GpuError::NoSuchRegion {
                candidate,
                region: candidates[candidate].region.0,
                regions: self.slabs.regions(),
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
        let entry = self.slabs.find(candidate.region, slab)? as usize;
        let slices = match part {
            Part::Body | Part::Outer => {
                let first = (2 * entry + part as usize) * self.slices;
                &self.slice_reaches[first..first + self.slices]
            }
            Part::Evasion => &[],
        };
        Some(CandidateMap {
            bits: &self.bits[entry][part as usize],
            whole: self.reaches[entry][part as usize],
            slices,
        })
    }
}

fn reaches_of(slab: &SlabMaps) -> [Reach; 3] {
    [slab.body.rect(), slab.outer.rect(), slab.evasion.rect()].map(Reach::of)
}

impl Reach {
    /// An empty rectangle.
    const NONE: Self = Self {
        middle: [0.0; 2],
        half: [-1.0; 2],
    };

    fn of(rect: MapRect) -> Self {
        if rect.is_empty() {
            return Self::NONE;
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
