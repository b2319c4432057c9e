//! Splits a file into its JSON and the bytes of its buffers.

use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf_json::buffer::View;
use gltf_json::{Accessor, Index, Root};
use sabaki::archive::LARGEST_FILE;

use super::GltfError;
use super::channels::without_nodeless;
use crate::file::without_mark;

const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";

/// The part of a file that is read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ReadPurpose {
    /// Skeleton and animations.
    Motion,
    /// Skin and mesh.
    Mesh,
}

/// Parsed JSON and buffers of a file.
pub(super) struct Container {
    pub(super) root: Root,
    /// Bytes of each buffer, or `None` for unused buffers.
    pub(super) buffers: Vec<Option<Rc<Vec<u8>>>>,
    /// Size of the buffers, in bytes. Those of one URI count once.
    pub(super) bytes: u64,
}

impl Container {
    /// `load` reads an external buffer. It is called only for files in the same folder or below,
    /// only for the buffers that are needed, and once for each URI.
    pub(super) fn parse(
        bytes: &[u8],
        needs: ReadPurpose,
        load: impl FnMut(&Path) -> Result<Vec<u8>, String>,
    ) -> Result<Self, GltfError> {
        let (json, mut binary) = split(bytes)?;
        let root = parse_root(json)?;
        if !root.asset.version.starts_with("2.") {
            return Err(GltfError::Version(root.asset.version.clone()));
        }
        let needed = match needs {
            ReadPurpose::Motion => motion_buffers(&root),
            ReadPurpose::Mesh => mesh_buffers(&root),
        };
        let mut files = BufferFiles {
            load,
            read: HashMap::new(),
            most: LARGEST_FILE,
            bytes: binary.map_or(0, |binary| binary.len() as u64),
        };
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let failed = |problem: String| GltfError::Buffer {
                buffer: index,
                problem,
            };
            let bytes = match &buffer.uri {
                // Only the first buffer can be the GLB container's binary chunk.
                None => binary.take().map(|binary| Rc::new(binary.to_vec())),
                Some(_) if !needed.contains(&index) => None,
                Some(uri) => Some(files.get(uri).map_err(failed)?),
            };
            if let Some(bytes) = &bytes
                && (bytes.len() as u64) < buffer.byte_length.0
            {
                let (found, wanted) = (bytes.len(), buffer.byte_length.0);
                return Err(failed(format!(
                    "{found} bytes where {wanted} are said to be"
                )));
            }
            binary = None;
            buffers.push(bytes);
        }
        let bytes = files.bytes;
        Ok(Self {
            root,
            buffers,
            bytes,
        })
    }

    /// Bytes of a buffer view, or `None` if they are not there.
    pub(super) fn view(&self, index: usize) -> Option<&[u8]> {
        let view = self.root.buffer_views.get(index)?;
        let buffer = self.buffers.get(view.buffer.value())?.as_ref()?;
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
        let length = usize::try_from(view.byte_length.0).ok()?;
        buffer.get(start..start.checked_add(length)?)
    }
}

fn parse_root(json: &[u8]) -> Result<Root, GltfError> {
    let parsed = Root::from_slice(json).or_else(|error| match without_nodeless(json) {
        Some(json) => Root::from_slice(&json),
        None => Err(error),
    });
    parsed.map_err(|error| GltfError::Json(error.to_string()))
}

/// Reads the buffers that stand in URIs, each URI once.
struct BufferFiles<'a, L> {
    load: L,
    read: HashMap<&'a str, Rc<Vec<u8>>>,
    /// Maximum size of all buffers, in bytes.
    most: u64,
    /// Size of all buffers that were read, in bytes.
    bytes: u64,
}

impl<'a, L: FnMut(&Path) -> Result<Vec<u8>, String>> BufferFiles<'a, L> {
    fn get(&mut self, uri: &'a str) -> Result<Rc<Vec<u8>>, String> {
        if let Some(read) = self.read.get(uri) {
            return Ok(Rc::clone(read));
        }
        let bytes = Rc::new(fetch(uri, &mut self.load)?);
        self.bytes = self.bytes.saturating_add(bytes.len() as u64);
        if self.bytes > self.most {
            return Err(format!(
                "with it, the buffers have more than {} bytes together",
                self.most
            ));
        }
        self.read.insert(uri, Rc::clone(&bytes));
        Ok(bytes)
    }
}

