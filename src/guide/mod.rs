//! For whoever comes from outside: the way from clips to a dodging character, where the papers stand in the code, which culling path to
//! take, and what is refused.
//!
//! Architecture invariant: there is no code here. What the pages show is compiled with the tests of the documentation, and the files
//! and limits that they name are held to the repository by `tests/guide.rs`.

#[doc = include_str!("from_clips.md")]
pub mod from_clips {}

#[doc = include_str!("paper.md")]
pub mod paper {}

#[doc = include_str!("culling.md")]
pub mod culling {}

#[doc = include_str!("limits.md")]
pub mod limits {}
