//! Registers, threads and crowds, with their own tests, for `tests/sanitize`.
#![allow(dead_code, unused_imports, missing_docs)]

#[path = "../../src/anim/mod.rs"]
pub mod anim;
#[path = "../../src/crowd/mod.rs"]
pub mod crowd;
#[path = "../../src/lod/mod.rs"]
pub mod lod;
#[path = "../../src/math/mod.rs"]
pub mod math;
