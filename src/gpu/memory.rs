//! The trait of an allocator of device memory, which the caller provides.

use std::ptr::NonNull;

use ash::vk;

use super::GpuError;

/// Access to a block of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MemoryUse {
    /// Only the device reads and writes. If the block is mapped nevertheless, the host writes the first contents directly, without a
    /// staging buffer.
    Device,
    /// The host writes and the device reads. The block must be mapped.
    Upload,
    /// The device writes and the host reads. The block must be mapped and should be cached.
    Readback,
}

/// A request for memory.
#[derive(Clone, Copy, Debug)]
pub struct MemoryDesc<'a> {
    /// Name of the buffer or image.
    pub name: &'a str,
    /// Memory requirements of the buffer or image.
    pub requirements: vk::MemoryRequirements,
    /// Access by host and device.
    pub usage: MemoryUse,
    /// The buffer or image, for `VkMemoryDedicatedAllocateInfo`.
    pub resource: Resource,
    /// Whether the driver prefers an allocation for this buffer or image alone, at offset 0.
    pub prefers_dedicated: bool,
}

/// A buffer or image that memory is allocated for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// A buffer, which is linear.
    Buffer(vk::Buffer),
    /// An image of optimal tiling, which is not linear.
    Image(vk::Image),
}

impl Resource {
    /// Whether the resource is linear, for allocators that separate both kinds (`bufferImageGranularity`).
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Buffer(_))
    }
}

/// A block of device memory.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Memory object that the resource is bound to.
    pub memory: vk::DeviceMemory,
    /// Offset of the block in the memory object, in bytes.
    pub offset: u64,
    /// Size in bytes, at least the required one.
    pub size: u64,
    /// Mapped address of the block. [`MemoryUse::Upload`] and [`MemoryUse::Readback`] need it.
    pub mapped: Option<NonNull<u8>>,
    /// Whether the memory is host-coherent. Otherwise the block starts and ends at multiples of `nonCoherentAtomSize` or at the ends of the
    /// memory object.
    pub coherent: bool,
    /// Identifies the block to its allocator.
    pub token: u64,
}

// SAFETY: a block is a description. Code that reads or writes through `mapped` ensures exclusive access.
unsafe impl Send for Block {}
// SAFETY: as above.
unsafe impl Sync for Block {}

/// An allocator of device memory.
pub trait Memory {
    /// Allocates a block.
    ///
    /// # Errors
    /// [`GpuError::Memory`] if no memory is available.
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError>;

    /// Frees a block of [`Memory::allocate`]. Resources that are bound to it must no longer be used.
    fn free(&mut self, block: Block);
}
