//! Tests of `sabaki::gpu`.
mod alloc;
mod allocator;
mod batch;
mod compute;
mod compute_motions;
mod contract;
mod cull;
mod device;
mod drivers;
mod fallbacks;
mod faults;
mod memory;
mod motions;
mod needs;
mod raster;
mod shader_table;
mod soak;
