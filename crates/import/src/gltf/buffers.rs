//! Splits a file into its JSON and the bytes of its buffers, and reads numbers from them. All indices and ranges are checked.
//!
//! Accessors are read here and not by the crate `gltf`. Its readers add offsets without checks,
//! count down from 0 and unwrap, so a malicious file would panic. Its validation also rejects files
//! for errors in their meshes, which are not read here.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::buffer::View;
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Accessor, Index, Root};
use sabaki::archive::LARGEST_FILE;
use serde::Deserialize;
use serde_json::Value;

use super::GltfError;
use crate::file::without_mark;

const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";

/// The part of a file that is read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadPurpose {
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
        let mut root = parse_root(json)?;
        if !root.asset.version.starts_with("2.") {
            return Err(GltfError::Version(root.asset.version.clone()));
        }
        if let (ReadPurpose::Mesh, Some(name)) = (needs, unread(&root.extensions_required).next()) {
            return Err(GltfError::Extension(name.clone()));
        }
        let views = match needs {
            ReadPurpose::Motion => motion_views(&root),
            ReadPurpose::Mesh => mesh_views(&root),
        };
        let compressed: Vec<(usize, Compressed)> = views
            .iter()
            .filter_map(|&view| Some((view, Compressed::of(root.buffer_views.get(view)?)?)))
            .collect();
        let mut needed: HashSet<usize> = compressed.iter().map(|(_, of)| of.buffer).collect();
        let views = views.iter().filter_map(|&view| root.buffer_views.get(view));
        needed.extend(
            views
                .filter(|view| Compressed::of(view).is_none())
                .map(|view| view.buffer.value()),
        );
        let mut files = BufferFiles {
            load,
            read: HashMap::new(),
            most: LARGEST_FILE,
            bytes: binary.map_or(0, |binary| binary.len() as u64),
        };
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let failed = |problem: String| GltfError::part(format!("buffer {index}"), problem);
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
        let mut bytes = files.bytes;
        for (index, of) in compressed {
            let view = &mut root.buffer_views[index];
            let source = buffers.get(of.buffer).and_then(Option::as_ref);
            let most = LARGEST_FILE.saturating_sub(bytes);
            let decoded = of.decode(source, view.byte_length.0, most);
            let decoded = decoded.map_err(|problem| {
                let view = format!("buffer view {index}, compressed by EXT_meshopt_compression");
                GltfError::part(view, problem)
            })?;
            bytes += decoded.len() as u64;
            view.buffer = Index::new(buffers.len() as u32);
            view.byte_offset = None;
            buffers.push(Some(Rc::new(decoded)));
        }
        Ok(Self {
            root,
            buffers,
            bytes,
        })
    }

    /// A line that names the extensions of the file among `names` that are not read.
    pub(super) fn note_of_extensions(names: &[String]) -> Option<String> {
        let names: Vec<&str> = unread(names).map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("extensions that are not read: {}", names.join(", ")))
    }

    /// Bytes of a buffer view, or `None` if they are not there.
    pub(super) fn view(&self, index: usize) -> Option<&[u8]> {
        let view = self.root.buffer_views.get(index)?;
        within(self.buffers.get(view.buffer.value())?.as_ref()?, view)
    }
}

/// Bytes of a view of a buffer, or `None` if it ends beyond the buffer.
fn within<'a>(buffer: &'a [u8], view: &View) -> Option<&'a [u8]> {
    let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
    let length = usize::try_from(view.byte_length.0).ok()?;
    buffer.get(start..start.checked_add(length)?)
}

/// The extensions that change something that is read, and are not known. Those of lights and of materials beyond their base colour change
/// nothing.
fn unread(names: &[String]) -> impl Iterator<Item = &String> {
    const READ: [&str; 4] = [
        MESHOPT[0],
        MESHOPT[1],
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    ];
    const OTHERS: [&str; 4] = [
        "KHR_materials_",
        "KHR_lights_",
        "KHR_animation_pointer",
        "KHR_xmp",
    ];
    names.iter().filter(|name| {
        !READ.contains(&name.as_str()) && !OTHERS.iter().any(|other| name.starts_with(other))
    })
}

