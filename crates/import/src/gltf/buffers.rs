//! Splits a file into its JSON and the bytes of its buffers, and reads numbers from them. All indices and ranges are checked.
//!
//! Accessors are read here and not by the crate `gltf`. Its readers add offsets without checks,
//! count down from 0 and unwrap, so a malicious file would panic. Its validation also rejects files
//! for errors in their meshes, which are not read here.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashMap;
use std::fmt::Display;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::buffer::View;
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Index, Root};
use sabaki::archive::LARGEST_FILE;
use serde::Deserialize;
use serde_json::Value;

use super::named;
use crate::FileError;
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

/// Reads an external file, by its path relative to the file's folder.
pub(super) type Load<'a> = &'a mut dyn FnMut(&Path) -> Result<Vec<u8>, String>;

/// Parsed JSON of a file, and its buffers, which are read when they are first needed.
pub(super) struct Container<'a> {
    pub(super) root: Root,
    /// The binary chunk of a GLB container.
    binary: Option<&'a [u8]>,
    load: RefCell<Load<'a>>,
    /// For each buffer, the first one of its URI.
    same: Vec<usize>,
    /// What was read, by the first buffer of the URI.
    read: Vec<OnceCell<Result<Vec<u8>, String>>>,
    /// Compressed views that were decoded.
    decoded: Vec<OnceCell<Result<Vec<u8>, &'static str>>>,
    /// Size of all that was read and decoded, in bytes, and its maximum.
    bytes: Cell<u64>,
    most: u64,
}

impl<'a> Container<'a> {
    /// `load` is called only for files in the same folder or below, only for the buffers that are needed, and once for each URI.
    pub(super) fn parse(bytes: &'a [u8], load: Load<'a>) -> Result<Self, FileError> {
        let (json, binary) = split(bytes)?;
        let root = parse_root(json)?;
        if !root.asset.version.starts_with("2.") {
            return Err(wrong_version(&root.asset.version));
        }
        let mut first = HashMap::new();
        let same = root.buffers.iter().enumerate().map(|(index, buffer)| {
            let uri = buffer.uri.as_deref();
            uri.map_or(index, |uri| *first.entry(uri).or_insert(index))
        });
        Ok(Self {
            same: same.collect(),
            read: vec![OnceCell::new(); root.buffers.len()],
            decoded: vec![OnceCell::new(); root.buffer_views.len()],
            root,
            binary,
            load: RefCell::new(load),
            bytes: Cell::new(binary.map_or(0, |binary| binary.len() as u64)),
            most: LARGEST_FILE,
        })
    }

    /// A line that names the extensions of the file among `names` that are not read.
    pub(super) fn note_of_extensions(names: &[String]) -> Option<String> {
        let names: Vec<&str> = unread(names).map(String::as_str).collect();
        (!names.is_empty()).then(|| format!("extensions that are not read: {}", names.join(", ")))
    }

