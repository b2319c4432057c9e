//! The culling shaders, and the host structs that they read. `shaders/table.rs` is generated from the committed SPIR-V, with the structs of
//! buffers and push constants; `tests/gpu/shader_table.rs` generates it again and compares.

use crate::maps::{Disc, FixedTransform2};

/// One entry of the table.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Name of the shader's file, without the extension.
    pub name: &'static str,
    /// Pipeline stage.
    pub stage: Stage,
    /// Size of the push constants, in bytes.
    pub push_constants: u32,
    /// Size of the memory that a work group shares, in bytes.
    pub shared: u32,
    /// Number of invocations of a work group along each axis; 0 for shaders without work groups.
    pub group: [u32; 3],
    /// Number of storage buffers.
    pub storage_buffers: u32,
    /// Storage and uniform buffers, and images.
    pub bindings: &'static [Binding],
    /// Words of the SPIR-V module.
    pub words: &'static [u32],
}

impl Shader {
    /// A shader without bindings, push constants, shared memory, work groups and words.
    #[must_use]
    pub const fn new(stage: Stage) -> Self {
        Self {
            name: "",
            stage,
            push_constants: 0,
            shared: 0,
            group: [0; 3],
            storage_buffers: 0,
            bindings: &[],
            words: &[],
        }
    }
}

/// Pipeline stage of a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Vertex shader.
    Vertex,
    /// Fragment shader.
    Fragment,
    /// Compute shader.
    Compute,
}

/// A storage or uniform buffer that holds one array, or an image.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Descriptor set.
    pub set: u32,
    /// Binding number in the set.
    pub binding: u32,
    /// Size of an element of the array, in bytes; 0 for an image.
    pub stride: u32,
}

#[rustfmt::skip]
#[path = "../../shaders/table.rs"]
mod table;

pub(crate) use table::*;

/// Instance attributes of a candidate's map over an attack's map.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlacedMap {
    /// First and end texel of the part of the attack's map that is drawn, in the target.
    pub(crate) clip: [u16; 4],
    /// Transform from texels of the target to texels of the map, as a [`FixedTransform2`].
    pub(crate) turn: [i32; 4],
    /// Width and height in one word; first bit of the map; number of bits of a row; log2 of the bits of a texel.
    pub(crate) map: [u32; 4],
}

/// Number of counts of a candidate: body, outer, evasion.
pub(crate) const COUNTS: usize = 3;

/// Instance attributes of a disc in the target, clipped to its map.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlacedDisc {
    /// Centre and radius, in sub-texels of the target.
    pub(crate) disc: [i32; 3],
    /// First and end texel of the map, in the target.
    pub(crate) clip: [u16; 4],
}

/// The words of a SPIR-V file, which is little-endian.
pub const fn words<const COUNT: usize>(bytes: &[u8]) -> [u32; COUNT] {
    assert!(bytes.len() == 4 * COUNT);
    let mut words = [0; COUNT];
    let mut at = 0;
    while at < COUNT {
        let byte = 4 * at;
        words[at] = u32::from_le_bytes([
            bytes[byte],
            bytes[byte + 1],
            bytes[byte + 2],
            bytes[byte + 3],
        ]);
        at += 1;
    }
    words
}

/// Size of an element of a buffer, in bytes, as a shader reads it; 0 if the shader does not read that buffer.
pub const fn stride(shader: &Shader, binding: u32) -> usize {
    let mut index = 0;
    while index < shader.bindings.len() {
        if shader.bindings[index].binding == binding {
            return shader.bindings[index].stride as usize;
        }
        index += 1;
    }
    0
}

/// Whether a shader keeps within the limits that Vulkan guarantees (the specification, "Required Limits"), so that it runs on every device.
pub const fn runs_anywhere(shader: &Shader) -> bool {
    let [x, y, z] = shader.group;
    shader.push_constants <= 128
        && shader.storage_buffers <= 4
        && shader.shared <= 16_384
        && x <= 128
        && y <= 128
        && z <= 64
        && x * y * z <= 128
}

/// Whether all bindings of a shader are in descriptor set 0.
pub const fn has_one_set(shader: &Shader) -> bool {
    let mut index = 0;
    while index < shader.bindings.len() {
        if shader.bindings[index].set != 0 {
            return false;
        }
        index += 1;
    }
    true
}

const _: () = {
    assert!(runs_anywhere(&DISC_VERT) && runs_anywhere(&DISC_FRAG) && runs_anywhere(&RECT_VERT));
    assert!(runs_anywhere(&CANDIDATE_VERT) && runs_anywhere(&CANDIDATE_FRAG));
    assert!(runs_anywhere(&COUNT_COMP));

    assert!(has_one_set(&CANDIDATE_FRAG) && has_one_set(&COUNT_COMP));
    assert!(CANDIDATE_FRAG.bindings.len() == 1 && CANDIDATE_VERT.bindings.is_empty());
    assert!(stride(&CANDIDATE_FRAG, 0) == size_of::<u32>());

    assert!(stride(&COUNT_COMP, 0) == size_of::<u32>());
    assert!(stride(&COUNT_COMP, 1) == 4 * size_of::<u32>());
    assert!(stride(&COUNT_COMP, 4) == size_of::<u32>());

    // `disc` and `turn` have the layout of their host types.
    assert!(size_of::<Disc>() == size_of::<[i32; 3]>());
    assert!(size_of::<FixedTransform2>() == size_of::<[i32; 4]>());
};
