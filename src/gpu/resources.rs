//! Buffers with their memory, which are created and destroyed together.
//!
//! Architecture invariant: nothing here is freed by `Drop`. A default value holds null handles, and destroying it does nothing.

use ash::vk;

use super::{
    Block, Context, GpuError, Memory, MemoryDesc, MemoryUse, Resource,
    error::{Named, within},
};

/// The device that resources are created on, and the allocator of their memory.
pub struct DeviceMemory<'a> {
    /// The device.
    pub context: &'a Context,
    /// The allocator.
    pub memory: &'a mut dyn Memory,
}

impl DeviceMemory<'_> {
    /// Creates a buffer that may be bound as a whole. On failure everything is freed again.
    pub fn buffer(&mut self, desc: BufferDesc<'_>) -> Result<Buffer, GpuError> {
        if desc.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER) {
            let most = self.context.limits().max_storage_buffer_range;
            within("maxStorageBufferRange", desc.size, u64::from(most))?;
        }
        let size = desc.size.max(4).next_multiple_of(4);
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(desc.usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        let (device, callbacks) = (self.context.device(), self.context.callbacks());
        // SAFETY: the context's device is valid, and the description is complete.
        let handle = unsafe { device.create_buffer(&info, callbacks) }.call("vkCreateBuffer")?;
        self.context.name(handle, desc.name);
        let mut buffer = Buffer {
            handle,
            name: desc.name.to_owned(),
            size,
            block: None,
        };
        match buffer.bind(self, desc) {
            Ok(()) => Ok(buffer),
            Err(error) => {
                buffer.destroy(self.context, self.memory);
                Err(error)
            }
        }
    }

    /// Allocates the memory of a new buffer or image, whose requirements `ask` writes.
    pub(super) fn allocate(
        &mut self,
        name: &str,
        usage: MemoryUse,
        resource: Resource,
        ask: impl FnOnce(&mut vk::MemoryRequirements2<'_>),
    ) -> Result<Block, GpuError> {
        let mut dedicated = vk::MemoryDedicatedRequirements::default();
        let mut wanted = vk::MemoryRequirements2::default().push_next(&mut dedicated);
        ask(&mut wanted);
        let requirements = wanted.memory_requirements;
        self.memory.allocate(&MemoryDesc {
            name,
            requirements,
            usage,
            resource,
            prefers_dedicated: dedicated.prefers_dedicated_allocation == vk::TRUE
                || dedicated.requires_dedicated_allocation == vk::TRUE,
        })
    }
}

/// Description of a buffer.
#[derive(Clone, Copy)]
pub struct BufferDesc<'a> {
    /// Name for debuggers and validation.
    pub name: &'a str,
    /// Size in bytes. 0 counts as 4, because a buffer cannot be empty.
    pub size: u64,
    /// Usage by the device.
    pub usage: vk::BufferUsageFlags,
    /// Access by host and device.
    pub memory: MemoryUse,
}

/// A buffer and its memory.
#[derive(Clone, Debug, Default)]
pub struct Buffer {
    /// The Vulkan object.
    pub handle: vk::Buffer,
    name: String,
    size: u64,
    block: Option<Block>,
}

impl Buffer {
    fn bind(
        &mut self,
        memory: &mut DeviceMemory<'_>,
        desc: BufferDesc<'_>,
    ) -> Result<(), GpuError> {
        let (device, resource) = (memory.context.device(), Resource::Buffer(self.handle));
        let info = vk::BufferMemoryRequirementsInfo2::default().buffer(self.handle);
        // SAFETY: the buffer was just made from this device, which has Vulkan 1.1.
        let block = memory.allocate(desc.name, desc.memory, resource, |wanted| unsafe {
            device.get_buffer_memory_requirements2(&info, wanted);
        })?;
        self.block = Some(block);
        if desc.memory != MemoryUse::Device {
            self.mapped()?;
        }
        // SAFETY: the buffer is not bound yet, and the block suits its requirements.
        unsafe { device.bind_buffer_memory(self.handle, block.memory, block.offset) }
            .call("vkBindBufferMemory")
    }

