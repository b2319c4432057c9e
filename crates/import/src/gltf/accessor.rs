//! Reads numbers from buffers. All indices and ranges are checked.
//!
//! Accessors are read here and not by the crate `gltf`. Its readers add offsets without checks,
//! count down from 0 and unwrap, so a malicious file would panic. Its validation also rejects files
//! for errors in their meshes, which are not read here.

use gltf_json::accessor::sparse::Sparse;
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::validation::Checked;

use super::GltfError;
use super::container::Container;

impl Container {
    /// Elements of an accessor, with `N` floats each. Integers must be normalised.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        self.elements(index, from, |component, is_normalised| match component {
            ComponentType::F32 => Ok(number),
            _ if is_normalised => Ok(number),
            _ => Err("its integers are not normalised"),
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
        let accessors = &self.root.accessors;
        let accessor = accessors.get(index).ok_or_else(|| GltfError::Index {
            from: from(),
            what: "accessor",
            index,
        })?;
        let wrong = |problem| GltfError::Accessor {
            accessor: index,
            problem,
        };
        let component = match accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return Err(wrong("it has no known component type")),
        };
        let decode = decoder(component, accessor.normalized).map_err(wrong)?;
        let width = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec2) => 2,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            Checked::Valid(Type::Mat4) => 16,
            _ => 0,
        };
        if width != N {
            return Err(wrong("its elements have not the size that is wanted"));
        }
        let reader = Reader {
            container: self,
            accessor: index,
            from: &from,
            component,
            decode,
        };
        let elements = Elements {
            offset: accessor.byte_offset.unwrap_or_default().0,
            count: accessor.count.0,
            size: component.size() * N,
        };
        let mut values = match (accessor.buffer_view, &accessor.sparse) {
            (Some(view), _) => reader.values(view.value(), elements)?,
            (None, Some(_)) => reader.zeros(elements.count)?,
            (None, None) => return Err(wrong("it has no buffer view")),
        };
        if let Some(sparse) = &accessor.sparse {
            reader.replace(&mut values, sparse)?;
        }
        Ok(values)
    }
}

/// Decodes the component at the start of bytes, which must be long enough.
type Decode<T> = fn(ComponentType, &[u8]) -> T;

/// Reader of one accessor.
struct Reader<'a, F, T> {
    container: &'a Container,
    accessor: usize,
    /// Returns the name of the object that refers to the accessor.
    from: &'a F,
    component: ComponentType,
    decode: Decode<T>,
}

/// Range of elements in a buffer view.
#[derive(Clone, Copy)]
struct Elements {
    /// Offset of the first element in the view, in bytes.
    offset: u64,
    count: u64,
    /// Size of an element, in bytes.
    size: usize,
}

impl<F: Fn() -> String, T: Copy + Default> Reader<'_, F, T> {
    fn wrong(&self, problem: &'static str) -> GltfError {
        GltfError::Accessor {
            accessor: self.accessor,
            problem,
        }
    }

    /// Bytes of each element in a view.
    fn bytes(
        &self,
        view: usize,
        elements: Elements,
    ) -> Result<impl Iterator<Item = &[u8]>, GltfError> {
        let missing = |what, index| GltfError::Index {
            from: (self.from)(),
            what,
            index,
        };
        let views = &self.container.root.buffer_views;
        let view = views
            .get(view)
            .ok_or_else(|| missing("buffer view", view))?;
        let index = view.buffer.value();
        let buffer = self.container.buffers.get(index).and_then(Option::as_ref);
        let buffer = buffer.ok_or_else(|| missing("buffer", index))?;
        let Elements {
            offset,
            count,
            size,
        } = elements;
        let layout = Layout {
            view: (view.byte_offset.unwrap_or_default().0, view.byte_length.0),
            offset,
            stride: view.byte_stride.map_or(size, |stride| stride.0),
            count,
            size,
        };
        let bytes = layout.within(buffer);
        let bytes = bytes.ok_or_else(|| self.wrong("it is not within its buffer"))?;
        Ok((0..count as usize).map(move |element| &bytes[element * layout.stride..][..size]))
    }

    fn values<const N: usize>(
        &self,
        view: usize,
        elements: Elements,
    ) -> Result<Vec<[T; N]>, GltfError> {
        let (component, decode) = (self.component, self.decode);
        let value = |bytes: &[u8]| -> [T; N] {
            std::array::from_fn(|part| decode(component, &bytes[part * component.size()..]))
        };
        Ok(self.bytes(view, elements)?.map(value).collect())
    }

    /// Initial values of a sparse accessor without a view.
    fn zeros<const N: usize>(&self, count: u64) -> Result<Vec<[T; N]>, GltfError> {
        // Key times increase, so all but one are stored in a buffer, and other accessors have at
        // most three elements for each key.
        match usize::try_from(count) {
            Ok(elements) if count <= self.container.bytes => Ok(vec![[T::default(); N]; elements]),
            _ => Err(self.wrong("it has more elements than the buffers have bytes")),
        }
    }

    /// Replaces the elements of a sparse accessor.
    fn replace<const N: usize>(
        &self,
        values: &mut [[T; N]],
        sparse: &Sparse,
    ) -> Result<(), GltfError> {
        let kind = match sparse.indices.component_type {
            Checked::Valid(kind) => kind.0,
            Checked::Invalid => return Err(self.wrong("its sparse indices have no known type")),
        };
        let elements = |offset, size| Elements {
            offset,
            count: sparse.count.0,
            size,
        };
        let indices = elements(sparse.indices.byte_offset.0, kind.size());
        let indices = self.bytes(sparse.indices.buffer_view.value(), indices)?;
        let own = elements(sparse.values.byte_offset.0, self.component.size() * N);
        let own = self.values::<N>(sparse.values.buffer_view.value(), own)?;
        let mut next = 0;
        for (bytes, value) in indices.zip(own) {
            let index = little_endian(bytes);
            if index < next {
                return Err(self.wrong("its sparse indices do not increase"));
            }
            let place = values.get_mut(index);
            *place.ok_or_else(|| self.wrong("a sparse index is beyond its end"))? = value;
            next = index + 1;
        }
        Ok(())
    }
}

/// Unsigned little-endian number of up to four bytes.
fn little_endian(bytes: &[u8]) -> usize {
    let bytes = bytes.iter().rev();
    bytes.fold(0, |number, &byte| number << 8 | usize::from(byte))
}

/// Positions of elements in a buffer, in bytes.
struct Layout {
    view: (u64, u64),
    offset: u64,
    stride: usize,
    count: u64,
    size: usize,
}

impl Layout {
    /// Bytes from the first element on, if all elements lie within the buffer.
    fn within<'a>(&self, buffer: &'a [u8]) -> Option<&'a [u8]> {
        let (start, length) = self.view;
        let view_end = start.checked_add(length)?;
        let view = buffer.get(usize::try_from(start).ok()?..usize::try_from(view_end).ok()?)?;
        let bytes = view.get(usize::try_from(self.offset).ok()?..)?;
        let Some(last) = self.count.checked_sub(1) else {
            return Some(bytes);
        };
        let end = last
            .checked_mul(self.stride as u64)?
            .checked_add(self.size as u64)?;
        // Overlapping elements are rejected, because they could expand a small file to large data.
        (self.stride >= self.size && end <= bytes.len() as u64).then_some(bytes)
    }
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
