//! The built-in choice of allocator: gpu-allocator, shared with the caller.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use ash::vk;
use gpu_allocator::{
    AllocationSizes, AllocatorDebugSettings, MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc},
};

use super::{Block, Context, GpuError, Memory, MemoryDesc, MemoryUse};

/// Memory from a [`gpu_allocator::vulkan::Allocator`] that the caller goes on using.
///
/// It must live until everything made with it has been destroyed.
#[derive(Debug)]
pub struct GpuAllocatorMemory {
    allocator: Arc<Mutex<Allocator>>,
    live: HashMap<u64, Allocation>,
    next_token: u64,
}

impl GpuAllocatorMemory {
    /// Takes its memory from `allocator`.
    #[must_use]
    pub fn new(allocator: Arc<Mutex<Allocator>>) -> Self {
        Self {
            allocator,
            live: HashMap::new(),
            next_token: 0,
        }
    }

    /// Makes an allocator of its own, in small blocks: maps are small.
    ///
    /// # Errors
    /// [`GpuError::Memory`] in gpu-allocator's words.
    pub fn of(context: &Context) -> Result<Self, GpuError> {
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
        Ok(Self::new(Arc::new(Mutex::new(allocator))))
    }

    /// How many blocks have not been given back.
    #[must_use]
    pub fn live_blocks(&self) -> usize {
        self.live.len()
    }

    fn lock(&self) -> MutexGuard<'_, Allocator> {
        // A panic elsewhere left no half-made allocation of ours behind.
        self.allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
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
            linear: desc.linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation = self
            .lock()
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
        if let Err(error) = self.lock().free(allocation) {
            tracing::error!("gpu-allocator did not take a block back: {error}");
        }
    }
}
