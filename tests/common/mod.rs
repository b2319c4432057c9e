//! What several tests share.
#![allow(dead_code, unused_imports, reason = "each test uses some of it")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may")]

#[cfg(feature = "demo")]
pub mod answer;
#[cfg(feature = "demo")]
pub mod baked;
pub mod captures;
pub mod clips;
pub mod crowd;
#[cfg(feature = "vulkan")]
pub mod cull;
#[cfg(feature = "vulkan")]
pub(crate) mod cull_cases;
#[cfg(feature = "vulkan")]
mod device;
pub mod lod;
pub mod maps;

#[cfg(feature = "vulkan")]
pub(crate) use device::*;
pub mod plain_bvh;
pub mod plain_gltf;
pub mod random;
pub mod shapes;
pub mod small;
#[cfg(feature = "vulkan")]
pub(crate) mod timed;
