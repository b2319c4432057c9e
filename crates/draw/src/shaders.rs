//! The drawing shaders, and the host structs that they read. `shaders/table.rs` is generated from the committed SPIR-V;
//! a test of `tests/main.rs` generates it again and compares.

use std::mem::{offset_of, size_of};

use super::scene::Capsule;
use sabaki::gpu::internal::{Binding, Shader, Stage, has_one_set, runs_anywhere, stride, words};

#[rustfmt::skip]
#[path = "../shaders/table.rs"]
mod table;

pub(super) use table::{
    VIEW_BODY_FRAG, VIEW_BODY_VERT, VIEW_FLOOR_FRAG, VIEW_FLOOR_VERT, VIEW_LAYER_FRAG,
    VIEW_LAYER_VERT, VIEW_SKIN_FRAG, VIEW_SKIN_VERT, VIEW_SKY_FRAG, VIEW_SKY_VERT,
};

/// Uniform buffer with camera and light.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct FrameData {
    pub(super) camera: [f32; 16],
    pub(super) sun: [f32; 16],
    pub(super) unproject: [f32; 16],
    pub(super) eye: [f32; 4],
    pub(super) sunward: [f32; 4],
    pub(super) sunlight: [f32; 4],
    pub(super) above: [f32; 4],
    pub(super) below: [f32; 4],
    pub(super) horizon: [f32; 4],
    pub(super) zenith: [f32; 4],
    pub(super) ground: [f32; 4],
    pub(super) shade: [f32; 4],
    pub(super) counts: [u32; 4],
}

/// Push constants for bodies.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct DrawBodies {
    pub(super) sun: u32,
    pub(super) segments: u32,
    pub(super) rings: u32,
    /// This one and those below are read by no shader.
    pub(super) first_character: u32,
    pub(super) first_part: u32,
    pub(super) parts: u32,
}

/// Push constants for maps.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct DrawLayer {
    pub(super) placement: [f32; 4],
    pub(super) grid: [f32; 4],
    pub(super) colour: [f32; 4],
    pub(super) extent: [u32; 4],
}

/// A member of a crowd in the layout of the shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct CrowdCharacter {
    pub(super) place: [u32; 4],
    pub(super) tint: [f32; 4],
}

/// A bone of a skin in the layout of the shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct SkinBone {
    pub(super) joint: [u32; 4],
    pub(super) rotation: [f32; 4],
    pub(super) translation: [f32; 4],
    pub(super) unused: [f32; 4],
}

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

/// Push constants for skinned meshes.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct DrawSkin {
    pub(super) sun: u32,
    pub(super) first_character: u32,
    pub(super) first_bone: u32,
    pub(super) dual: u32,
    pub(super) texture_place: [u32; 4],
}

