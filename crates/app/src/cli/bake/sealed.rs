//! Files with a mark and a checksum, which are complete or not there.
//!
//! ```text
//! 0   8  mark of the kind of file
//! 8   4  checksum of the plan that the file belongs to, u32 little-endian
//! 12  4  CRC-32 of all following bytes, u32 little-endian
//! 16  …  the contents, serialized by postcard
//! ```

use std::io::Write;
use std::path::Path;

use sabaki::archive::{open_regular, write_atomically};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::super::Failure;

/// Kind of a file, and the plan that it belongs to.
#[derive(Clone, Copy)]
pub(super) struct Seal {
    pub(super) kind: Kind,
    /// Checksum of the plan; 0 for files that any plan may use.
    pub(super) plan: u32,
}

/// Kind of a file.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    /// Points of a clip.
    Points,
    /// Minima of a shard's bands.
    Shard,
    /// Graph of a plan.
    Graph,
    /// Tests of the entries of a share of all moments.
    Entries,
}

/// Length of mark, plan and checksum, in bytes.
const HEADER: usize = 16;

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unusable {
    #[error("missing")]
    Missing,
    #[error("damaged")]
    Damaged,
    #[error("of another plan")]
    OtherPlan,
    #[error("not readable ({0})")]
    Io(#[from] std::io::Error),
}

impl Kind {
    const ALL: [Self; 4] = [Self::Points, Self::Shard, Self::Graph, Self::Entries];

    /// The kind of a file, by its first bytes.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let mut kinds = Self::ALL.into_iter();
        kinds.find(|kind| head.starts_with(kind.mark()))
    }

    /// Description of the kind, for messages.
    pub(super) fn describe(self) -> &'static str {
        "a part of a shared bake (for bake join)"
    }

    fn mark(self) -> &'static [u8; 8] {
        match self {
            Self::Points => b"sabakip\n",
            Self::Shard => b"sabakis\n",
            Self::Graph => b"sabakig\n",
            Self::Entries => b"sabakie\n",
        }
    }
}

/// The contents of a file, as bytes.
pub(super) fn encode(contents: &impl Serialize) -> Result<Vec<u8>, Failure> {
    postcard::to_stdvec(contents).map_err(|error| Failure::Usage(error.to_string()))
}

/// Writes a file atomically.
pub(super) fn write(path: &Path, seal: Seal, contents: &[u8]) -> Result<(), Failure> {
    let written = write_atomically(path, |file| {
        file.write_all(seal.kind.mark())?;
        file.write_all(&seal.plan.to_le_bytes())?;
        file.write_all(&crc32fast::hash(contents).to_le_bytes())?;
        file.write_all(contents)
    });
    written.map_err(|source| Failure::Write {
        path: path.to_owned(),
        source,
    })
}

/// Reads a file. Returns the contents and their checksum.
pub(super) fn read<T: DeserializeOwned>(path: &Path, seal: Seal) -> Result<(T, u32), Unusable> {
    let mut bytes = Vec::new();
    match open_regular(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Unusable::Missing);
        }
        file => std::io::Read::read_to_end(&mut file?, &mut bytes)?,
    };
    let (header, contents) = bytes.split_at_checked(HEADER).ok_or(Unusable::Damaged)?;
    let (mark, numbers) = header.split_at(8);
    let (of_plan, checksum) = numbers.split_at(4);
    let crc32 = crc32fast::hash(contents);
    if mark != seal.kind.mark() || checksum != crc32.to_le_bytes() {
        return Err(Unusable::Damaged);
    }
    if of_plan != seal.plan.to_le_bytes() {
        return Err(Unusable::OtherPlan);
    }
    match postcard::take_from_bytes(contents) {
        Ok((found, [])) => Ok((found, crc32)),
        _ => Err(Unusable::Damaged),
    }
}
