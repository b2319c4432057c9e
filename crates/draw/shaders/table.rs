// Generated from the SPIR-V beside it: SABAKI_WRITE_SPIRV=1 cargo test shader_table

use super::{Binding, Shader, Stage, words};

pub(crate) const VIEW_BODY_FRAG: Shader = Shader {
    name: "view_body.frag",
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
    ],
    words: &words::<3546>(include_bytes!("spirv/view_body.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const VIEW_BODY_VERT: Shader = Shader {
    name: "view_body.vert",
    push_constants: 24,
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 2, stride: 48 },
    ],
    words: &words::<1962>(include_bytes!("spirv/view_body.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const VIEW_FLOOR_FRAG: Shader = Shader {
    name: "view_floor.frag",
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
        Binding { set: 0, binding: 2, stride: 48 },
    ],
    words: &words::<3924>(include_bytes!("spirv/view_floor.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const VIEW_FLOOR_VERT: Shader = Shader {
    name: "view_floor.vert",
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<692>(include_bytes!("spirv/view_floor.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const VIEW_LAYER_FRAG: Shader = Shader {
    name: "view_layer.frag",
    push_constants: 64,
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 3, stride: 4 },
    ],
    words: &words::<1558>(include_bytes!("spirv/view_layer.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const VIEW_LAYER_VERT: Shader = Shader {
    name: "view_layer.vert",
    push_constants: 64,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<951>(include_bytes!("spirv/view_layer.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const VIEW_SKIN_FRAG: Shader = Shader {
    name: "view_skin.frag",
    push_constants: 32,
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
        Binding { set: 0, binding: 7, stride: 4 },
    ],
    words: &words::<5155>(include_bytes!("spirv/view_skin.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const VIEW_SKIN_VERT: Shader = Shader {
    name: "view_skin.vert",
    push_constants: 32,
    storage_buffers: 3,
    bindings: &[
        Binding { set: 0, binding: 4, stride: 4 },
        Binding { set: 0, binding: 5, stride: 32 },
        Binding { set: 0, binding: 6, stride: 64 },
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<4123>(include_bytes!("spirv/view_skin.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const VIEW_SKY_FRAG: Shader = Shader {
    name: "view_sky.frag",
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<1159>(include_bytes!("spirv/view_sky.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const VIEW_SKY_VERT: Shader = Shader {
    name: "view_sky.vert",
    words: &words::<299>(include_bytes!("spirv/view_sky.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Bone {
    pub(crate) joint: [u32; 4],
    pub(crate) rotation: [f32; 4],
    pub(crate) translation: [f32; 4],
    pub(crate) unused: [f32; 4],
}
const _: () = assert!(size_of::<Bone>() == 64);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Capsule {
    pub(crate) a: [f32; 4],
    pub(crate) b: [f32; 4],
    pub(crate) colour: [f32; 4],
}
const _: () = assert!(size_of::<Capsule>() == 48);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Character {
    pub(crate) place: [u32; 4],
    pub(crate) tint: [f32; 4],
}
const _: () = assert!(size_of::<Character>() == 32);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct DrawBodies {
    pub(crate) sun: u32,
    pub(crate) segments: u32,
    pub(crate) rings: u32,
    pub(crate) first_character: u32,
    pub(crate) first_part: u32,
    pub(crate) parts: u32,
}
const _: () = assert!(size_of::<DrawBodies>() == 24);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct DrawLayer {
    pub(crate) placement: [f32; 4],
    pub(crate) grid: [f32; 4],
    pub(crate) colour: [f32; 4],
    pub(crate) extent: [u32; 4],
}
const _: () = assert!(size_of::<DrawLayer>() == 64);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct DrawSkin {
    pub(crate) sun: u32,
    pub(crate) first_character: u32,
    pub(crate) first_bone: u32,
    pub(crate) dual: u32,
    pub(crate) texture_place: [u32; 4],
}
const _: () = assert!(size_of::<DrawSkin>() == 32);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct FrameData {
    pub(crate) camera: [f32; 16],
    pub(crate) sun: [f32; 16],
    pub(crate) unproject: [f32; 16],
    pub(crate) eye: [f32; 4],
    pub(crate) sunward: [f32; 4],
    pub(crate) sunlight: [f32; 4],
    pub(crate) above: [f32; 4],
    pub(crate) below: [f32; 4],
    pub(crate) horizon: [f32; 4],
    pub(crate) zenith: [f32; 4],
    pub(crate) ground: [f32; 4],
    pub(crate) shade: [f32; 4],
    pub(crate) counts: [u32; 4],
}
const _: () = assert!(size_of::<FrameData>() == 352);
