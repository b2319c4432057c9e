//! The guide: from clips to a dodging character, crowds and duels, how the papers map to the code, which culling path to use, and
//! what is refused.
//!
//! Architecture invariant: no code here. The code of the pages is compiled with the documentation's tests; `tests/guide.rs` checks the
//! files and limits that they name.

#[doc = include_str!("from_clips.md")]
pub mod from_clips {}

#[doc = include_str!("paper.md")]
pub mod paper {}

#[doc = include_str!("culling.md")]
pub mod culling {}

#[doc = include_str!("limits.md")]
pub mod limits {}

#[doc = include_str!("crowds.md")]
pub mod crowds {}