    /// Bytes of a buffer. `from` names what refers to it.
    fn buffer(&self, index: usize, from: &str) -> Result<&[u8], FileError> {
        let buffer = named(&self.root.buffers, index, from, "buffer")?;
        let failed = |problem: String| FileError::part(format!("buffer {index}"), problem);
        let bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) => {
                let read = self.read[self.same[index]].get_or_init(|| self.read(uri));
                read.as_ref().map_err(|problem| failed(problem.clone()))?
            }
            // Only the first buffer can be the GLB container's binary chunk.
            (None, Some(binary)) if index == 0 => binary,
            _ => return Err(failed("it has no bytes".to_owned())),
        };
        let wanted = buffer.byte_length.0;
        match bytes.len() as u64 >= wanted {
            true => Ok(bytes),
            false => Err(failed(format!(
                "{} bytes where {wanted} are said to be",
                bytes.len()
            ))),
        }
    }

    fn read(&self, uri: &str) -> Result<Vec<u8>, String> {
        let bytes = self.fetch(uri)?;
        let all = self.bytes.get().saturating_add(bytes.len() as u64);
        self.bytes.set(all);
        match all <= self.most {
            true => Ok(bytes),
            false => Err(format!(
                "with it, the buffers have more than {} bytes together",
                self.most
            )),
        }
    }

    /// Bytes of a buffer view, or `None` if it ends beyond its buffer. `from` names what refers to it.
    pub(super) fn view(&self, index: usize, from: &str) -> Result<Option<&[u8]>, FileError> {
        let view = named(&self.root.buffer_views, index, from, "buffer view")?;
        let Some(compressed) = Compressed::of(view) else {
            return Ok(within(self.buffer(view.buffer.value(), from)?, view));
        };
        let source = self.buffer(compressed.buffer, from)?;
        let decoded = self.decoded[index].get_or_init(|| {
            let most = self.most.saturating_sub(self.bytes.get());
            let decoded = compressed.decode(source, view.byte_length.0, most)?;
            self.bytes.update(|bytes| bytes + decoded.len() as u64);
            Ok(decoded)
        });
        let decoded = decoded.as_ref().map_err(|&problem| {
            let view = format!("buffer view {index}, compressed by EXT_meshopt_compression");
            FileError::part(view, problem)
        })?;
        Ok(Some(decoded))
    }

    /// Bytes of a URI, which may be a data URI or a file.
    pub(super) fn fetch(&self, uri: &str) -> Result<Vec<u8>, String> {
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
        (self.load.borrow_mut())(&path)
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
pub(super) fn unread(names: &[String]) -> impl Iterator<Item = &String> {
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
    fn decode(&self, source: &[u8], length: u64, most: u64) -> Result<Vec<u8>, &'static str> {
        use meshopt::ffi;
        let end = self.byte_offset.checked_add(self.byte_length);
        let source = end.and_then(|end| source.get(self.byte_offset..end));
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

fn wrong_version(version: impl Display) -> FileError {
    FileError::Invalid(format!("glTF {version}: only version 2 can be read"))
}

fn parse_root(json: &[u8]) -> Result<Root, FileError> {
    let parsed = Root::from_slice(json).or_else(|error| match without_nodeless(json) {
        Some(json) => Root::from_slice(&json),
        None => Err(error),
    });
    parsed.map_err(|error| {
        let problem = format!("neither a GLB container nor the JSON of glTF: {error}");
        FileError::Invalid(problem)
    })
}

/// JSON and binary chunk of a GLB container, or the whole file as JSON. Chunks of other types are
/// skipped, as the specification requires.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), FileError> {
    if !bytes.starts_with(MAGIC) {
        return Ok((without_mark(bytes), None));
    }
    let damaged = |problem| FileError::part("the GLB container is damaged", problem);
    let cut_off = || damaged("it is cut off");
    let word = |at: usize| -> Option<u32> {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    match word(4).ok_or_else(cut_off)? {
        2 => {}
        version => return Err(wrong_version(version)),
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
    let json = json.ok_or_else(|| damaged("it has no JSON"))?;
    Ok((json, binary))
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

impl Container<'_> {
    /// Elements of an accessor, with `N` components each. `from` names what refers to it.
    pub(super) fn elements<T: Copy + Default, const N: usize>(
        &self,
        index: usize,
        from: &str,
        decoder: &Decoder<T>,
    ) -> Result<Vec<[T; N]>, FileError> {
        let accessor = named(&self.root.accessors, index, from, "accessor")?;
        let wrong = |problem| FileError::part(format!("accessor {index}"), problem);
        let component = match accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return Err(wrong("it has no known component type")),
        };
        let is_normalised = accessor.normalized;
        (decoder.check)(component, is_normalised).map_err(wrong)?;
        let is_as_wide = |kind: Type| kind != Type::Mat2 && kind.multiplicity() == N;
        if !matches!(accessor.type_, Checked::Valid(kind) if is_as_wide(kind)) {
            return Err(wrong("its elements have not the size that is wanted"));
        }
        // Bytes of each of `count` elements of a view, from an offset in bytes on.
        let bytes = |view: Index<View>, offset: USize64, count: u64, size: usize| {
            let of_view = self.root.buffer_views.get(view.value());
            let stride = of_view.and_then(|view| view.byte_stride);
            let stride = stride.map_or(size, |stride| stride.0);
            let start = usize::try_from(offset.0).ok();
            let bytes = self.view(view.value(), from)?;
            let bytes = bytes.and_then(|view| view.get(start?..));
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
            Ok::<_, FileError>(
                (0..count as usize).map(move |element| &bytes[element * stride..][..size]),
            )
        };
        let values = |view, offset, count| -> Result<Vec<[T; N]>, FileError> {
            let size = component.size();
            let elements = bytes(view, offset, count, size * N)?;
            let part = |bytes: &[u8], part| {
                let own = &bytes[part * size..][..size];
                (decoder.convert)(number(component, is_normalised, own))
            };
            Ok(elements
                .map(|bytes| std::array::from_fn(|at| part(bytes, at)))
                .collect())
        };
        let (offset, length) = (accessor.byte_offset.unwrap_or_default(), accessor.count.0);
        let own = |view| values(view, offset, length);
        let own = accessor.buffer_view.map(own).transpose()?;
        let Some(sparse) = &accessor.sparse else {
            return own.ok_or_else(|| wrong("it has no buffer view"));
        };
        let Checked::Valid(kind) = sparse.indices.component_type else {
            return Err(wrong("its sparse indices have no known type"));
        };
        let (indices, others, count) = (&sparse.indices, &sparse.values, sparse.count.0);
        let size = kind.0.size();
        let indices = bytes(indices.buffer_view, indices.byte_offset, count, size)?;
        let others = values(others.buffer_view, others.byte_offset, count)?;
        // Key times hardly repeat, so most are stored in a buffer, and other accessors have at most three elements for each key.
        if own.is_none() && length > self.bytes.get() {
            return Err(wrong("it has more elements than the buffers have bytes"));
        }
        let mut found = own.unwrap_or_else(|| vec![[T::default(); N]; length as usize]);
        let mut next = 0;
        for (bytes, value) in indices.zip(others) {
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

/// How the components of an accessor are read.
pub(super) struct Decoder<T> {
    /// Refuses components of a type, which may be normalised.
    check: fn(ComponentType, bool) -> Result<(), &'static str>,
    convert: fn(f64) -> T,
}

/// Reads floats. Integers must be normalised.
pub(super) const FLOATS: Decoder<f32> = Decoder {
    check: |component, is_normalised| match is_normalised || component == ComponentType::F32 {
        true => Ok(()),
        false => Err("its integers are not normalised"),
    },
    convert: |number| number as f32,
};

/// Reads floats. Integers may be normalised or stand for themselves, as `KHR_mesh_quantization` allows.
pub(super) const COORDINATES: Decoder<f32> = Decoder {
    check: |_, _| Ok(()),
    ..FLOATS
};

/// Reads unsigned integers.
pub(super) const INTEGERS: Decoder<u32> = Decoder {
    check: |component, is_normalised| match component {
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32 if !is_normalised => Ok(()),
        _ => Err("its elements are not unsigned integers"),
    },
    convert: |number| number as u32,
};

/// Unsigned little-endian number of up to four bytes.
fn little_endian(bytes: &[u8]) -> usize {
    let bytes = bytes.iter().rev();
    bytes.fold(0, |number, &byte| number << 8 | usize::from(byte))
}

/// The component in these bytes.
fn number(component: ComponentType, is_normalised: bool, bytes: &[u8]) -> f64 {
    let whole = little_endian(bytes);
    let (value, most) = match component {
        ComponentType::I8 => (f64::from(whole as u8 as i8), 127.0),
        ComponentType::U8 => (whole as f64, 255.0),
        ComponentType::I16 => (f64::from(whole as u16 as i16), 32767.0),
        ComponentType::U16 => (whole as f64, 65535.0),
        ComponentType::U32 => (whole as f64, f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_bits(whole as u32)),
    };
    match is_normalised {
        true => (value / most).max(-1.0),
        false => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_read_once_and_refused_when_they_are_too_large_together() {
        let files = ["a", "a", "b", "a", "c"];
        let buffers = files.map(|uri| format!(r#"{{"uri": "{uri}", "byteLength": 40}}"#));
        let buffers = buffers.join(",");
        let text = format!(r#"{{"asset": {{"version": "2.0"}}, "buffers": [{buffers}]}}"#);
        let mut reads = 0;
        let mut load = |_: &Path| {
            reads += 1;
            Ok(vec![7; 40])
        };
        let mut container = Container::parse(text.as_bytes(), &mut load).unwrap();
        container.most = 100;
        let read = |index| container.buffer(index, "").map(<[u8]>::len);
        assert_eq!([0, 1, 2, 3].map(|index| read(index).unwrap()), [40; 4]);
        assert_eq!(container.bytes.get(), 80);
        let error = read(4).unwrap_err().to_string();
        let said = "buffer 4: with it, the buffers have more than 100 bytes together";
        assert_eq!(error, said);
        assert_eq!(reads, 3);
    }
}
