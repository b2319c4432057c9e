//! What several tests share.
#![allow(dead_code, reason = "each test uses some of it")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may")]

#[cfg(feature = "demo")]
pub mod baked;
pub mod clips;
pub mod plain_bvh;
pub mod random;
pub mod small;
