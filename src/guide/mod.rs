//! The guide: from clips to a dodging character, a game loop, crowds and fights, the papers and the code, the choice of a culling path, and the
//! limits on input.
//!
//! Architecture invariant: this module contains no code. Documentation tests compile the code of the pages, and `tests/guide.rs` checks
//! the files and limits that they name.

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

#[doc = include_str!("game_loop.md")]
pub mod game_loop {}
