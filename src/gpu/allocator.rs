//! The built-in allocator: gpu-allocator.
//!
//! Architecture invariant: no public signature names a type of gpu-allocator.

use std::collections::HashMap;

use ash::vk;
use gpu_allocator::{
    AllocationSizes, AllocatorDebugSettings, MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};

use super::{Block, Context, GpuError, Memory, MemoryDesc, MemoryUse, Resource};

/// The default [`Memory`], based on gpu-allocator.
///
/// It must outlive everything that is created with it. A host with an allocator of its own implements [`Memory`] for that one, as
/// `examples/common/plain_memory.rs` does.
#[derive(Debug)]
pub struct GpuAllocatorMemory {
    allocator: Allocator,
    live: HashMap<u64, Allocation>,
    next_token: u64,
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
            allocator,
            live: HashMap::new(),
            next_token: 0,
        })
    }

    /// Number of blocks that have not been freed.
    #[must_use]
    pub fn live_blocks(&self) -> usize {
        self.live.len()
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