/// Names of the extension of compressed buffer views, before and after Khronos took it up.
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// A compressed buffer view.
///
/// Source: A. Kapoulkine, "EXT_meshopt_compression" (Khronos, glTF extensions).
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    #[serde(default)]
    filter: String,
}

impl Compressed {
    fn of(view: &View) -> Option<Self> {
        let extensions = &view.extensions.as_ref()?.others;
        let found = MESHOPT.iter().find_map(|&name| extensions.get(name))?;
        Self::deserialize(found).ok()
    }

    /// The bytes of the view, which are `length` and may be at most `most`.
    fn decode(
        &self,
        source: Option<&Rc<Vec<u8>>>,
        length: u64,
        most: u64,
    ) -> Result<Vec<u8>, &'static str> {
        use meshopt::ffi;
        let end = self.byte_offset.checked_add(self.byte_length);
        let source = source
            .zip(end)
            .and_then(|(source, end)| source.get(self.byte_offset..end));
        let source = source.ok_or("it is not within its buffer")?;
        let (count, stride) = (self.count, self.byte_stride);
        let size = count
            .checked_mul(stride)
            .filter(|&size| size as u64 == length);
        let size = size.ok_or("it has not the size of its view")?;
        if length > most {
            return Err("it is too large");
        }
        let (mode, filter) = (self.mode.as_str(), self.filter.as_str());
        let is_known = match (mode, filter) {
            ("TRIANGLES", "" | "NONE") => matches!(stride, 2 | 4) && count % 3 == 0,
            ("INDICES", "" | "NONE") => matches!(stride, 2 | 4),
            ("ATTRIBUTES", "" | "NONE" | "EXPONENTIAL") => {
                stride % 4 == 0 && (4..=256).contains(&stride)
            }
            ("ATTRIBUTES", "OCTAHEDRAL" | "COLOR") => matches!(stride, 4 | 8),
            ("ATTRIBUTES", "QUATERNION") => stride == 8,
            _ => false,
        };
        if !is_known {
            return Err("its mode, filter and stride do not fit");
        }
        let mut words = vec![0u32; size.div_ceil(4)];
        let (out, from, bytes) = (words.as_mut_ptr().cast(), source.as_ptr(), source.len());
        // SAFETY: `out` has room for `count` elements of `stride` bytes, aligned for all component types; the decoders check what they read
        // of `source`, and strides and counts are those that they and the filters allow.
        let code = unsafe {
            let code = match mode {
                "TRIANGLES" => ffi::meshopt_decodeIndexBuffer(out, count, stride, from, bytes),
                "INDICES" => ffi::meshopt_decodeIndexSequence(out, count, stride, from, bytes),
                _ => ffi::meshopt_decodeVertexBuffer(out, count, stride, from, bytes),
            };
            match filter {
                _ if code != 0 => {}
                "OCTAHEDRAL" => ffi::meshopt_decodeFilterOct(out, count, stride),
                "QUATERNION" => ffi::meshopt_decodeFilterQuat(out, count, stride),
                "EXPONENTIAL" => ffi::meshopt_decodeFilterExp(out, count, stride),
                "COLOR" => ffi::meshopt_decodeFilterColor(out, count, stride),
                _ => {}
            }
            code
        };
        match code {
            0 => Ok(bytemuck::cast_slice(&words)[..size].to_vec()),
            _ => Err("its data is damaged"),
        }
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

/// Buffer views that animations use. Invalid indices are reported later.
fn motion_views(root: &Root) -> BTreeSet<usize> {
    let samplers = root
        .animations
        .iter()
        .flat_map(|animation| &animation.samplers);
    let accessors = samplers.flat_map(|sampler| [sampler.input, sampler.output]);
    accessor_views(root, accessors).collect()
}

/// Buffer views that skinned meshes, bind matrices and images use. Invalid indices are reported later.
fn mesh_views(root: &Root) -> BTreeSet<usize> {
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
    accessor_views(root, of_meshes.chain(binds))
        .chain(images.map(|view| view.value()))
        .collect()
}

/// Buffer views of accessors.
fn accessor_views(
    root: &Root,
    accessors: impl Iterator<Item = Index<Accessor>>,
) -> impl Iterator<Item = usize> {
    let accessors = accessors.filter_map(|index| root.accessors.get(index.value()));
    let views = accessors.flat_map(|accessor| {
        let sparse = accessor.sparse.iter();
        let own = sparse.flat_map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
        accessor.buffer_view.into_iter().chain(own)
    });
    views.map(|view| view.value())
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

/// The file without the channels of animations that have no node; `None` if all have one, or if the text is invalid. The specification (3.11)
/// has readers ignore such channels, and the extension KHR_animation_pointer writes them, but the crate `gltf-json` rejects the file.
fn without_nodeless(json: &[u8]) -> Option<Vec<u8>> {
    let mut document: Value = serde_json::from_slice(json).ok()?;
    let mut is_changed = false;
    for animation in document.get_mut("animations")?.as_array_mut()? {
        let channels = animation.get_mut("channels")?.as_array_mut()?;
        let all = channels.len();
        channels.retain(|channel| {
            // What is no channel is left for later checks.
            let target = channel.get("target").and_then(Value::as_object);
            target.is_none_or(|target| target.get("node").is_some_and(|node| !node.is_null()))
        });
        is_changed |= channels.len() < all;
    }
    is_changed.then(|| serde_json::to_vec(&document).ok())?
}

impl Container {
    /// Elements of an accessor, with `N` floats each. Integers must be normalised.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        self.numbers(index, from, Err("its integers are not normalised"))
    }

    /// Elements of an accessor, with `N` floats each. Integers may be normalised or stand for themselves, as `KHR_mesh_quantization` allows.
    pub(super) fn coordinates<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        self.numbers(index, from, Ok(whole_number))
    }

