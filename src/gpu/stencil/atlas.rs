//! The maps of all evasions on the device, and the descriptors by which shaders find them.

use ash::vk;

use super::{maps::Maps, slot::Slot};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    barriers::{self, Access},
    error::Named,
    resources::{Buffer, BufferDesc},
    shader_table::{CANDIDATE_FRAG, CANDIDATE_VERT},
};

const WORDS: u32 = 0;
const MAPS: u32 = 1;
const PLACED: u32 = 2;
const TURNS: u32 = 3;
const BINDINGS: [u32; 4] = [WORDS, MAPS, PLACED, TURNS];

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Atlas {
    words: Buffer,
    maps: Buffer,
    staging: Buffer,
    /// Bytes of words and of maps.
    sizes: [u64; 2],
    pub(super) layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
}

impl Atlas {
    /// Fills a default atlas. After a failure [`Atlas::destroy`] frees what there is.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        memory: &mut dyn Memory,
        name: &str,
        maps: &Maps,
    ) -> Result<(), GpuError> {
        let words: &[u8] = bytemuck::cast_slice(maps.words());
        let places: &[u8] = bytemuck::cast_slice(&maps.bits);
        self.sizes = [words.len() as u64, places.len() as u64];
        let mut buffer = |what: &str, size, usage, who| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage,
                memory: who,
            };
            Buffer::new(context, memory, desc)
        };
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::STORAGE_BUFFER | Usage::TRANSFER_DST;
        self.words = buffer("words", self.sizes[0], usage, MemoryUse::Device)?;
        self.maps = buffer("maps", self.sizes[1], usage, MemoryUse::Device)?;
        let size = self.sizes[0] + self.sizes[1];
        self.staging = buffer("staging", size, Usage::TRANSFER_SRC, MemoryUse::Upload)?;
        self.staging.write(context, 0, words)?;
        self.staging.write(context, self.sizes[0], places)
    }

    /// Records the copy of the maps to where shaders read them.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    pub(super) unsafe fn record_upload(&self, context: &Context, cmd: vk::CommandBuffer) {
        // It may be recorded again, behind culls that read the same maps.
        for before in [Access::SHADER_READ, Access::TRANSFER_WRITE] {
            // SAFETY: the caller vouches for `cmd`.
            unsafe { barriers::memory(context, cmd, before, Access::TRANSFER_WRITE) };
        }
        let mut start = 0;
        for (target, size) in [&self.words, &self.maps].into_iter().zip(self.sizes) {
            if size > 0 {
                let copy = [vk::BufferCopy::default().src_offset(start).size(size)];
                // SAFETY: the caller vouches for `cmd` and staging; both buffers have these sizes.
                unsafe {
                    let device = context.device();
                    device.cmd_copy_buffer(cmd, self.staging.handle, target.handle, &copy);
                }
            }
            start += size;
        }
        // SAFETY: as above.
        unsafe { barriers::memory(context, cmd, Access::TRANSFER_WRITE, Access::SHADER_READ) };
    }

    /// Frees the staging buffer; the device must have run the upload.
    pub(super) fn release_staging(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.staging.destroy(context, memory);
    }

    /// Makes the layout of the descriptor sets, as the shader table has it.
    pub(super) fn make_layout(&mut self, context: &Context) -> Result<(), GpuError> {
        let stages = |at: u32| {
            let reads = |shader: &crate::gpu::shader_table::Shader| {
                shader
                    .bindings
                    .iter()
                    .any(|one| one.set == 0 && one.binding == at)
            };
            let mut stages = vk::ShaderStageFlags::empty();
            if reads(&CANDIDATE_VERT) {
                stages |= vk::ShaderStageFlags::VERTEX;
            }
            if reads(&CANDIDATE_FRAG) {
                stages |= vk::ShaderStageFlags::FRAGMENT;
            }
            stages
        };
        let bindings = BINDINGS.map(|at| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(at)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .descriptor_count(1)
                .stage_flags(stages(at))
        });
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the context's device is valid.
        self.layout = unsafe { context.device().create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        Ok(())
    }

    /// Gives each slot its descriptor set.
    pub(super) fn make_sets(
        &mut self,
        context: &Context,
        slots: &mut [Slot],
    ) -> Result<(), GpuError> {
        let device = context.device();
        let count = slots.len() as u32;
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(BINDINGS.len() as u32 * count)];
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(count)
            .pool_sizes(&sizes);
        // SAFETY: the context's device is valid.
        self.pool =
            unsafe { device.create_descriptor_pool(&info, None) }.call("vkCreateDescriptorPool")?;
        let layouts = vec![self.layout; slots.len()];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layouts were just made, and the pool has room for all.
        let sets =
            unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")?;
        for (slot, set) in slots.iter_mut().zip(sets) {
            slot.set = set;
            self.write_set(context, slot);
        }
        Ok(())
    }

    fn write_set(&self, context: &Context, slot: &Slot) {
        let whole = |buffer: &Buffer| {
            [vk::DescriptorBufferInfo::default()
                .buffer(buffer.handle)
                .range(vk::WHOLE_SIZE)]
        };
        let infos = [&self.words, &self.maps, &slot.boxes, &slot.turns].map(whole);
        let write = |at: u32| {
            vk::WriteDescriptorSet::default()
                .dst_set(slot.set)
                .dst_binding(at)
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .buffer_info(&infos[at as usize])
        };
        let writes = BINDINGS.map(write);
        // SAFETY: set and buffers are alive, and no command uses the set yet.
        unsafe { context.device().update_descriptor_sets(&writes, &[]) };
    }

    /// Frees everything; the device must be done with it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            context.device().destroy_descriptor_pool(self.pool, None);
            let device = context.device();
            device.destroy_descriptor_set_layout(self.layout, None);
        }
        self.pool = vk::DescriptorPool::null();
        self.layout = vk::DescriptorSetLayout::null();
        for buffer in [&mut self.staging, &mut self.maps, &mut self.words] {
            buffer.destroy(context, memory);
        }
    }
}
