//! Maps and culling on the caller's Vulkan device.
//!
//! The caller gives its own instance, device and queue family ([`Context`]) and an allocator ([`Memory`]). Components
//! record into the caller's command buffers; results are polled, or read once the caller knows that they are complete.
//!
//! # Contract
//! A component records commands into the caller's command buffer. What it needs there and what it leaves behind:
//!
//! | | [`Culler`], stencil | [`Culler`], compute | `Rasterizer` |
//! | --- | --- | --- | --- |
//! | required queue family | graphics | compute | graphics |
//! | state of the command buffer | being recorded, outside of rendering and of occlusion queries | being recorded, outside of rendering | as for stencil |
//! | barriers that the caller records | none | none | none |
//! | stages that run | copy, clear, vertex, fragment, fragment tests, host | copy, clear, compute, host | copy, vertex, fragment, fragment tests, host |
//! | state that stays bound | graphics pipeline, its descriptor set 0 and push constants, vertex buffer 0, viewport, scissor, stencil state | compute pipeline, its descriptor set 0 and push constants | graphics pipeline, push constants, vertex buffer 0, viewport, scissor, stencil state |
//! | images of the caller | untouched, no layout changes | the same | the same |
//!
//! - **Recording** ([`Culler::record`]) returns a ticket. It writes to mapped memory and records commands. It submits nothing,
//!   waits for nothing, creates nothing, and allocates nothing after recording a cull of the same size once. The command buffer is
//!   primary, or secondary without `RENDER_PASS_CONTINUE`. It is submitted at most once.
//! - **Frames in flight**: a slot is one cull between recording and the end of its commands. The caller records into a slot
//!   again once they have finished, or if they will never be submitted. Resources that slots share are ordered by the component's own
//!   barriers, if all its culls run on one queue and are submitted in the order of recording.
//! - **Polling** never waits. The device makes the counts available to the host, and after that writes the number of the cull, which polling
//!   looks for. Once the host has seen the submission's fence or timeline semaphore, Vulkan guarantees that polling finds number and
//!   counts. Polling earlier is safe: it says "not yet", or finds the number. Vulkan does not define in which order the host sees number and
//!   counts then; to rely on the guarantee alone, poll after the fence.
//! - **Missing answers** (a limit, an error, a lost device): [`cpu`](crate::query::cull::cpu) computes the same counts from the same
//!   input. After every error but a lost device ([`GpuError::is_device_lost`]) component and device remain usable. Polling does not
//!   report a lost device: it keeps returning "not yet". The host's submissions, fences and semaphores report it.
//! - **Memory** is the caller's choice ([`Memory`]): [`GpuAllocatorMemory`] is built in, `examples/common/plain_memory.rs`
//!   shows another allocator. Components allocate only when they are created. `destroy` frees the memory, and so does a
//!   creation that fails. Call [`GpuAllocatorMemory::destroy`] after that, and before the device is destroyed.
//! - **Threads**: contexts, components and tickets are `Send` and `Sync`. Recording takes `&mut`, polling `&`. The caller
//!   guards the command buffer and its pool.
//! - **Destruction**: call `destroy` when the device has finished. A component that is dropped without it leaks its Vulkan objects, and
//!   logs an error.
//!
//! [`requirements()`] lists the requirements of each path. [`check()`] compares them with a physical device, [`check_enabled()`] with the
//! features that the host has enabled. The compute path needs Vulkan 1.1 and a queue with compute, and no feature. The stencil path needs
//! graphics, dynamic rendering and, below 1.3, the extensions that [`Report::extensions`] names.
//!
//! - Architecture invariant: nothing here submits commands, waits for a device, or owns one.
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
mod descriptors;
mod device_path;
mod drivers;
mod error;
mod image;
mod memory;
mod pipelines;
mod report;
mod resources;
mod shader_table;
pub(crate) mod stencil;
mod uploaded;

/// The version of `ash` whose types public signatures name.
pub use ash;

pub use allocator::GpuAllocatorMemory;
pub use context::Context;
pub use context_desc::{ContextDesc, Features, command_buffer, raw_device, raw_instance};
pub use culler::{BatchEntry, Culler, Ticket};
pub use culler_desc::CullerDesc;
pub use error::GpuError;
pub use memory::{Block, Memory, MemoryDesc, MemoryUse, Resource};
pub use report::{PathReport, Report, Requirement, check, check_enabled, requirements};
pub use stencil::{Batch, MapKind, Rasterizer, RasterizerDesc};

/// Building blocks of components that come with this crate and record into the same command buffers, such as
/// `sabaki-draw`. Not covered by semantic versioning.
#[doc(hidden)]
pub mod internal {
    pub use super::descriptors::DescriptorSets;
    pub use super::error::{Named, within};
    pub use super::image::{Image, ImageDesc};
    pub use super::pipelines::{graphics_pipeline, with_stages};
    pub use super::resources::{Buffer, BufferDesc, DeviceMemory};
    pub use super::shader_table::{
        Binding, Shader, Stage, has_one_set, runs_anywhere, stride, words,
    };
}
