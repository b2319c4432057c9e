//! The built-in allocator: gpu-allocator.
//!
//! Architecture invariant: no public signature names a type of gpu-allocator.

use std::collections::HashMap;
use std::mem::ManuallyDrop;

use ash::vk;
use gpu_allocator::{
    AllocationSizes, AllocatorDebugSettings, MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};

use super::{Block, Context, GpuError, Memory, MemoryDesc, MemoryUse, Resource};

/// The default [`Memory`], based on gpu-allocator.
///
/// It must outlive everything that is created with it, and ends with [`GpuAllocatorMemory::destroy`] before the device. A host with an
/// allocator of its own implements [`Memory`] for that one, as `examples/common/plain_memory.rs` does.
#[derive(Debug)]
pub struct GpuAllocatorMemory {
    /// The allocator. `destroy` drops it; without `destroy` it is leaked, because its `Drop` frees memory of a device that may be gone.
    allocator: ManuallyDrop<Allocator>,
    live: HashMap<u64, Allocation>,
    next_token: u64,
    is_live: bool,
}

impl GpuAllocatorMemory {
    /// Creates an allocator with small blocks, because maps are small.
    ///
    /// # Errors
    /// [`GpuError::Memory`] with gpu-allocator's message.
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: context.instance().clone(),
            device: context.device().clone(),
            physical_device: context.physical_device(),
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::new(32 << 20, 32 << 20),
        });
        let allocator = allocator.map_err(|error| GpuError::Memory {
            name: "gpu-allocator".to_owned(),
            reason: error.to_string(),
        })?;
        Ok(Self {
            allocator: ManuallyDrop::new(allocator),
            live: HashMap::new(),
            next_token: 0,
            is_live: true,
        })
    }

    /// Number of blocks that have not been freed.
    pub fn live_blocks(&self) -> usize {
        self.live.len()
    }

    /// Frees all memory. Destroy everything that was created with the allocator before this call, and the device after it.
    pub fn destroy(mut self) {
        if !self.live.is_empty() {
            tracing::error!(
                "a GpuAllocatorMemory was destroyed with {} blocks in use",
                self.live.len()
            );
        }
        self.is_live = false;
        // SAFETY: nothing uses the allocator afterwards.
        drop(unsafe { ManuallyDrop::take(&mut self.allocator) });
    }
}

impl Drop for GpuAllocatorMemory {
    fn drop(&mut self) {
        if self.is_live {
            tracing::error!("a GpuAllocatorMemory was dropped without destroy: its memory leaks");
        }
    }
}

impl Memory for GpuAllocatorMemory {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        let wish = AllocationCreateDesc {
            name: desc.name,
            requirements: desc.requirements,
            location: match desc.usage {
                MemoryUse::Device => MemoryLocation::GpuOnly,
                MemoryUse::Upload => MemoryLocation::CpuToGpu,
                MemoryUse::Readback => MemoryLocation::GpuToCpu,
            },
            linear: desc.resource.is_linear(),
            allocation_scheme: match desc.resource {
                _ if !desc.prefers_dedicated => AllocationScheme::GpuAllocatorManaged,
                Resource::Buffer(buffer) => AllocationScheme::DedicatedBuffer(buffer),
                Resource::Image(image) => AllocationScheme::DedicatedImage(image),
            },
        };
        let allocation = self
            .allocator
            .allocate(&wish)
            .map_err(|error| GpuError::Memory {
                name: desc.name.to_owned(),
                reason: error.to_string(),
            })?;
        let token = self.next_token;
        self.next_token += 1;
        let block = Block {
            // SAFETY: the handle is only bound, and freed by the allocator alone.
            memory: unsafe { allocation.memory() },
            offset: allocation.offset(),
            size: allocation.size(),
            mapped: allocation.mapped_ptr().map(|pointer| pointer.cast()),
            coherent: allocation
                .memory_properties()
                .contains(vk::MemoryPropertyFlags::HOST_COHERENT),
            token,
        };
        self.live.insert(token, allocation);
        Ok(block)
    }

    fn free(&mut self, block: Block) {
        let Some(allocation) = self.live.remove(&block.token) else {
            tracing::error!("a block of another allocator was given back here");
            return;
        };
        if let Err(error) = self.allocator.free(allocation) {
            tracing::error!("gpu-allocator did not take a block back: {error}");
        }
    }
}
