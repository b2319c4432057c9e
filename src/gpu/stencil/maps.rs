//! The evasions' maps on the device.
//!
//! Source: Masaoka & Oshita, section 4.3: each evasion keeps a texture of its body and evasion map for each interval of height.
//! Differs: the textures are bits in one storage buffer, with one bit for each slice of time, so that a shader reads exactly what the CPU
//! reads (`candidate.frag.glsl`).

use ash::vk;

use crate::{
    gpu::{
        Context, GpuError, Memory, descriptors::DescriptorSets, error::within,
        resources::DeviceMemory, uploaded::Uploaded,
    },
    maps::{MapRect, RegionAtlas, RegionMaps, Slab, SlabMaps},
    query::cull::{Counted, CullCandidate},
};

/// Kind of a slab's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Body,
    Outer,
    Evasion,
}

impl Part {
    pub(super) const ALL: [Self; 3] = [Self::Body, Self::Outer, Self::Evasion];

    pub(super) fn is_in(self, counted: Counted) -> bool {
        match self {
            Self::Body => counted.body,
            Self::Outer => counted.outer,
            Self::Evasion => counted.evasion,
        }
    }
}

/// Position of a map in its frame, and of its bits in the words: `[row][column][slice]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MapBits {
    pub(super) rect: MapRect,
    pub(super) first_bit: u32,
    pub(super) row_bits: u32,
    pub(super) texel_bits_log2: u32,
}

/// Words of the maps of a slab, by [`Part`].
fn words(slab: &SlabMaps) -> [&[u32]; 3] {
    [slab.body.masks(), slab.outer.masks(), slab.evasion.words()]
}

/// Slabs of all regions, in order.
fn slabs(atlas: &RegionAtlas) -> impl Iterator<Item = &SlabMaps> {
    atlas.regions().iter().flat_map(|region| &region.slabs)
}

/// Number of words of the maps of an atlas.
///
/// # Errors
/// [`GpuError::Limit`] if a bit's position does not fit a word.
pub(super) fn word_count(atlas: &RegionAtlas) -> Result<usize, GpuError> {
    let count = slabs(atlas).flat_map(words).map(<[u32]>::len).sum();
    let most = u64::from(u32::MAX);
    within("bits of maps on the device", 32 * count as u64, most)?;
    Ok(count)
}

/// The maps of all evasions. Default: null handles, which need not be destroyed.
#[derive(Debug, Default)]
pub(super) struct Maps {
    /// For each region: its first slab, the index of that slab's maps, and its number of slabs.
    regions: Vec<(Slab, usize, usize)>,
    /// Maps of each slab, by [`Part`].
    bits: Vec<[MapBits; 3]>,
    pub(super) words: Uploaded,
    pub(super) sets: DescriptorSets,
    pub(super) set: vk::DescriptorSet,
}

impl Maps {
    /// Fills default maps. After a failure, [`Maps::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        atlas: &RegionAtlas,
    ) -> Result<(), GpuError> {
        let count = word_count(atlas)?;
        let mut first = 0;
        self.regions = Vec::with_capacity(atlas.regions().len());
        for RegionMaps {
            first_slab, slabs, ..
        } in atlas.regions()
        {
            self.regions.push((*first_slab, first, slabs.len()));
            first += slabs.len();
        }
        self.place(atlas);
        let write = |mut out: &mut [u32]| {
            for words in slabs(atlas).flat_map(words) {
                let to = out.split_off_mut(..words.len());
                to.unwrap_or_default().copy_from_slice(words);
            }
            Ok(())
        };
        let name = format!("{name}: maps");
        self.words.fill(device, &name, count, write)?;
        let (context, stages) = (device.context, vk::ShaderStageFlags::FRAGMENT);
        let binding = (vk::DescriptorType::STORAGE_BUFFER, stages);
        self.sets.make_layout(context, &[binding])?;
        self.set = self.sets.allocate(context, 1)?[0];
        let buffer = vk::DescriptorBufferInfo::default()
            .buffer(self.words.buffer.handle)
            .range(vk::WHOLE_SIZE);
        self.sets.write(context, self.set, &[buffer]);
        Ok(())
    }

    /// Computes the position of each map in the words.
    fn place(&mut self, atlas: &RegionAtlas) {
        let lanes = atlas.grid().lanes() as u32;
        let mut first = 0;
        for slab in slabs(atlas) {
            let [body, outer, evasion] = words(slab).map(|words| {
                let start = 32 * first as u32;
                first += words.len();
                start
            });
            let masks = |rect: MapRect, first_bit| MapBits {
                rect,
                first_bit,
                row_bits: 32 * lanes * rect.width,
                texel_bits_log2: 4 + lanes,
            };
            self.bits.push([
                masks(slab.body.rect(), body),
                masks(slab.outer.rect(), outer),
                MapBits {
                    rect: slab.evasion.rect(),
                    first_bit: evasion,
                    row_bits: 32 * slab.evasion.words_per_row() as u32,
                    texel_bits_log2: 0,
                },
            ]);
        }
    }

    /// A candidate's map in a slab, or `None` if its region does not reach the slab.
    pub(super) fn find(
        &self,
        candidate: &CullCandidate,
        slab: Slab,
        part: Part,
    ) -> Option<&MapBits> {
        let (first_slab, first, count) = self.regions[candidate.region.index()];
        let index = usize::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then(|| &self.bits[first + index][part as usize])
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.sets.destroy(context);
        self.words.destroy(context, memory);
    }
}
