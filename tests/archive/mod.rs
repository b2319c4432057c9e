//! A damaged or malicious baked file is an error and never a crash. A file that is accepted can be
//! used.

mod hostile;
mod killed;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::OnceLock;

use sabaki::archive::{ArchiveError, ArchiveFault};
use sabaki::archive::{from_bytes, to_bytes};
use sabaki::maps::BakedGraph;
use sabaki_fixtures::small::{small, use_it};

/// Where the part with the checksum begins; before it stand magic, version and the checksum.
const CHECKED: usize = 16;
/// Where the graph begins; before it stands who wrote it.
const HEADER: usize = 32;

fn small_bytes() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| to_bytes(small()).unwrap())
}

fn read(bytes: &[u8]) -> Result<BakedGraph, ArchiveError> {
    from_bytes(bytes, Path::new("some.sabaki"))
}

fn with_right_checksum(mut bytes: Vec<u8>) -> Vec<u8> {
    let checksum = crc32fast::hash(&bytes[CHECKED..]);
    bytes[12..CHECKED].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// Reads bytes and, where they are accepted, uses the graph. Says which they were where that panics.
fn is_accepted(what: &str, bytes: &[u8]) -> bool {
    let outcome = catch_unwind(AssertUnwindSafe(|| match read(bytes) {
        Ok(baked) => {
            use_it(&baked);
            Some(baked)
        }
        Err(_) => None,
    }));
    let Ok(accepted) = outcome else {
        panic!("{what}: a crash")
    };
    if let Some(baked) = &accepted {
        assert!(baked.clone().restored().is_ok(), "{what}");
    }
    accepted.is_some()
}

#[test]
fn what_is_written_is_read_again_and_a_file_appears_whole() {
    assert_eq!(&read(small_bytes()).unwrap(), small());
    assert_eq!(to_bytes(small()).unwrap(), small_bytes());
    use_it(small());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.sabaki");
    sabaki::archive::write(&path, small()).unwrap();
    assert_eq!(&sabaki::archive::read(&path).unwrap(), small());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let missing = sabaki::archive::read(&folder.path().join("none")).unwrap_err();
    assert!(missing.to_string().contains("none"));
}

#[test]
#[cfg(unix)]
fn a_link_is_followed_and_a_file_keeps_its_mode() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("real")).unwrap();
    symlink("real/graph.sabaki", at("link")).unwrap();
    symlink(at("link"), at("second")).unwrap();
    // First the file is not there, then it is.
    for link in ["link", "second"] {
        sabaki::archive::write(&at(link), small()).unwrap();
        assert!(at(link).is_symlink());
        let read = sabaki::archive::read(&at("real/graph.sabaki"));
        assert_eq!(&read.unwrap(), small());
        let mode = |bits| std::fs::Permissions::from_mode(bits);
        std::fs::set_permissions(at("real/graph.sabaki"), mode(0o600)).unwrap();
    }
    let found = std::fs::metadata(at("second")).unwrap().permissions();
    assert_eq!(found.mode() & 0o777, 0o600);
    assert_eq!(std::fs::read_dir(at("real")).unwrap().count(), 1);
    // Links that name each other are replaced.
    symlink("b", at("a")).unwrap();
    symlink("a", at("b")).unwrap();
    sabaki::archive::write(&at("a"), small()).unwrap();
    assert_eq!(&sabaki::archive::read(&at("a")).unwrap(), small());
}

#[test]
fn no_beginning_of_a_file_is_a_file_and_no_byte_may_be_damaged() {
    let bytes = small_bytes();
    let stepped = (0..bytes.len()).step_by(97);
    for length in (0..64).chain(stepped).chain(bytes.len() - 64..bytes.len()) {
        let found = read(&bytes[..length]).unwrap_err().fault;
        if length < 8 {
            assert!(matches!(found, ArchiveFault::NotBaked));
        } else {
            assert!(matches!(found, ArchiveFault::Checksum));
        }
        // No byte is without meaning: none may be lost unseen.
        for mask in [0xff, 0x01, 0x80] {
            let mut damaged = bytes.to_vec();
            damaged[length] ^= mask;
            assert!(read(&damaged).is_err(), "byte {length} ^ {mask:#x}");
        }
        if length > HEADER {
            // A truncated list, even where the checksum is that of what is left.
            let shorter = with_right_checksum(bytes[..length].to_vec());
            let found = read(&shorter).unwrap_err().fault;
            assert!(matches!(found, ArchiveFault::Contents(_)));
        }
    }
}

#[test]
fn another_magic_or_version_or_more_bytes_are_said_to_be_so() {
    for at in 0..8 {
        let mut other = small_bytes().to_vec();
        other[at] ^= 0x20;
        let found = read(&other).unwrap_err().fault;
        assert!(matches!(found, ArchiveFault::NotBaked));
    }
    let mut later = small_bytes().to_vec();
    later[8..12].copy_from_slice(&77u32.to_le_bytes());
    later[CHECKED..HEADER].copy_from_slice(b"12.3.4-beta.1\0\0\0");
    let error = read(&later).unwrap_err();
    let fault = &error.fault;
    assert!(matches!(fault, ArchiveFault::Version { found: 77, .. }));
    let words = "sabaki 12.3.4-beta.1 wrote it, in format version 77";
    assert!(error.to_string().contains(words), "{error}");
    let mut longer = small_bytes().to_vec();
    longer.extend([0; 3]);
    let found = read(&longer).unwrap_err().fault;
    assert!(matches!(found, ArchiveFault::Checksum));
    let error = read(&with_right_checksum(longer)).unwrap_err();
    assert!(error.to_string().contains("3 bytes follow"), "{error}");
}

#[test]
fn a_length_beyond_the_file_is_refused_without_the_memory_for_it() {
    // A varint of 2^60: were it believed, the memory of no machine would do.
    let huge = [0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x10];
    let bytes = small_bytes();
    for at in (HEADER..HEADER + 400).chain((HEADER..bytes.len()).step_by(61)) {
        let mut hostile = bytes[..at].to_vec();
        hostile.extend(huge);
        hostile.extend(&bytes[at + 1..]);
        is_accepted(&format!("byte {at}"), &with_right_checksum(hostile));
    }
    let only = with_right_checksum([&bytes[..HEADER], &huge].concat());
    let found = read(&only).unwrap_err().fault;
    assert!(matches!(found, ArchiveFault::Contents(_)));
}