    /// Frees buffer and memory. The device must not use them any more.
    pub fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        let (device, callbacks) = (context.device(), context.callbacks());
        // SAFETY: the handle is null or was made from this device, and the caller knows that the device is done with it.
        unsafe { device.destroy_buffer(self.handle, callbacks) };
        self.handle = vk::Buffer::null();
        if let Some(block) = self.block.take() {
            memory.free(block);
        }
    }

    /// Whether the buffer's memory is mapped.
    pub fn is_mapped(&self) -> bool {
        self.block.is_some_and(|block| block.mapped.is_some())
    }

    /// Copies bytes into a mapped buffer and flushes them.
    pub fn write(&self, context: &Context, offset: u64, bytes: &[u8]) -> Result<(), GpuError> {
        within("size of a buffer", offset + bytes.len() as u64, self.size)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let (_, mapped) = self.mapped()?;
        // SAFETY: the range lies in the mapped block, which the device does not use while its owner writes.
        unsafe {
            let target = mapped.as_ptr().add(offset as usize);
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), target, bytes.len());
        }
        self.flush(context)
    }

    /// Makes the host's writes visible to the device.
    pub fn flush(&self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let Some(range) = self.incoherent()? else {
            return Ok(());
        };
        // SAFETY: the range is the whole block, which is mapped, and of whole atoms by the allocator's contract.
        unsafe { device.flush_mapped_memory_ranges(&[range]) }.call("vkFlushMappedMemoryRanges")
    }

    /// Makes the device's writes visible to the host.
    pub fn invalidate(&self, context: &Context) -> Result<(), GpuError> {
        let device = context.device();
        let Some(range) = self.incoherent()? else {
            return Ok(());
        };
        // SAFETY: the range is the whole block, which is mapped, and of whole atoms by the allocator's contract.
        unsafe { device.invalidate_mapped_memory_ranges(&[range]) }
            .call("vkInvalidateMappedMemoryRanges")
    }

    /// The first `size` bytes of a mapped buffer. Call [`Buffer::invalidate`] before.
    ///
    /// # Safety
    /// The device has finished writing them.
    pub unsafe fn bytes(&self, size: u64) -> Result<&[u8], GpuError> {
        within("size of a buffer", size, self.size)?;
        let (_, mapped) = self.mapped()?;
        // SAFETY: the range is mapped, and the caller knows that nobody writes to it.
        Ok(unsafe { std::slice::from_raw_parts(mapped.as_ptr(), size as usize) })
    }

    /// A word of a mapped buffer, which the device may be writing at the same time.
    pub fn word(&self, offset: u64) -> Result<u32, GpuError> {
        within("size of a buffer", offset + 4, self.size)?;
        let (_, mapped) = self.mapped()?;
        // SAFETY: the word is mapped and aligned (offsets and blocks are multiples of 4), and is only read as an atomic.
        let word = unsafe {
            let pointer = mapped.as_ptr().add(offset as usize);
            std::sync::atomic::AtomicU32::from_ptr(pointer.cast())
        };
        Ok(word.load(std::sync::atomic::Ordering::Acquire))
    }

    /// Bytes of a mapped buffer, for the host to write.
    ///
    /// # Safety
    /// The device does not use them while they are borrowed, and nobody else writes them.
    pub unsafe fn bytes_mut(&mut self) -> Result<&mut [u8], GpuError> {
        let size = self.size as usize;
        let (_, mapped) = self.mapped()?;
        // SAFETY: the range is mapped, and the caller knows that nobody else uses it.
        Ok(unsafe { std::slice::from_raw_parts_mut(mapped.as_ptr(), size) })
    }

    fn mapped(&self) -> Result<(&Block, std::ptr::NonNull<u8>), GpuError> {
        self.block
            .as_ref()
            .and_then(|block| Some((block, block.mapped?)))
            .ok_or_else(|| GpuError::NotMapped {
                name: self.name.clone(),
            })
    }

    /// Range of the whole block, unless it is coherent. It consists of whole atoms, as [`Block::coherent`] requires.
    fn incoherent(&self) -> Result<Option<vk::MappedMemoryRange<'static>>, GpuError> {
        let (block, _) = self.mapped()?;
        let range = vk::MappedMemoryRange::default()
            .memory(block.memory)
            .offset(block.offset)
            .size(block.size);
        Ok((!block.coherent).then_some(range))
    }
}
