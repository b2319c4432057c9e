//! Files: motion capture in and out, events, attacks, baked graphs, answers.

pub mod archive;
pub mod bvh;
pub mod export;
mod whole;

pub use archive::ArchiveError;
pub use whole::write_whole;
