//! The evasions' maps on the device.
//!
//! Source: Masaoka & Oshita, section 4.3: each evasion keeps a texture of its body and evasion map for each interval of height.
//! Differs: the textures are bits in one storage buffer, with one bit for each slice of time, so that a shader reads exactly what the CPU
//! reads (`candidate.frag.glsl`).

use ash::vk;

use crate::{
    gpu::{
        Context, GpuError, Memory,
        barriers::Access,
        error::{Named, within},
        resources::DeviceMemory,
        uploaded::{MapWords, Uploaded},
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
    words: Uploaded,
    pub(super) layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
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
        let most = device.context.limits().max_storage_buffer_range;
        within("maxStorageBufferRange", 4 * count as u64, most.into())?;
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
        let words_of_maps = MapWords {
            read_as: vk::BufferUsageFlags::STORAGE_BUFFER,
            count,
            write: |mut out: &mut [u32]| {
                for words in slabs(atlas).flat_map(words) {
                    let to = out.split_off_mut(..words.len());
                    to.unwrap_or_default().copy_from_slice(words);
                }
                Ok(())
            },
        };
        self.words
            .fill(device, &format!("{name}: maps"), words_of_maps)?;
        self.make_set(device.context)
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

    fn make_set(&mut self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let ty = vk::DescriptorType::STORAGE_BUFFER;
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(ty)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the context's device is valid.
        self.layout = unsafe { device.create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        let sizes = [vk::DescriptorPoolSize::default().ty(ty).descriptor_count(1)];
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: as above.
        self.pool =
            unsafe { device.create_descriptor_pool(&info, None) }.call("vkCreateDescriptorPool")?;
        let layouts = [self.layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layout were just made, and the pool has room.
        let sets =
            unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")?;
        self.set = sets[0];
        let buffer = [vk::DescriptorBufferInfo::default()
            .buffer(self.words.buffer.handle)
            .range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .descriptor_type(ty)
            .buffer_info(&buffer);
        // SAFETY: the set is new and of this layout, no command uses it yet, and the buffer is alive.
        unsafe { device.update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    /// Checks that candidates belong to these maps.
    pub(super) fn check(&self, candidates: &[CullCandidate]) -> Result<(), GpuError> {
        let stranger = |one: &CullCandidate| one.region.index() >= self.regions.len();
        match candidates.iter().position(stranger) {
            Some(candidate) => Err(GpuError::NoSuchRegion {
                candidate,
                region: candidates[candidate].region.0,
                regions: self.regions.len(),
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
    ) -> Option<&MapBits> {
        let (first_slab, first, count) = self.regions[candidate.region.index()];
        let index = usize::try_from(slab.0.checked_sub(first_slab.0)?).ok()?;
        (index < count).then(|| &self.bits[first + index][part as usize])
    }

    /// Records the copy of the maps from the staging buffer to the device.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    pub(super) unsafe fn record_upload(&self, context: &Context, cmd: vk::CommandBuffer) {
        // SAFETY: the caller vouches for `cmd` and staging.
        unsafe { self.words.record(context, cmd, Access::SHADER_READ) };
    }

    /// Frees the staging buffer. The upload must have finished on the device.
    pub(super) fn release_staging(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.words.release_staging(context, memory);
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            let device = context.device();
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
        }
        self.pool = vk::DescriptorPool::null();
        self.layout = vk::DescriptorSetLayout::null();
        self.words.destroy(context, memory);
    }
}
