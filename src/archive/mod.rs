//! The file format of a baked graph: magic, version, checksum, then a [`BakedGraph`].
//!
//! ```text
//! 0   8  "sabaki\r\n"            otherwise: not a baked file, or damaged by a text-mode transfer
//! 8   4  format version, u32 little-endian
//! 12  4  CRC-32 of all following bytes, u32 little-endian
//! 16  16 version of the crate that wrote the file, as text padded with zeros
//! 32  32 lengths of the four sections, u64 little-endian each
//! 64  …  the sections: parts of the graph, serialized by postcard
//! …      optionally "attached" and an attachment: bytes that a program keeps beside the graph
//! ```
//! Sections are read on several threads. A file is checked in two steps. The checksum detects damage. Every index is then checked against
//! the range that it refers to, so that a malicious file is rejected too. Loading takes at most
//! [`MOST_PER_BYTE`] bytes of memory for each byte of the file, plus [`MOST_BESIDE`]; this covers
//! the file, the graph and its computed tables. Files that would need more are rejected.

mod atomic_write;

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::maps::BakedGraph;

pub use atomic_write::write_atomically;

/// Maximum size of a file that is read (baked files, clips, meshes), in bytes.
pub const LARGEST_FILE: u64 = 1_000_000_000;

const MAGIC: [u8; 8] = *b"sabaki\r\n";
const VERSION: u32 = 12;
/// Length of magic, version and checksum, in bytes.
const CHECKED: usize = 16;
const WRITER: usize = 16;
const HEADER: usize = CHECKED + WRITER;
/// What stands before an attachment.
const ATTACHED: &[u8; 8] = b"attached";

/// Maximum memory for loading, in bytes for each byte of the file.
pub const MOST_PER_BYTE: u64 = 64;

/// Maximum memory for loading in addition to [`MOST_PER_BYTE`], regardless of the file's size, in
/// bytes.
pub const MOST_BESIDE: u64 = 256 << 20;

/// Reason why a baked file cannot be written or read.
#[derive(Debug, Error)]
#[error("{path}: {fault}")]
pub struct ArchiveError {
    /// Path of the file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: ArchiveFault,
}

/// What is wrong with a baked file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ArchiveFault {
    /// The file system returned an error.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file does not start with the magic bytes.
    #[error("not a baked graph (it does not begin with the mark of one)")]
    NotBaked,
    /// The file has another format version.
    #[error("{writer} wrote it, in format version {found}, and this is sabaki {ours}, which reads version {expected}; bake it again", ours = env!("CARGO_PKG_VERSION"), expected = VERSION)]
    Version {
        /// Format version of the file.
        found: u32,
        /// Program that wrote the file.
        writer: String,
    },
    /// The file is larger than [`LARGEST_FILE`].
    #[error("larger than {max} MB", max = LARGEST_FILE / 1_000_000)]
    TooLarge,
    /// The checksum does not match, because bytes were lost or changed.
    #[error("damaged (its checksum does not fit)")]
    Checksum,
    /// The checksum matches, but the contents are invalid: the first invalid item.
    #[error("not sound: {0}")]
    Contents(String),
}

impl ArchiveFault {
    fn of(path: &Path) -> impl Fn(Self) -> ArchiveError {
        move |fault| ArchiveError {
            path: path.to_owned(),
            fault,
        }
    }
}

/// Serializes a baked graph to the bytes of a file.
///
/// # Errors
/// Memory is exhausted.
pub fn to_bytes(baked: &BakedGraph) -> Result<Vec<u8>, postcard::Error> {
    with_attachment(baked, &[])
}

fn with_attachment(baked: &BakedGraph, attachment: &[u8]) -> Result<Vec<u8>, postcard::Error> {
    let sections = baked.to_sections()?;
    let mut bytes = vec![0; HEADER];
    for section in &sections {
        bytes.extend((section.len() as u64).to_le_bytes());
    }
    for section in sections {
        bytes.extend(section);
    }
    if !attachment.is_empty() {
        bytes.extend(ATTACHED);
        bytes.extend(attachment);
    }
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

/// Name of the program that wrote a file, from its header.
fn writer(bytes: &[u8]) -> String {
    let field = bytes.get(CHECKED..HEADER).unwrap_or_default();
    let text: String = field
        .iter()
        .take_while(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'z' | b'.' | b'-' | b'+'))
        .map(|&byte| char::from(byte))
        .collect();
    match text.is_empty() {
        true => "an unknown sabaki".to_owned(),
        false => format!("sabaki {text}"),
    }
}

/// Checksum of a graph's serialized form. It is independent of the program version and identifies
/// the graph.
///
/// # Errors
/// Memory is exhausted.
pub fn checksum(baked: &BakedGraph) -> Result<u32, postcard::Error> {
    Ok(crc32fast::hash(&postcard::to_extend(baked, Vec::new())?))
}

/// Whether the bytes start with the magic bytes of a baked file.
pub fn is_baked(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Deserializes a baked graph. `path` is only used in errors.
///
/// # Errors
/// The bytes are not a valid baked graph.
pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<BakedGraph, ArchiveError> {
    graph(bytes).map_err(ArchiveFault::of(path))
}

fn graph(bytes: &[u8]) -> Result<BakedGraph, ArchiveFault> {
    let (sections, _) = checked(bytes)?;
    let most = MOST_PER_BYTE * bytes.len() as u64 + MOST_BESIDE;
    let graph = BakedGraph::from_sections(sections);
    let restored = graph.and_then(|graph| graph.restored_within(most));
    restored.map_err(ArchiveFault::Contents)
}

type Sections<'a> = [&'a [u8]; BakedGraph::SECTIONS];

