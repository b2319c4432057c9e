//! Maps and culling on a Vulkan device that the caller brings.
//!
//! The caller gives its own instance, device and queue family ([`Context`]) and a way to get memory ([`Memory`]). Components
//! record into the caller's command buffers; results are polled, or read when the caller knows that they are there.
//!
//! - Architecture invariant: nothing here but [`Headless`] submits, waits, or owns a device.
//! - Architecture invariant: `Drop` frees no Vulkan object. Every component has a `destroy`, and says so when it was forgotten.
//! - Architecture invariant: no map or count depends on a driver's rounding; see `shaders/`.

mod allocator;
mod barriers;
pub mod compute;
mod context;
mod counts;
mod error;
mod headless;
mod limits;
mod memory;
mod pipelines;
mod requirements;
mod resources;
mod shader_table;
pub mod stencil;
mod uploaded;

/// The version that signatures here speak of.
pub use ash;
/// The version that [`GpuAllocatorMemory`] speaks of.
pub use gpu_allocator;

pub use allocator::GpuAllocatorMemory;
pub use context::{Context, ContextDesc, RawContextDesc};
pub use error::{GpuError, Mismatch};
pub use headless::{
    Accepted, DeviceChoice, DeviceInfo, DeviceKind, Headless, HeadlessDesc, Message, accepted,
    devices,
};
pub use memory::{Block, Memory, MemoryDesc, MemoryUse};
pub use requirements::{Report, Requirement, RequirementKind, Terms, Without, check, requirements};