    /// Elements of an accessor, with `N` floats each. `whole` reads integers that are not normalised, or says why they are refused.
    fn numbers<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
        whole: Result<Decode<f32>, &'static str>,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        self.elements(index, from, |component, is_normalised| match component {
            ComponentType::F32 => Ok(number),
            _ if is_normalised => Ok(number),
            _ => whole,
        })
    }

    /// Elements of an accessor, with `N` unsigned integers each.
    pub(super) fn integers<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
    ) -> Result<Vec<[u32; N]>, GltfError> {
        use ComponentType::{U8, U16, U32};
        self.elements(index, from, |component, is_normalised| match component {
            U8 | U16 | U32 if !is_normalised => {
                Ok(|component, bytes| little_endian(&bytes[..component.size()]) as u32)
            }
            _ => Err("its elements are not unsigned integers"),
        })
    }

    /// Elements of an accessor. `decoder` returns a function for one component, by its type and
    /// whether it is normalised.
    fn elements<T: Copy + Default, const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
        decoder: impl Fn(ComponentType, bool) -> Result<Decode<T>, &'static str>,
    ) -> Result<Vec<[T; N]>, GltfError> {
        let accessor = self.root.accessors.get(index);
        let accessor = accessor.ok_or_else(|| GltfError::index(from(), "accessor", index))?;
        let wrong = |problem| GltfError::part(format!("accessor {index}"), problem);
        let component = match accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return Err(wrong("it has no known component type")),
        };
        let decode = decoder(component, accessor.normalized).map_err(wrong)?;
        let is_as_wide = |kind: Type| kind != Type::Mat2 && kind.multiplicity() == N;
        if !matches!(accessor.type_, Checked::Valid(kind) if is_as_wide(kind)) {
            return Err(wrong("its elements have not the size that is wanted"));
        }
        // Bytes of each of `count` elements of a view, from an offset in bytes on.
        let bytes = |view: Index<View>, offset: USize64, count: u64, size: usize| {
            let missing = |what, index| GltfError::index(from(), what, index);
            let (index, views) = (view.value(), &self.root.buffer_views);
            let view = views
                .get(index)
                .ok_or_else(|| missing("buffer view", index))?;
            let index = view.buffer.value();
            let buffer = self.buffers.get(index).and_then(Option::as_ref);
            let buffer = buffer.ok_or_else(|| missing("buffer", index))?;
            let stride = view.byte_stride.map_or(size, |stride| stride.0);
            let start = usize::try_from(offset.0).ok();
            let bytes = within(buffer, view).and_then(|view| view.get(start?..));
            let end = match count.checked_sub(1) {
                None => Some(0),
                // Overlapping elements are rejected, because they could expand a small file to large data.
                Some(last) => Some(last)
                    .filter(|_| stride >= size)
                    .and_then(|last| last.checked_mul(stride as u64)?.checked_add(size as u64)),
            };
            let is_within = |bytes: &&[u8]| end.is_some_and(|end| end <= bytes.len() as u64);
            let bytes = bytes.filter(is_within);
            let bytes = bytes.ok_or_else(|| wrong("it is not within its buffer"))?;
            Ok::<_, GltfError>(
                (0..count as usize).map(move |element| &bytes[element * stride..][..size]),
            )
        };
        let values = |view, offset, count| -> Result<Vec<[T; N]>, GltfError> {
            let size = component.size();
            let elements = bytes(view, offset, count, size * N)?;
            let part = |bytes: &[u8], part| decode(component, &bytes[part * size..]);
            Ok(elements
                .map(|bytes| std::array::from_fn(|at| part(bytes, at)))
                .collect())
        };
        let (offset, count) = (accessor.byte_offset.unwrap_or_default(), accessor.count.0);
        let mut found = match (accessor.buffer_view, &accessor.sparse) {
            (Some(view), _) => values(view, offset, count)?,
            // Key times increase, so all but one are stored in a buffer, and other accessors have at
            // most three elements for each key.
            (None, Some(_)) if count <= self.bytes => vec![[T::default(); N]; count as usize],
            (None, Some(_)) => {
                return Err(wrong("it has more elements than the buffers have bytes"));
            }
            (None, None) => return Err(wrong("it has no buffer view")),
        };
        let Some(sparse) = &accessor.sparse else {
            return Ok(found);
        };
        let Checked::Valid(kind) = sparse.indices.component_type else {
            return Err(wrong("its sparse indices have no known type"));
        };
        let (indices, own, count) = (&sparse.indices, &sparse.values, sparse.count.0);
        let indices = bytes(
            indices.buffer_view,
            indices.byte_offset,
            count,
            kind.0.size(),
        )?;
        let own = values(own.buffer_view, own.byte_offset, count)?;
        let mut next = 0;
        for (bytes, value) in indices.zip(own) {
            let index = little_endian(bytes);
            if index < next {
                return Err(wrong("its sparse indices do not increase"));
            }
            let place = found.get_mut(index);
            *place.ok_or_else(|| wrong("a sparse index is beyond its end"))? = value;
            next = index + 1;
        }
        Ok(found)
    }
}

