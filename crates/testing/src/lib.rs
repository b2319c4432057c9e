//! What the tests of several packages share.
#![allow(missing_docs, reason = "not published")]
#![allow(
    clippy::should_implement_trait,
    clippy::new_without_default,
    reason = "helpers of tests"
)]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may")]

pub mod answer;
pub mod baked;
pub mod captures;
pub mod clips;
pub mod crowd;
pub mod cull;
pub mod cull_cases;
pub mod device;
pub mod lod;
pub mod maps;

pub use device::*;
pub mod memory;
pub mod plain_bvh;
pub mod plain_gltf;
pub mod random;
pub mod screen;
pub mod shader_table;
pub mod shapes;
pub mod shim;
pub mod small;
pub mod timed;
