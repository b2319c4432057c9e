// Generated from the SPIR-V beside it: SABAKI_WRITE_SPIRV=1 cargo test shader_table

use super::{Binding, Shader, Stage, words};

pub(crate) const VIEW_BODY_FRAG: Shader = Shader {
    name: "view_body.frag",
    stage: Stage::Fragment,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
    ],
    words: &words::<3546>(include_bytes!("spirv/view_body.frag.spv")),
};

pub(crate) const VIEW_BODY_VERT: Shader = Shader {
    name: "view_body.vert",
    stage: Stage::Vertex,
    push_constants: 24,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 2, stride: 48 },
    ],
    words: &words::<1962>(include_bytes!("spirv/view_body.vert.spv")),
};

pub(crate) const VIEW_FLOOR_FRAG: Shader = Shader {
    name: "view_floor.frag",
    stage: Stage::Fragment,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
        Binding { set: 0, binding: 2, stride: 48 },
    ],
    words: &words::<3924>(include_bytes!("spirv/view_floor.frag.spv")),
};

pub(crate) const VIEW_FLOOR_VERT: Shader = Shader {
    name: "view_floor.vert",
    stage: Stage::Vertex,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<692>(include_bytes!("spirv/view_floor.vert.spv")),
};

pub(crate) const VIEW_LAYER_FRAG: Shader = Shader {
    name: "view_layer.frag",
    stage: Stage::Fragment,
    push_constants: 64,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 3, stride: 4 },
    ],
    words: &words::<1558>(include_bytes!("spirv/view_layer.frag.spv")),
};

pub(crate) const VIEW_LAYER_VERT: Shader = Shader {
    name: "view_layer.vert",
    stage: Stage::Vertex,
    push_constants: 64,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<951>(include_bytes!("spirv/view_layer.vert.spv")),
};

pub(crate) const VIEW_SKIN_FRAG: Shader = Shader {
    name: "view_skin.frag",
    stage: Stage::Fragment,
    push_constants: 32,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
        Binding { set: 0, binding: 1, stride: 0 },
        Binding { set: 0, binding: 7, stride: 4 },
    ],
    words: &words::<5155>(include_bytes!("spirv/view_skin.frag.spv")),
};

pub(crate) const VIEW_SKIN_VERT: Shader = Shader {
    name: "view_skin.vert",
    stage: Stage::Vertex,
    push_constants: 32,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 3,
    bindings: &[
        Binding { set: 0, binding: 4, stride: 4 },
        Binding { set: 0, binding: 5, stride: 32 },
        Binding { set: 0, binding: 6, stride: 64 },
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<4123>(include_bytes!("spirv/view_skin.vert.spv")),
};

pub(crate) const VIEW_SKY_FRAG: Shader = Shader {
    name: "view_sky.frag",
    stage: Stage::Fragment,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 352 },
    ],
    words: &words::<1159>(include_bytes!("spirv/view_sky.frag.spv")),
};

pub(crate) const VIEW_SKY_VERT: Shader = Shader {
    name: "view_sky.vert",
    stage: Stage::Vertex,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[],
    words: &words::<299>(include_bytes!("spirv/view_sky.vert.spv")),
};

#[allow(non_snake_case)]
pub(crate) mod Bone {
    pub(crate) const SIZE: usize = 64;
    pub(crate) const JOINT: usize = 0;
    pub(crate) const ROTATION: usize = 16;
    pub(crate) const TRANSLATION: usize = 32;
    pub(crate) const UNUSED: usize = 48;
}

#[allow(non_snake_case)]
pub(crate) mod Capsule {
    pub(crate) const SIZE: usize = 48;
    pub(crate) const A: usize = 0;
    pub(crate) const B: usize = 16;
    pub(crate) const COLOUR: usize = 32;
}

#[allow(non_snake_case)]
pub(crate) mod Character {
    pub(crate) const SIZE: usize = 32;
    pub(crate) const PLACE: usize = 0;
    pub(crate) const TINT: usize = 16;
}

#[allow(non_snake_case)]
pub(crate) mod DrawBodies {
    pub(crate) const SIZE: usize = 24;
    pub(crate) const SUN: usize = 0;
    pub(crate) const SEGMENTS: usize = 4;
    pub(crate) const RINGS: usize = 8;
    pub(crate) const FIRST_CHARACTER: usize = 12;
    pub(crate) const FIRST_PART: usize = 16;
    pub(crate) const PARTS: usize = 20;
}

#[allow(non_snake_case)]
pub(crate) mod DrawLayer {
    pub(crate) const SIZE: usize = 64;
    pub(crate) const PLACEMENT: usize = 0;
    pub(crate) const GRID: usize = 16;
    pub(crate) const COLOUR: usize = 32;
    pub(crate) const EXTENT: usize = 48;
}

#[allow(non_snake_case)]
pub(crate) mod DrawSkin {
    pub(crate) const SIZE: usize = 32;
    pub(crate) const SUN: usize = 0;
    pub(crate) const FIRST_CHARACTER: usize = 4;
    pub(crate) const FIRST_BONE: usize = 8;
    pub(crate) const DUAL: usize = 12;
    pub(crate) const TEXTURE_PLACE: usize = 16;
}

#[allow(non_snake_case)]
pub(crate) mod FrameData {
    pub(crate) const SIZE: usize = 352;
    pub(crate) const CAMERA: usize = 0;
    pub(crate) const SUN: usize = 64;
    pub(crate) const UNPROJECT: usize = 128;
    pub(crate) const EYE: usize = 192;
    pub(crate) const SUNWARD: usize = 208;
    pub(crate) const SUNLIGHT: usize = 224;
    pub(crate) const ABOVE: usize = 240;
    pub(crate) const BELOW: usize = 256;
    pub(crate) const HORIZON: usize = 272;
    pub(crate) const ZENITH: usize = 288;
    pub(crate) const GROUND: usize = 304;
    pub(crate) const SHADE: usize = 320;
    pub(crate) const COUNTS: usize = 336;
}