/// Decodes the component at the start of bytes, which must be long enough.
type Decode<T> = fn(ComponentType, &[u8]) -> T;

/// Unsigned little-endian number of up to four bytes.
fn little_endian(bytes: &[u8]) -> usize {
    let bytes = bytes.iter().rev();
    bytes.fold(0, |number, &byte| number << 8 | usize::from(byte))
}

/// The number at the start of `bytes`, which must be long enough.
fn number(component: ComponentType, bytes: &[u8]) -> f32 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    match component {
        ComponentType::I8 => (f32::from(bytes[0].cast_signed()) / 127.0).max(-1.0),
        ComponentType::U8 => f32::from(bytes[0]) / 255.0,
        ComponentType::I16 => (f32::from(i16::from_le_bytes(two())) / 32767.0).max(-1.0),
        ComponentType::U16 => f32::from(u16::from_le_bytes(two())) / 65535.0,
        ComponentType::U32 => (f64::from(u32::from_le_bytes(four())) / f64::from(u32::MAX)) as f32,
        ComponentType::F32 => f32::from_le_bytes(four()),
    }
}

/// The integer at the start of `bytes`, which must be long enough, as it is.
fn whole_number(component: ComponentType, bytes: &[u8]) -> f32 {
    let value = little_endian(&bytes[..component.size()]);
    match component {
        ComponentType::I8 => f32::from(value as u8 as i8),
        ComponentType::I16 => f32::from(value as u16 as i16),
        _ => value as f32,
    }
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
