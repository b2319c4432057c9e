//! The maps of all evasions on the device, and their descriptors.

use ash::vk;

use crate::gpu::{
    Context, GpuError, Memory,
    barriers::{self, Access, MemoryBarrier},
    drivers,
    error::{Named, within},
    resources::DeviceMemory,
    uploaded::{MapWords, Uploaded},
};

/// Kind of the buffer from which shaders read the words of the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ReadAs {
    #[default]
    StorageBuffer,
    TexelBuffer,
}

impl ReadAs {
    /// The faster kind on a device. A texel buffer is chosen only if it can hold as many words as a storage buffer.
    pub(super) fn on(context: &Context) -> Self {
        let limits = context.limits();
        let words = limits.max_storage_buffer_range / 4;
        match drivers::reads_texels(context.driver()) && limits.max_texel_buffer_elements >= words {
            true => Self::TexelBuffer,
            false => Self::StorageBuffer,
        }
    }

    /// Vulkan usage flags of the buffer.
    pub(super) fn usage(self) -> vk::BufferUsageFlags {
        match self {
            Self::StorageBuffer => vk::BufferUsageFlags::STORAGE_BUFFER,
            Self::TexelBuffer => vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER,
        }
    }

    /// Vulkan type of the buffer's descriptors.
    pub(super) fn descriptor(self) -> vk::DescriptorType {
        match self {
            Self::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
            Self::TexelBuffer => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        }
    }
}

/// The maps of all evasions on the device. Default: null handles, which need not be destroyed.
#[derive(Debug, Default)]
pub(super) struct Atlas {
    words: Uploaded,
    pub(super) read_as: ReadAs,
    /// Texel view of all words; null if they are read from a storage buffer.
    view: vk::BufferView,
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
        if self.read_as == ReadAs::TexelBuffer {
            let info = vk::BufferViewCreateInfo::default()
                .buffer(self.words.buffer.handle)
                .format(vk::Format::R32_UINT)
                .range(vk::WHOLE_SIZE);
            // SAFETY: the buffer is of this device and of this usage, which the format has on every device.
            self.view = unsafe { context.device().create_buffer_view(&info, None) }
                .call("vkCreateBufferView")?;
            context.name(self.view, name);
        }
        self.make_set(context)
    }

    /// Writes the words to binding 0 of a set.
    ///
    /// # Safety
    /// The set is of the context's device, with a descriptor of this type there, and no command uses it yet.
    pub(super) unsafe fn write_words(&self, context: &Context, set: vk::DescriptorSet) {
        let buffer = [vk::DescriptorBufferInfo::default()
            .buffer(self.words.buffer.handle)
            .range(vk::WHOLE_SIZE)];
        let view = [self.view];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(set)
            .descriptor_type(self.read_as.descriptor());
        let write = match self.read_as {
            ReadAs::StorageBuffer => write.buffer_info(&buffer),
            ReadAs::TexelBuffer => write.texel_buffer_view(&view),
        };
        // SAFETY: the caller vouches for the set; buffer and view are alive.
        unsafe { context.device().update_descriptor_sets(&[write], &[]) };
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
        self.read_as = ReadAs::on(context);
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(self.read_as.descriptor())
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
            .ty(self.read_as.descriptor())
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
        // SAFETY: the set is new and of this layout.
        unsafe { self.write_words(context, self.set) };
        Ok(())
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            context.device().destroy_descriptor_pool(self.pool, None);
            let device = context.device();
            device.destroy_descriptor_set_layout(self.layout, None);
            device.destroy_buffer_view(self.view, None);
        }
        self.view = vk::BufferView::null();
        self.pool = vk::DescriptorPool::null();
        self.layout = vk::DescriptorSetLayout::null();
        self.words.destroy(context, memory);
    }
}
