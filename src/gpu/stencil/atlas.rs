//! The maps of all evasions on the device, and their descriptors.

use ash::vk;

use crate::gpu::{
    Context, GpuError, Memory,
    barriers::{self, Access, MemoryBarrier},
    error::{Named, within},
    resources::DeviceMemory,
    uploaded::{MapWords, Uploaded},
};

/// The maps of all evasions on the device. Default: null handles, which need not be destroyed.
#[derive(Debug, Default)]
pub(super) struct Atlas {
    words: Uploaded,
    pub(super) layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    pub(super) set: vk::DescriptorSet,
}

impl Atlas {
    /// Fills an atlas that has a layout. After a failure, [`Atlas::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        words: MapWords<impl FnOnce(&mut [u32]) -> Result<(), GpuError>>,
    ) -> Result<(), GpuError> {
        let context = device.context;
        let most = context.limits().max_storage_buffer_range;
        within("maxStorageBufferRange", words.bytes(), most.into())?;
        self.words.fill(device, name, words)?;
        self.make_set(context)
    }

    /// Records the copy of the maps from the staging buffer to the device.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    pub(super) unsafe fn record_upload(&self, context: &Context, cmd: vk::CommandBuffer) {
        // The upload may be recorded again, after culls that read the same maps.
        for before in [Access::SHADER_READ, Access::TRANSFER_WRITE] {
            // SAFETY: the caller vouches for `cmd`.
            unsafe {
                barriers::memory(
                    context,
                    cmd,
                    MemoryBarrier::new(before, Access::TRANSFER_WRITE),
                )
            };
        }
        // SAFETY: the caller vouches for `cmd` and staging.
        unsafe { self.words.record(context, cmd, Access::SHADER_READ) };
    }

    /// Frees the staging buffer. The upload must have finished on the device.
    pub(super) fn release_staging(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.words.release_staging(context, memory);
    }

    /// Creates the descriptor set layout of a default atlas.
    pub(super) fn make_layout(&mut self, context: &Context) -> Result<(), GpuError> {
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the context's device is valid.
        self.layout = unsafe { context.device().create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        Ok(())
    }

    fn make_set(&mut self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)];
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: the context's device is valid.
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
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&buffer);
        // SAFETY: the set is new and of this layout, no command uses it yet, and the buffer is alive.
        unsafe { device.update_descriptor_sets(&[write], &[]) };
        Ok(())
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            context.device().destroy_descriptor_pool(self.pool, None);
            let device = context.device();
            device.destroy_descriptor_set_layout(self.layout, None);
        }
        self.pool = vk::DescriptorPool::null();
        self.layout = vk::DescriptorSetLayout::null();
        self.words.destroy(context, memory);
    }
}
