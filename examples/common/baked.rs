//! The baked graph that an example plays.

use std::path::PathBuf;

use sabaki::BakedGraph;
use sabaki::archive::{self, ArchiveError};

/// Reads the file that the first argument names, or the one that the demo (`cargo run --release`) writes.
pub fn baked() -> Result<BakedGraph, ArchiveError> {
    let file = std::env::args_os().nth(1).map(PathBuf::from);
    archive::read(&file.unwrap_or("out/fighter.sabaki".into()))
}