/// Buffers that animations use. Invalid indices are reported later.
fn motion_buffers(root: &Root) -> HashSet<usize> {
    let samplers = root
        .animations
        .iter()
        .flat_map(|animation| &animation.samplers);
    let accessors = samplers.flat_map(|sampler| [sampler.input, sampler.output]);
    accessor_buffers(root, accessors).collect()
}

/// Buffers that skinned meshes, bind matrices and images use. Invalid indices are reported later.
fn mesh_buffers(root: &Root) -> HashSet<usize> {
    let skinned = root.nodes.iter().filter(|node| node.skin.is_some());
    let meshes: HashSet<usize> = skinned
        .filter_map(|node| Some(node.mesh?.value()))
        .collect();
    let meshes = meshes.iter().filter_map(|&mesh| root.meshes.get(mesh));
    let of_meshes = meshes.flat_map(|mesh| &mesh.primitives).flat_map(|part| {
        let attributes = part.attributes.values().copied();
        attributes.chain(part.indices)
    });
    let binds = root
        .skins
        .iter()
        .flat_map(|skin| skin.inverse_bind_matrices);
    let images = root.images.iter().filter_map(|image| image.buffer_view);
    accessor_buffers(root, of_meshes.chain(binds))
        .chain(images.filter_map(|view| view_buffer(root, view)))
        .collect()
}

/// Buffers of accessors.
fn accessor_buffers(
    root: &Root,
    accessors: impl Iterator<Item = Index<Accessor>>,
) -> impl Iterator<Item = usize> {
    let accessors = accessors.filter_map(|index| root.accessors.get(index.value()));
    let views = accessors.flat_map(|accessor| {
        let sparse = accessor.sparse.iter();
        let own = sparse.flat_map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
        accessor.buffer_view.into_iter().chain(own)
    });
    views.filter_map(|view| view_buffer(root, view))
}

fn view_buffer(root: &Root, view: Index<View>) -> Option<usize> {
    Some(root.buffer_views.get(view.value())?.buffer.value())
}

/// JSON and binary chunk of a GLB container, or the whole file as JSON. Chunks of other types are
/// skipped, as the specification requires.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfError> {
    if !bytes.starts_with(MAGIC) {
        return Ok((without_mark(bytes), None));
    }
    let cut_off = || GltfError::Container("it is cut off");
    let word = |at: usize| -> Option<u32> {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    match word(4).ok_or_else(cut_off)? {
        2 => {}
        version => return Err(GltfError::Version(version.to_string())),
    }
    let length = word(8).ok_or_else(cut_off)? as usize;
    if length > bytes.len() {
        return Err(cut_off());
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while at < length {
        let size = word(at).ok_or_else(cut_off)? as usize;
        let kind = bytes.get(at + 4..at + 8).ok_or_else(cut_off)?;
        let chunk = bytes.get(at + 8..).and_then(|rest| rest.get(..size));
        let chunk = chunk.ok_or_else(cut_off)?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at += 8 + size;
    }
    let json = json.ok_or(GltfError::Container("it has no JSON"))?;
    Ok((json, binary))
}

/// Bytes of a URI, which may be a data URI or a file.
pub(super) fn fetch(
    uri: &str,
    load: &mut impl FnMut(&Path) -> Result<Vec<u8>, String>,
) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data.split_once(";base64,").ok_or("not in base64")?;
        return STANDARD.decode(text).map_err(|error| error.to_string());
    }
    let path = PathBuf::from(unescaped(uri).ok_or("its URI is no path")?);
    // A file may only refer to files in its own folder or below, not elsewhere on the machine.
    let stays = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if uri.contains(':') || !path.components().all(stays) {
        return Err(format!("\"{uri}\" is not in the file's own folder"));
    }
    load(&path)
}

/// Decodes percent escapes.
fn unescaped(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
        } else {
            byte
        });
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_read_once_and_refused_when_they_are_too_large_together() {
        let mut reads = 0;
        let mut files = BufferFiles {
            load: |_: &Path| {
                reads += 1;
                Ok(vec![7; 40])
            },
            read: HashMap::new(),
            most: 100,
            bytes: 0,
        };
        for uri in ["a.bin", "a.bin", "b.bin", "a.bin"] {
            assert_eq!(files.get(uri).unwrap().len(), 40);
        }
        assert_eq!(files.bytes, 80);
        let error = files.get("c.bin").unwrap_err();
        assert_eq!(
            error,
            "with it, the buffers have more than 100 bytes together"
        );
        assert_eq!(reads, 3);
    }
}
