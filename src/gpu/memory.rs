//! Where memory comes from: the caller's allocator, behind a small trait.

use std::ptr::NonNull;

use ash::vk;

use super::GpuError;

/// Who reads and writes a piece of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MemoryUse {
    /// The device alone.
    Device,
    /// The host writes, the device reads: must be mapped.
    Upload,
    /// The device writes, the host reads: must be mapped, better cached.
    Readback,
}

/// A request for memory.
#[derive(Clone, Copy, Debug)]
pub struct MemoryDesc<'a> {
    /// Name of the buffer or image that it is for.
    pub name: &'a str,
    /// Requirements of that buffer or image.
    pub requirements: vk::MemoryRequirements,
    /// Who reads and writes it.
    pub usage: MemoryUse,
    /// The buffer or image, for `VkMemoryDedicatedAllocateInfo`.
    pub resource: Resource,
    /// Whether the driver prefers an allocation for this buffer or image alone, at offset 0.
    pub prefers_dedicated: bool,
}

/// A buffer or image that gets memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// A buffer: linear.
    Buffer(vk::Buffer),
    /// An image of optimal tiling: not linear.
    Image(vk::Image),
}

impl Resource {
    /// Whether it is linear, for allocators that keep both kinds apart (`bufferImageGranularity`).
    #[must_use]
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Buffer(_))
    }
}

/// A piece of device memory.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// What to bind.
    pub memory: vk::DeviceMemory,
    /// Where the piece starts in it.
    pub offset: u64,
    /// At least what was asked for.
    pub size: u64,
    /// The piece's first byte, for [`MemoryUse::Upload`] and [`MemoryUse::Readback`].
    pub mapped: Option<NonNull<u8>>,
    /// Whether the host's and the device's writes are seen without flush and invalidate. Where they are not, the piece
    /// starts and ends on multiples of `nonCoherentAtomSize`, or with its memory.
    pub coherent: bool,
    /// For the allocator to know it again.
    pub token: u64,
}

// SAFETY: a block is a description; whoever reads or writes through `mapped` sees to it that nobody else does.
unsafe impl Send for Block {}
// SAFETY: as above.
unsafe impl Sync for Block {}

/// An allocator of device memory.
pub trait Memory {
    /// Gives memory that suits the wish.
    ///
    /// # Errors
    /// [`GpuError::Memory`] when there is none.
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError>;

    /// Takes back what [`Memory::allocate`] gave. Nothing is bound to it any more.
    fn free(&mut self, block: Block);
}
