//! Another allocator than the built-in one, in a page: a `VkDeviceMemory` for each block. Sixteen or so blocks is all that a
//! culler takes, of the 4,096 that every device grants.

use std::{collections::HashMap, ptr::NonNull};

use sabaki::gpu::{
    Block, GpuError, Memory, MemoryDesc, MemoryUse, Resource,
    ash::{self, vk},
};

pub struct PlainMemory {
    device: ash::Device,
    types: Vec<vk::MemoryType>,
    /// Memory that is mapped starts and ends on multiples of this.
    atom: u64,
    /// Whether coherent memory is said to be coherent. It may always be flushed and invalidated all the same.
    pub trusts_coherence: bool,
    live: HashMap<u64, vk::DeviceMemory>,
    next: u64,
}

impl PlainMemory {
    /// # Safety
    /// The handles are valid, belong together, and outlive it.
    pub unsafe fn new(
        instance: &ash::Instance,
        physical_device: vk::PhysicalDevice,
        device: &ash::Device,
    ) -> Self {
        // SAFETY: the caller vouches for the handles.
        let (properties, limits) = unsafe {
            (
                instance.get_physical_device_memory_properties(physical_device),
                instance
                    .get_physical_device_properties(physical_device)
                    .limits,
            )
        };
        Self {
            device: device.clone(),
            types: properties.memory_types_as_slice().to_vec(),
            atom: limits.non_coherent_atom_size,
            trusts_coherence: true,
            live: HashMap::new(),
            next: 0,
        }
    }

    pub fn live_blocks(&self) -> usize {
        self.live.len()
    }

    /// The first type that has all of `flags` and that `bits` allows.
    fn find(&self, bits: u32, flags: vk::MemoryPropertyFlags) -> Option<u32> {
        (0u32..)
            .zip(&self.types)
            .find(|(index, one)| bits & (1 << index) != 0 && one.property_flags.contains(flags))
            .map(|(index, _)| index)
    }
}

impl Memory for PlainMemory {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        use vk::MemoryPropertyFlags as Flags;
        // The best first; Vulkan guarantees that the last one is there for every buffer and image.
        let wishes = match desc.usage {
            MemoryUse::Device => [Flags::DEVICE_LOCAL, Flags::empty()],
            MemoryUse::Upload => [
                Flags::HOST_VISIBLE | Flags::HOST_COHERENT,
                Flags::HOST_VISIBLE,
            ],
            MemoryUse::Readback => [
                Flags::HOST_VISIBLE | Flags::HOST_CACHED,
                Flags::HOST_VISIBLE,
            ],
        };
        let no_memory = |reason: String| GpuError::Memory {
            name: desc.name.to_owned(),
            reason,
        };
        let bits = desc.requirements.memory_type_bits;
        let kind = wishes.into_iter().find_map(|flags| self.find(bits, flags));
        let kind = kind.ok_or_else(|| no_memory("no type suits".to_owned()))?;
        // Every buffer and image has an allocation of its own here, which a driver may make better use of when it is told.
        let mut dedicated = match desc.resource {
            Resource::Buffer(buffer) => vk::MemoryDedicatedAllocateInfo::default().buffer(buffer),
            Resource::Image(image) => vk::MemoryDedicatedAllocateInfo::default().image(image),
        };
        let mut size = desc.requirements.size.next_multiple_of(self.atom);
        let mut info = vk::MemoryAllocateInfo::default().memory_type_index(kind);
        if desc.prefers_dedicated {
            // Neither more nor less; whole memory is as good as whole atoms.
            size = desc.requirements.size;
            info = info.push_next(&mut dedicated);
        }
        let info = info.allocation_size(size);
        // SAFETY: the device is valid, and has this memory type.
        let memory = unsafe { self.device.allocate_memory(&info, None) }
            .map_err(|error| no_memory(error.to_string()))?;
        let mut mapped = None;
        if desc.usage != MemoryUse::Device {
            let flags = vk::MemoryMapFlags::empty();
            // SAFETY: the memory was just made, of a type that the host sees.
            match unsafe { self.device.map_memory(memory, 0, vk::WHOLE_SIZE, flags) } {
                Ok(pointer) => mapped = NonNull::new(pointer.cast()),
                Err(error) => {
                    // SAFETY: nothing uses the memory yet.
                    unsafe { self.device.free_memory(memory, None) };
                    return Err(no_memory(error.to_string()));
                }
            }
        }
        self.next += 1;
        self.live.insert(self.next, memory);
        let flags = self.types[kind as usize].property_flags;
        Ok(Block {
            memory,
            offset: 0,
            size,
            mapped,
            coherent: self.trusts_coherence && flags.contains(Flags::HOST_COHERENT),
            token: self.next,
        })
    }

    fn free(&mut self, block: Block) {
        if let Some(memory) = self.live.remove(&block.token) {
            // SAFETY: it was allocated here, and is bound to nothing any more. Freeing unmaps it.
            unsafe { self.device.free_memory(memory, None) };
        }
    }
}
