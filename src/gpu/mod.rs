//! Maps and culling on a Vulkan device that the caller brings.
//!
//! The caller gives its own instance, device and queue family ([`Context`]) and a way to get memory ([`Memory`]). Components
//! record into the caller's command buffers; results are polled, or read when the caller knows that they are there.
//!
//! # Contract
//! A component is a guest in the caller's command buffer.
//!
//! | | [`Culler`], stencil | [`Culler`], compute | `Rasterizer` |
//! | --- | --- | --- | --- |
//! | the queue family has | graphics | compute | graphics |
//! | the command buffer is | being recorded, outside of rendering and of occlusion queries | being recorded, outside of rendering | as for stencil |
//! | barriers from the caller, before and after | none | none | none |
//! | stages that run | copy, clear, vertex, fragment, fragment tests, host | copy, clear, compute, host | copy, vertex, fragment, fragment tests, host |
//! | left bound | graphics pipeline, its descriptor set 0 and push constants, vertex buffer 0, index buffer, viewport, scissor, stencil state | compute pipeline, its descriptor set 0 and push constants | graphics pipeline, push constants, vertex buffer 0, viewport, scissor, stencil state |
//! | images of the caller | untouched, no layout changes | the same | the same |
//!
//! - **Recording** ([`Culler::record`]) returns a ticket. It writes to mapped memory and records commands. It submits nothing,
//!   waits for nothing, creates nothing, and allocates nothing after recording a cull of the same size once. A command buffer is
//!   primary, or secondary where it does not continue a rendering. It is submitted once at most.
//! - **Frames in flight**: a slot is one cull between recording and the end of its commands. The caller records into a slot
//!   again when those have finished, or will never be submitted. A component orders what its slots share by its own barriers,
//!   on condition that all of its culls run on one queue, submitted in the order of recording.
//! - **Polling** never waits. The device makes the counts available to the host, and after that writes the number of the cull, which polling
//!   looks for. Once the host has seen the submission's fence or timeline semaphore, Vulkan guarantees that polling finds number and
//!   counts. Polling earlier is safe: it says "not yet", or finds the number. Vulkan does not say in which order the host sees number and
//!   counts then; where its guarantee alone must do, poll after the fence.
//! - **Answers that do not come** (a limit, an error, a lost device): [`cpu`](crate::query::cull::cpu) counts the same from
//!   the same input. After every error but a lost device ([`GpuError::is_device_lost`]) component and device can be used further.
//!   Polling does not tell of a lost device: it goes on saying "not yet". The host's own submissions, fences and semaphores tell.
//! - **Memory** is the caller's choice ([`Memory`]): [`GpuAllocatorMemory`] is built in, `examples/common/plain_memory.rs`
//!   shows another allocator. Components allocate when they are created, never later. `destroy` gives the memory back, and so
//!   does a creation that fails half way. [`GpuAllocatorMemory::destroy`] comes after that, and before the end of the device.
//! - **Threads**: contexts, components and tickets are `Send` and `Sync`. Recording takes `&mut`, polling `&`. The caller
//!   guards the command buffer and its pool.
//! - **The end**: `destroy`, when the device has finished. Dropping without it frees nothing under a running queue: it is
//!   logged as an error, and leaks.
//!
//! [`requirements()`] lists what each path needs of a device. [`check()`] asks a physical device, [`check_enabled()`] looks at
//! what the host has enabled. The compute path needs Vulkan 1.1 and a queue with compute, and no feature. The stencil path needs
//! graphics, dynamic rendering and, below 1.3, the extensions that [`Report::extensions`] names.
//!
//! - Architecture invariant: nothing here submits, waits, or owns a device.
//! - Architecture invariant: `Drop` frees no Vulkan object. Every component has a `destroy`, and logs an error when it was forgotten.
//! - Architecture invariant: no map or count depends on a driver's rounding; see `shaders/`.

mod allocator;
mod barriers;
mod compute;
mod context;
mod context_desc;
mod counts;
mod culler;
mod culler_desc;
mod device_path;
mod drivers;
mod error;
mod features;
mod image;
mod limits;
mod memory;
mod offer;
mod passes;
mod pipeline_cache;
mod pipelines;
mod raw;
mod report;
mod requirements;
mod resources;
mod shader_table;
pub(crate) mod stencil;
mod terms;
mod uploaded;

/// The version that signatures here speak of.
pub use ash;

pub use allocator::GpuAllocatorMemory;
pub use context::Context;
pub use context_desc::{ContextDesc, RawContextDesc};
pub use culler::{BatchEntry, Culler, Ticket};
pub use culler_desc::{ComputeSettings, Counting, CullerDesc, StencilSettings};
pub use error::GpuError;
pub use features::Features;
pub use memory::{Block, Memory, MemoryDesc, MemoryUse, Resource};
pub use offer::{check, check_enabled};
pub use passes::PassTime;
pub use pipeline_cache::PipelineCache;
pub use raw::{check_raw, command_buffer};
pub use report::{PathReport, Report};
pub use requirements::{Requirement, requirements};
pub use terms::Terms;

/// Building blocks of components that come with this crate and record into the same command buffers, such as
/// `sabaki-draw`. Not covered by semantic versioning.
#[doc(hidden)]
pub mod internal {
    pub use super::error::{Named, within};
    pub use super::image::{Image, ImageDesc};
    pub use super::pipelines::graphics_pipeline;
    pub use super::resources::{Buffer, BufferDesc, DeviceMemory};
    pub use super::shader_table::{
        Binding, Shader, Stage, has_one_set, runs_anywhere, stride, words,
    };
}
