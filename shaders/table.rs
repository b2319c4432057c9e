// Generated from the SPIR-V beside it: SABAKI_WRITE_SPIRV=1 cargo test shader_table

use super::{Binding, Shader, Stage, words};

pub(crate) const CANDIDATE_FRAG: Shader = Shader {
    name: "candidate.frag",
    stage: Stage::Fragment,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 4 },
    ],
    words: &words::<694>(include_bytes!("spirv/candidate.frag.spv")),
};

pub(crate) const CANDIDATE_VERT: Shader = Shader {
    name: "candidate.vert",
    stage: Stage::Vertex,
    push_constants: 8,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[],
    words: &words::<615>(include_bytes!("spirv/candidate.vert.spv")),
};

pub(crate) const COUNT_COMP: Shader = Shader {
    name: "count.comp",
    stage: Stage::Compute,
    push_constants: 28,
    shared: 0,
    group: [32, 1, 1],
    storage_buffers: 4,
    bindings: &[
        Binding { set: 0, binding: 1, stride: 16 },
        Binding { set: 0, binding: 0, stride: 4 },
        Binding { set: 0, binding: 3, stride: 16 },
        Binding { set: 0, binding: 2, stride: 32 },
        Binding { set: 0, binding: 4, stride: 4 },
    ],
    words: &words::<4471>(include_bytes!("spirv/count.comp.spv")),
};

pub(crate) const DISC_FRAG: Shader = Shader {
    name: "disc.frag",
    stage: Stage::Fragment,
    push_constants: 0,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[],
    words: &words::<331>(include_bytes!("spirv/disc.frag.spv")),
};

pub(crate) const DISC_VERT: Shader = Shader {
    name: "disc.vert",
    stage: Stage::Vertex,
    push_constants: 8,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[],
    words: &words::<725>(include_bytes!("spirv/disc.vert.spv")),
};

pub(crate) const RECT_VERT: Shader = Shader {
    name: "rect.vert",
    stage: Stage::Vertex,
    push_constants: 8,
    shared: 0,
    group: [0, 0, 0],
    storage_buffers: 0,
    bindings: &[],
    words: &words::<527>(include_bytes!("spirv/rect.vert.spv")),
};

#[allow(non_snake_case)]
pub(crate) mod CountCandidates {
    pub(crate) const SIZE: usize = 28;
    pub(crate) const FIRST: usize = 0;
    pub(crate) const PARTS: usize = 4;
    pub(crate) const CANDIDATES: usize = 8;
    pub(crate) const SUMS: usize = 12;
    pub(crate) const SLICES: usize = 16;
    pub(crate) const PLANES: usize = 20;
    pub(crate) const UP_TO_HITS: usize = 24;
}

#[allow(non_snake_case)]
pub(crate) mod DrawTarget {
    pub(crate) const SIZE: usize = 8;
    pub(crate) const SIDE: usize = 0;
}

#[allow(non_snake_case)]
pub(crate) mod GroupRange {
    pub(crate) const SIZE: usize = 16;
    pub(crate) const FIRST: usize = 0;
    pub(crate) const END: usize = 4;
    pub(crate) const FIRST_PLANE: usize = 8;
    pub(crate) const END_PLANE: usize = 12;
}

#[allow(non_snake_case)]
pub(crate) mod PlaneCandidate {
    pub(crate) const SIZE: usize = 32;
    pub(crate) const TURN: usize = 0;
    pub(crate) const ENTRIES: usize = 16;
    pub(crate) const FIRST_SLAB: usize = 20;
    pub(crate) const SLABS: usize = 24;
    pub(crate) const INDEX: usize = 28;
}
