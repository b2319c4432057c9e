//! Numbers from buffers, every index checked.

use gltf_json::accessor::{ComponentType, Type};
use gltf_json::validation::Checked;

use super::GltfError;
use super::container::Container;

impl Container {
    /// The elements of an accessor, `N` floats each; integers are normalised, as animations want them.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        from: impl Fn() -> String,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        let missing = |what, index| GltfError::Index {
            from: from(),
            what,
            index,
        };
        let wrong = |problem| GltfError::Accessor {
            accessor: index,
            problem,
        };
        let accessors = &self.root.accessors;
        let accessor = accessors
            .get(index)
            .ok_or_else(|| missing("accessor", index))?;
        if accessor.sparse.is_some() {
            return Err(wrong("sparse accessors are not supported"));
        }
        let component = match accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return Err(wrong("it has no known component type")),
        };
        if component != ComponentType::F32 && !accessor.normalized {
            return Err(wrong("its integers are not normalised"));
        }
        let width = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => 0,
        };
        if width != N {
            return Err(wrong("its elements have not the size that is wanted"));
        }
        let view = accessor
            .buffer_view
            .ok_or_else(|| wrong("it has no buffer view"))?;
        let view = { self.root.buffer_views.get(view.value()) }
            .ok_or_else(|| missing("buffer view", view.value()))?;
        let buffer = self
            .buffers
            .get(view.buffer.value())
            .and_then(Option::as_ref);
        let buffer = buffer.ok_or_else(|| missing("buffer", view.buffer.value()))?;
        let size = component.size() * N;
        let layout = Layout {
            view: (view.byte_offset.unwrap_or_default().0, view.byte_length.0),
            offset: accessor.byte_offset.unwrap_or_default().0,
            stride: view.byte_stride.map_or(size, |stride| stride.0),
            count: accessor.count.0,
            size,
        };
        let bytes = layout
            .within(buffer)
            .ok_or_else(|| wrong("it is not within its buffer"))?;
        let element = |start: usize| -> [f32; N] {
            std::array::from_fn(|part| number(component, &bytes[start + part * component.size()..]))
        };
        let starts = (0..layout.count as usize).map(|element| element * layout.stride);
        Ok(starts.map(element).collect())
    }
}

/// Where elements lie in a buffer, bytes.
struct Layout {
    view: (u64, u64),
    offset: u64,
    stride: usize,
    count: u64,
    size: usize,
}

impl Layout {
    /// The bytes from the first element on, if all elements lie within.
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
        // Elements that overlap would make much out of few bytes.
        (self.stride >= self.size && end <= bytes.len() as u64).then_some(bytes)
    }
}

/// The number at the start of `bytes`, which has as many as it needs.
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
