//! The drawing shaders, and the host structs that they read. `shaders/table.rs` is generated from the committed SPIR-V, with the structs of
//! buffers and push constants; a test of `tests/main.rs` generates it again and compares.

use std::mem::offset_of;

use super::scene::Capsule;
use sabaki::gpu::internal::{Binding, Shader, Stage, stride, words};

#[rustfmt::skip]
#[path = "../shaders/table.rs"]
mod table;

pub(super) use table::{
    Bone, Character, DrawBodies, DrawLayer, DrawSkin, FrameData, VIEW_BODY_FRAG, VIEW_BODY_VERT,
    VIEW_FLOOR_FRAG, VIEW_FLOOR_VERT, VIEW_LAYER_FRAG, VIEW_LAYER_VERT, VIEW_SKIN_FRAG,
    VIEW_SKIN_VERT, VIEW_SKY_FRAG, VIEW_SKY_VERT,
};

/// Arguments of an indirect draw: `VkDrawIndexedIndirectCommand`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct DrawCommand {
    pub(super) index_count: u32,
    pub(super) instance_count: u32,
    pub(super) first_index: u32,
    pub(super) vertex_offset: i32,
    pub(super) first_instance: u32,
}

const _: () = {
    use table::Capsule as C;

    // The stage's descriptor set contains all storage buffers, for all shaders.
    assert!(VIEW_BODY_VERT.storage_buffers + VIEW_SKIN_VERT.storage_buffers <= 4);
    let fragments = VIEW_FLOOR_FRAG.storage_buffers + VIEW_LAYER_FRAG.storage_buffers;
    assert!(fragments + VIEW_SKIN_FRAG.storage_buffers <= 4);

    assert!(stride(&VIEW_LAYER_FRAG, 3) == size_of::<u32>());
    assert!(stride(&VIEW_SKIN_VERT, 4) == size_of::<f32>());
    assert!(stride(&VIEW_SKIN_FRAG, 7) == size_of::<[u8; 4]>());

    assert!(size_of::<Capsule>() == size_of::<C>());
    assert!(offset_of!(Capsule, a) == offset_of!(C, a));
    assert!(offset_of!(Capsule, b) == offset_of!(C, b));
    assert!(offset_of!(Capsule, colour) == offset_of!(C, colour));
};
