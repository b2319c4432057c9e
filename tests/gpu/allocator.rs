//! Promise: the built-in allocator frees memory when it is destroyed, and never when it is dropped.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki::gpu::ash::vk;
use sabaki::gpu::{GpuAllocatorMemory, Memory, MemoryDesc, MemoryUse, Resource};
use sabaki_fixtures::shim;

use super::contract::{Ear, device};

fn desc(usage: MemoryUse) -> MemoryDesc<'static> {
    MemoryDesc {
        name: "block",
        requirements: vk::MemoryRequirements {
            size: 256,
            alignment: 256,
            memory_type_bits: u32::MAX,
        },
        usage,
        resource: Resource::Buffer(vk::Buffer::null()),
        prefers_dedicated: false,
    }
}

#[test]
fn only_destroy_frees_memory() {
    let device = device();
    let context = device.context().unwrap().clone();
    let alive = shim::live();

    let mut memory = GpuAllocatorMemory::new(&context).unwrap();
    let block = memory.allocate(&desc(MemoryUse::Upload)).unwrap();
    memory.free(block);
    assert_eq!(memory.live_blocks(), 0);
    memory.destroy();
    assert_eq!(shim::live(), alive);

    let mut memory = GpuAllocatorMemory::new(&context).unwrap();
    memory.allocate(&desc(MemoryUse::Device)).unwrap();
    let used = shim::live();
    assert_ne!(used, alive);
    let ear = Ear::default();
    tracing::subscriber::with_default(ear.clone(), || drop(memory));
    assert_eq!(
        shim::live(),
        used,
        "nothing is freed, because the device may be gone"
    );
    let heard = ear.0.lock().unwrap().clone();
    assert_eq!(heard.len(), 1, "{heard:?}");
    assert!(heard[0].contains("GpuAllocatorMemory was dropped without destroy"));
    // With memory that leaks, validation would complain of the device's end.
    std::mem::forget(device);
}
