//! What several of the tests need.

use std::fmt::{Debug, Display};
use std::path::{Path, PathBuf};

use sabaki::anim::{Clip, Event, Skeleton};
use sabaki_import::{ClipSet, FileError, ReadError, ReadOptions, gltf, read_clips};
use serde_json::{Value, json};

/// The set of one file or folder.
pub(crate) fn read(path: &Path) -> ClipSet {
    read_clips(&[path.to_owned()], None, &ReadOptions::default()).unwrap()
}

/// What is said of something that is refused.
pub(crate) fn refusal<T: Debug, E: Display>(result: Result<T, E>) -> String {
    match result {
        Ok(read) => panic!("{read:?} is not refused"),
        Err(error) => error.to_string(),
    }
}

/// The file that is refused, and the reason.
pub(crate) fn refused_file<T: Debug>(result: Result<T, ReadError>) -> (PathBuf, FileError) {
    match result.unwrap_err() {
        ReadError::File { path, error } => (path, *error),
        other => panic!("{other}"),
    }
}

/// Writes a GLB file, and returns its path.
pub(crate) fn write_glb(
    folder: &Path,
    name: &str,
    skeleton: &Skeleton,
    clips: &[Clip],
    events: &[Event],
) -> PathBuf {
    let mut bytes = Vec::new();
    gltf::write(&mut bytes, skeleton, clips, events).unwrap();
    written(folder, name, bytes)
}

/// Writes a file, and returns its path.
pub(crate) fn written(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

pub(crate) fn floats_of(bytes: &[u8]) -> Vec<f32> {
    let words = bytes.as_chunks::<4>().0.iter();
    words.map(|word| f32::from_le_bytes(*word)).collect()
}

pub(crate) fn bytes_of(floats: &[f32]) -> Vec<u8> {
    floats
        .iter()
        .flat_map(|float| float.to_le_bytes())
        .collect()
}

/// Numbers of bytes at which the data of an accessor begins, and that it has.
pub(crate) fn place_of(document: &Value, accessor: usize) -> [usize; 2] {
    let view = document["accessors"][accessor]["bufferView"]
        .as_u64()
        .unwrap();
    let view = &document["bufferViews"][view as usize];
    ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap_or(0) as usize)
}

/// Adds an accessor and its view to the first buffer, and returns its index.
pub(crate) fn append(
    document: &mut Value,
    binary: &mut Vec<u8>,
    bytes: &[u8],
    mut accessor: Value,
) -> usize {
    let views = document["bufferViews"].as_array_mut().unwrap();
    accessor["bufferView"] = json!(views.len());
    views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
    binary.extend(bytes);
    document["buffers"][0]["byteLength"] = json!(binary.len());
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(accessor);
    accessors.len() - 1
}