/// The sections of a file and its attachment, once the checksum is compared.
fn checked(bytes: &[u8]) -> Result<(Sections<'_>, &[u8]), ArchiveFault> {
    if !is_baked(bytes) {
        return Err(ArchiveFault::NotBaked);
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .and_then(|word| word.try_into().ok())
            .map(u32::from_le_bytes)
    };
    let (Some(found), Some(checksum)) = (word(8), word(12)) else {
        return Err(ArchiveFault::Checksum);
    };
    if found != VERSION {
        let writer = writer(bytes);
        return Err(ArchiveFault::Version { found, writer });
    }
    if bytes.len() < HEADER || crc32fast::hash(&bytes[CHECKED..]) != checksum {
        return Err(ArchiveFault::Checksum);
    }
    sections(&bytes[HEADER..]).map_err(ArchiveFault::Contents)
}

/// The sections that follow the header, and the attachment.
fn sections(bytes: &[u8]) -> Result<(Sections<'_>, &[u8]), String> {
    const SHORT: &str = "a section is longer than the file";
    let (lengths, mut left) = bytes
        .split_first_chunk::<{ 8 * BakedGraph::SECTIONS }>()
        .ok_or(SHORT)?;
    let mut sections = [&[][..]; BakedGraph::SECTIONS];
    for (section, length) in sections.iter_mut().zip(lengths.as_chunks().0) {
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| SHORT)?;
        (*section, left) = left.split_at_checked(length).ok_or(SHORT)?;
    }
    match left.strip_prefix(ATTACHED) {
        _ if left.is_empty() => Ok((sections, left)),
        Some(attachment) => Ok((sections, attachment)),
        None => Err(format!("{} bytes follow its end", left.len())),
    }
}

/// Reads a baked file.
///
/// # Errors
/// An error of the file system, or of the file's contents, with the path.
pub fn read(path: &Path) -> Result<BakedGraph, ArchiveError> {
    let read = read_bytes(path).and_then(|bytes| graph(&bytes));
    read.map_err(ArchiveFault::of(path))
}

/// Reads the attachment of a baked file ([`write_with`]). Without one it is empty.
///
/// # Errors
/// An error of the file system, or a file that is damaged, with the path.
pub fn read_attachment(path: &Path) -> Result<Vec<u8>, ArchiveError> {
    let attachment = |bytes: Vec<u8>| Ok(checked(&bytes)?.1.to_vec());
    let read = read_bytes(path).and_then(attachment);
    read.map_err(ArchiveFault::of(path))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, ArchiveFault> {
    let file = open_regular(path)?;
    let mut bytes = Vec::new();
    // Read only the magic bytes first: another kind of file may be large or endless.
    (&file).take(MAGIC.len() as u64).read_to_end(&mut bytes)?;
    if is_baked(&bytes) {
        let length = file.metadata()?.len().min(LARGEST_FILE);
        bytes.reserve_exact(length as usize);
        (&file).take(LARGEST_FILE).read_to_end(&mut bytes)?;
        check_size(bytes.len() as u64)?;
    }
    Ok(bytes)
}

/// Refuses a file larger than [`LARGEST_FILE`].
fn check_size(bytes: u64) -> Result<(), ArchiveFault> {
    match bytes <= LARGEST_FILE {
        true => Ok(()),
        false => Err(ArchiveFault::TooLarge),
    }
}

/// Opens a file to be read. A named pipe or a device is an error, since reading from it may never end.
///
/// # Errors
/// An error of the file system; a path that is not a regular file.
pub fn open_regular(path: &Path) -> std::io::Result<File> {
    let there = std::fs::metadata(path)?;
    if there.is_file() || there.is_dir() {
        return File::open(path);
    }
    Err(std::io::Error::other("not a regular file"))
}

/// Writes a baked file atomically ([`write_atomically`]).
///
/// # Errors
/// An error of the file system, with the path; a file that is larger than [`LARGEST_FILE`], which [`read`] would refuse. Nothing is written
/// then.
pub fn write(path: &Path, baked: &BakedGraph) -> Result<(), ArchiveError> {
    write_with(path, baked, &[])
}

/// Writes a baked file with an attachment: bytes that a program keeps beside the graph, such as the mesh of its character.
///
/// # Errors
/// As [`write()`].
pub fn write_with(path: &Path, baked: &BakedGraph, attachment: &[u8]) -> Result<(), ArchiveError> {
    let write = || -> Result<(), ArchiveFault> {
        let bytes = with_attachment(baked, attachment).map_err(std::io::Error::other)?;
        check_size(bytes.len() as u64)?;
        Ok(write_atomically(path, |file| file.write_all(&bytes))?)
    };
    write().map_err(ArchiveFault::of(path))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_more_bytes_than_are_read_is_refused() {
        assert!(check_size(0).is_ok() && check_size(LARGEST_FILE).is_ok());
        let refused = check_size(LARGEST_FILE + 1).unwrap_err();
        let error = ArchiveFault::of(Path::new("big.sabaki"))(refused);
        assert!(matches!(error.fault, ArchiveFault::TooLarge));
        assert_eq!(error.to_string(), "big.sabaki: larger than 1000 MB");
    }
}