const _: () = {
    use table::{
        Bone, Capsule as C, Character, DrawBodies as B, DrawLayer as L, DrawSkin as S,
        FrameData as F,
    };

    let shaders: [&Shader; 10] = [
        &VIEW_BODY_FRAG,
        &VIEW_BODY_VERT,
        &VIEW_FLOOR_FRAG,
        &VIEW_FLOOR_VERT,
        &VIEW_LAYER_FRAG,
        &VIEW_LAYER_VERT,
        &VIEW_SKIN_FRAG,
        &VIEW_SKIN_VERT,
        &VIEW_SKY_FRAG,
        &VIEW_SKY_VERT,
    ];
    let mut index = 0;
    while index < shaders.len() {
        assert!(runs_anywhere(shaders[index]) && has_one_set(shaders[index]));
        index += 1;
    }
    // The stage's descriptor set contains all storage buffers, for all shaders.
    assert!(VIEW_BODY_VERT.storage_buffers + VIEW_SKIN_VERT.storage_buffers <= 4);
    let fragments = VIEW_FLOOR_FRAG.storage_buffers + VIEW_LAYER_FRAG.storage_buffers;
    assert!(fragments + VIEW_SKIN_FRAG.storage_buffers <= 4);

    assert!(stride(&VIEW_BODY_FRAG, 0) == size_of::<FrameData>());
    assert!(stride(&VIEW_BODY_VERT, 2) == size_of::<Capsule>());
    assert!(stride(&VIEW_FLOOR_FRAG, 2) == size_of::<Capsule>());
    assert!(stride(&VIEW_LAYER_FRAG, 3) == size_of::<u32>());
    assert!(stride(&VIEW_SKIN_VERT, 4) == size_of::<f32>());
    assert!(stride(&VIEW_SKIN_VERT, 5) == size_of::<CrowdCharacter>());
    assert!(stride(&VIEW_SKIN_VERT, 6) == size_of::<SkinBone>());
    assert!(stride(&VIEW_SKIN_FRAG, 7) == size_of::<[u8; 4]>());

    assert!(size_of::<Capsule>() == C::SIZE && offset_of!(Capsule, a) == C::A);
    assert!(offset_of!(Capsule, b) == C::B && offset_of!(Capsule, colour) == C::COLOUR);

    assert!(size_of::<FrameData>() == F::SIZE && offset_of!(FrameData, camera) == F::CAMERA);
    assert!(offset_of!(FrameData, sun) == F::SUN);
    assert!(offset_of!(FrameData, unproject) == F::UNPROJECT);
    assert!(offset_of!(FrameData, eye) == F::EYE);
    assert!(offset_of!(FrameData, sunward) == F::SUNWARD);
    assert!(offset_of!(FrameData, sunlight) == F::SUNLIGHT);
    assert!(offset_of!(FrameData, above) == F::ABOVE);
    assert!(offset_of!(FrameData, below) == F::BELOW);
    assert!(offset_of!(FrameData, horizon) == F::HORIZON);
    assert!(offset_of!(FrameData, zenith) == F::ZENITH);
    assert!(offset_of!(FrameData, ground) == F::GROUND);
    assert!(offset_of!(FrameData, shade) == F::SHADE);
    assert!(offset_of!(FrameData, counts) == F::COUNTS);

    assert!(size_of::<DrawBodies>() == B::SIZE && offset_of!(DrawBodies, sun) == B::SUN);
    assert!(offset_of!(DrawBodies, segments) == B::SEGMENTS);
    assert!(offset_of!(DrawBodies, rings) == B::RINGS);
    assert!(offset_of!(DrawBodies, first_character) == B::FIRST_CHARACTER);
    assert!(offset_of!(DrawBodies, first_part) == B::FIRST_PART);
    assert!(offset_of!(DrawBodies, parts) == B::PARTS);

    assert!(size_of::<DrawLayer>() == L::SIZE && offset_of!(DrawLayer, placement) == L::PLACEMENT);
    assert!(offset_of!(DrawLayer, grid) == L::GRID);
    assert!(offset_of!(DrawLayer, colour) == L::COLOUR);
    assert!(offset_of!(DrawLayer, extent) == L::EXTENT);

    assert!(size_of::<CrowdCharacter>() == Character::SIZE);
    assert!(offset_of!(CrowdCharacter, place) == Character::PLACE);
    assert!(offset_of!(CrowdCharacter, tint) == Character::TINT);

    assert!(size_of::<SkinBone>() == Bone::SIZE);
    assert!(offset_of!(SkinBone, joint) == Bone::JOINT);
    assert!(offset_of!(SkinBone, rotation) == Bone::ROTATION);
    assert!(offset_of!(SkinBone, translation) == Bone::TRANSLATION);
    assert!(offset_of!(SkinBone, unused) == Bone::UNUSED);

    assert!(size_of::<DrawSkin>() == S::SIZE && offset_of!(DrawSkin, sun) == S::SUN);
    assert!(offset_of!(DrawSkin, first_character) == S::FIRST_CHARACTER);
    assert!(offset_of!(DrawSkin, first_bone) == S::FIRST_BONE);
    assert!(offset_of!(DrawSkin, dual) == S::DUAL);
    assert!(offset_of!(DrawSkin, texture_place) == S::TEXTURE_PLACE);
};
