//! Device memory from the caller's allocator.

use std::ffi::{CString, c_char, c_void};
use std::ptr::NonNull;

use super::sized::sized;
use super::status::{OK, Status};
use crate::gpu::ash::vk::{self, Handle};
use crate::gpu::{
    Block, Context, GpuAllocatorMemory, GpuError, Memory, MemoryDesc, MemoryUse, Resource,
};

/// `sabaki_memory_desc`.
#[repr(C)]
struct MemoryDescOut {
    name: *const c_char,
    size: u64,
    alignment: u64,
    memory_type_bits: u32,
    usage: u32,
    buffer: u64,
    image: u64,
    prefers_dedicated: u32,
}

/// `sabaki_block`.
#[derive(Default)]
#[repr(C)]
struct BlockData {
    memory: u64,
    offset: u64,
    size: u64,
    mapped: Option<NonNull<u8>>,
    coherent: u32,
    token: u64,
}

type Allocate = unsafe extern "C" fn(*mut c_void, *const MemoryDescOut, *mut BlockData) -> Status;
type Release = unsafe extern "C" fn(*mut c_void, *const BlockData);

/// `sabaki_allocator`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Allocator {
    size: u32,
    user: *mut c_void,
    allocate: Option<Allocate>,
    release: Option<Release>,
}

sized! {
    Allocator, "allocator";
}

/// The caller's allocator, or the built-in one.
pub(super) enum HostMemory {
    Host(Allocator),
    BuiltIn(Box<GpuAllocatorMemory>),
}

impl HostMemory {
    /// Wraps the caller's allocator, or creates the built-in one if there is none.
    pub(super) fn new(allocator: Option<Allocator>, context: &Context) -> Result<Self, GpuError> {
        Ok(match allocator {
            Some(allocator) => Self::Host(allocator),
            None => Self::BuiltIn(Box::new(GpuAllocatorMemory::new(context)?)),
        })
    }

    pub(super) fn get(&mut self) -> &mut dyn Memory {
        match self {
            Self::Host(allocator) => allocator,
            Self::BuiltIn(memory) => memory.as_mut(),
        }
    }

    /// Destroys the built-in allocator. Destroy everything that was created with it before.
    pub(super) fn destroy(self) {
        if let Self::BuiltIn(memory) = self {
            memory.destroy();
        }
    }
}

impl Memory for Allocator {
    fn allocate(&mut self, desc: &MemoryDesc<'_>) -> Result<Block, GpuError> {
        let no_memory = |reason: &str| GpuError::Memory {
            name: desc.name.to_owned(),
            reason: reason.to_owned(),
        };
        let (Some(allocate), Some(_)) = (self.allocate, self.release) else {
            return Err(no_memory("a function of the allocator is NULL"));
        };
        let name = CString::new(desc.name.replace('\0', " ")).unwrap_or_default();
        let (buffer, image) = match desc.resource {
            Resource::Buffer(buffer) => (buffer.as_raw(), 0),
            Resource::Image(image) => (0, image.as_raw()),
        };
        let out = MemoryDescOut {
            name: name.as_ptr(),
            size: desc.requirements.size,
            alignment: desc.requirements.alignment,
            memory_type_bits: desc.requirements.memory_type_bits,
            usage: match desc.usage {
                MemoryUse::Device => 0,
                MemoryUse::Upload => 1,
                MemoryUse::Readback => 2,
            },
            buffer,
            image,
            prefers_dedicated: desc.prefers_dedicated.into(),
        };
        let mut block = BlockData::default();
        // SAFETY: the caller vouches for its function and pointer; both structs live during the call.
        let status = unsafe { allocate(self.user, &raw const out, &raw mut block) };
        if status != OK {
            return Err(no_memory("the host's allocator has none"));
        }
        let block = Block {
            memory: vk::DeviceMemory::from_raw(block.memory),
            offset: block.offset,
            size: block.size,
            mapped: block.mapped,
            coherent: block.coherent != 0,
            token: block.token,
        };
        let fault = match (desc.usage, block.mapped) {
            (MemoryUse::Upload | MemoryUse::Readback, None) => Some("the block is not mapped"),
            _ if block.size < desc.requirements.size => Some("the block is too small"),
            _ => None,
        };
        match fault {
            Some(fault) => {
                self.free(block);
                Err(no_memory(fault))
            }
            None => Ok(block),
        }
    }

    fn free(&mut self, block: Block) {
        let block = BlockData {
            memory: block.memory.as_raw(),
            offset: block.offset,
            size: block.size,
            mapped: block.mapped,
            coherent: block.coherent.into(),
            token: block.token,
        };
        if let Some(release) = self.release {
            // SAFETY: the caller vouches for its function and pointer; the block is one that it allocated.
            unsafe { release(self.user, &raw const block) }
        }
    }
}
