//! The baked file: magic, version, checksum, then a [`BakedGraph`].
//!
//! ```text
//! 0   8  "sabaki\r\n"            found wrong: not a baked file, or one that a text transfer damaged
//! 8   4  format version, u32 little-endian
//! 12  4  CRC-32 of all that follows, u32 little-endian
//! 16  16 who wrote it: the crate's version as text, filled up with zeros; since format 4
//! 32  …  the graph, by postcard
//! ```
//! What is read is checked twice: the checksum finds damage, and every index is compared with what it points into, so that
//! a file that was made to do harm is an error as well. Loading holds the file, the graph and what is derived from it: at most
//! [`MOST_PER_BYTE`] bytes for each of the file's, and [`MOST_BESIDE`] more; a file that would need more is refused.

mod atomic_write;

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::maps::BakedGraph;

pub use atomic_write::write_atomically;

/// Largest file that is read, in bytes: baked files, clips, meshes.
pub const LARGEST_FILE: u64 = 1_000_000_000;

const MAGIC: [u8; 8] = *b"sabaki\r\n";
const VERSION: u32 = 4;
/// Magic, version and checksum.
const CHECKED: usize = 16;
const WRITER: usize = 16;
const HEADER: usize = CHECKED + WRITER;

/// Bytes of memory that loading may take for each byte of the file.
pub const MOST_PER_BYTE: u64 = 64;

/// And beside those, however small the file is.
pub const MOST_BESIDE: u64 = 256 << 20;

/// Why a baked file cannot be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ArchiveError {
    /// The file system refuses.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It begins with something else.
    #[error("{path}: not a baked graph (it does not begin with the mark of one)")]
    NotBaked {
        /// Which file.
        path: PathBuf,
    },
    /// Another version wrote it.
    #[error("{path}: {writer} wrote it, in format version {found}, and this is sabaki {ours}, which reads version {expected}; bake it again", ours = env!("CARGO_PKG_VERSION"), expected = VERSION)]
    Version {
        /// Which file.
        path: PathBuf,
        /// Its format.
        found: u32,
        /// Which program wrote it.
        writer: String,
    },
    /// It is larger than [`LARGEST_FILE`].
    #[error("{path}: larger than {max} MB", max = LARGEST_FILE / 1_000_000)]
    TooLarge {
        /// Which file.
        path: PathBuf,
    },
    /// The checksum does not fit: bytes were lost or changed.
    #[error("{path}: damaged (its checksum does not fit)")]
    Checksum {
        /// Which file.
        path: PathBuf,
    },
    /// The checksum fits but the contents are not sound.
    #[error("{path}: not sound: {what}")]
    Contents {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// The bytes of a baked file.
///
/// # Errors
/// Only where memory ends.
pub fn to_bytes(baked: &BakedGraph) -> Result<Vec<u8>, postcard::Error> {
    let mut bytes = postcard::to_extend(baked, vec![0; HEADER])?;
    for (byte, letter) in bytes[CHECKED..HEADER]
        .iter_mut()
        .zip(env!("CARGO_PKG_VERSION").bytes())
    {
        *byte = letter;
    }
    let checksum = crc32fast::hash(&bytes[CHECKED..]);
    bytes[..8].copy_from_slice(&MAGIC);
    bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
    bytes[12..CHECKED].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

/// Which program wrote a file of some format, as far as its header tells.
fn writer(bytes: &[u8], format: u32) -> String {
    const SINCE: u32 = 4;
    let field = bytes.get(CHECKED..HEADER).unwrap_or_default();
    let text: String = { field.iter() }
        .take_while(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'z' | b'.' | b'-' | b'+'))
        .map(|&byte| char::from(byte))
        .collect();
    match format {
        1..SINCE => "a sabaki from before 0.1.0".to_owned(),
        _ if text.is_empty() => "an unknown sabaki".to_owned(),
        _ => format!("sabaki {text}"),
    }
}

/// The checksum of a graph as baked files hold it, whichever version wrote them: it names the graph.
///
/// # Errors
/// Only where memory ends.
pub fn checksum(baked: &BakedGraph) -> Result<u32, postcard::Error> {
    Ok(crc32fast::hash(&postcard::to_extend(baked, Vec::new())?))
}

/// Whether bytes begin like a baked file.
#[must_use]
pub fn is_baked(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Reads the bytes of a baked file; `path` names it in errors.
///
/// # Errors
/// What is wrong with them.
pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<BakedGraph, ArchiveError> {
    let path = || path.to_owned();
    if !is_baked(bytes) {
        return Err(ArchiveError::NotBaked { path: path() });
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .and_then(|word| word.try_into().ok())
            .map(u32::from_le_bytes)
    };
    let (Some(version), Some(checksum)) = (word(8), word(12)) else {
        return Err(ArchiveError::Checksum { path: path() });
    };
    if version != VERSION {
        return Err(ArchiveError::Version {
            path: path(),
            found: version,
            writer: writer(bytes, version),
        });
    }
    let body = bytes.get(HEADER..).unwrap_or_default();
    if bytes.len() < HEADER || crc32fast::hash(&bytes[CHECKED..]) != checksum {
        return Err(ArchiveError::Checksum { path: path() });
    }
    let contents = |what: String| ArchiveError::Contents { path: path(), what };
    let (baked, rest): (BakedGraph, _) =
        postcard::take_from_bytes(body).map_err(|error| contents(error.to_string()))?;
    if !rest.is_empty() {
        return Err(contents(format!("{} bytes follow its end", rest.len())));
    }
    let most = MOST_PER_BYTE * bytes.len() as u64 + MOST_BESIDE;
    baked.restored_within(most).map_err(contents)
}

/// Reads a baked file.
///
/// # Errors
/// What the file system or the contents are wrong with, with the path.
pub fn read(path: &Path) -> Result<BakedGraph, ArchiveError> {
    let io = |source| ArchiveError::Io {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    // Not a byte more of a file that is something else, which may be large or without end.
    let mut head = (&file).take(MAGIC.len() as u64);
    head.read_to_end(&mut bytes).map_err(io)?;
    if is_baked(&bytes) {
        let mut rest = (&file).take(LARGEST_FILE);
        rest.read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 > LARGEST_FILE {
            let path = path.to_owned();
            return Err(ArchiveError::TooLarge { path });
        }
    }
    from_bytes(&bytes, path)
}

/// Writes a baked file. The file appears whole or not at all: whoever is killed while writing, or loses power, leaves the old
/// file or the new one.
///
/// # Errors
/// What the file system refuses, with the path.
pub fn write(path: &Path, baked: &BakedGraph) -> Result<(), ArchiveError> {
    let io = |source| ArchiveError::Io {
        path: path.to_owned(),
        source,
    };
    let bytes = to_bytes(baked).map_err(|error| io(std::io::Error::other(error)))?;
    write_atomically(path, |file| file.write_all(&bytes)).map_err(io)
}
