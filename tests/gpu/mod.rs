//! Tests of `sabaki::gpu`.

mod cases;
mod contract;
mod drivers;
mod fallbacks;
mod faults;
mod memory;
mod motions;
mod needs;
mod raster;
mod shader_table;
mod soak;
