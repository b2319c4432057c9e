// Generated from the SPIR-V beside it: SABAKI_WRITE_SPIRV=1 cargo test shader_table

use super::{Binding, Shader, Stage, words};

pub(crate) const CANDIDATE_FRAG: Shader = Shader {
    name: "candidate.frag",
    storage_buffers: 1,
    bindings: &[
        Binding { set: 0, binding: 0, stride: 4 },
    ],
    words: &words::<694>(include_bytes!("spirv/candidate.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const CANDIDATE_VERT: Shader = Shader {
    name: "candidate.vert",
    push_constants: 8,
    words: &words::<615>(include_bytes!("spirv/candidate.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const COUNT_COMP: Shader = Shader {
    name: "count.comp",
    push_constants: 28,
    group: [32, 1, 1],
    storage_buffers: 4,
    bindings: &[
        Binding { set: 0, binding: 1, stride: 16 },
        Binding { set: 0, binding: 0, stride: 4 },
        Binding { set: 0, binding: 3, stride: 16 },
        Binding { set: 0, binding: 2, stride: 32 },
        Binding { set: 0, binding: 4, stride: 4 },
    ],
    words: &words::<4459>(include_bytes!("spirv/count.comp.spv")),
    ..Shader::new(Stage::Compute)
};

pub(crate) const DISC_FRAG: Shader = Shader {
    name: "disc.frag",
    words: &words::<331>(include_bytes!("spirv/disc.frag.spv")),
    ..Shader::new(Stage::Fragment)
};

pub(crate) const DISC_VERT: Shader = Shader {
    name: "disc.vert",
    push_constants: 8,
    words: &words::<725>(include_bytes!("spirv/disc.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

pub(crate) const RECT_VERT: Shader = Shader {
    name: "rect.vert",
    push_constants: 8,
    words: &words::<527>(include_bytes!("spirv/rect.vert.spv")),
    ..Shader::new(Stage::Vertex)
};

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct CountCandidates {
    pub(crate) first: u32,
    pub(crate) parts: u32,
    pub(crate) candidates: u32,
    pub(crate) sums: u32,
    pub(crate) slices: u32,
    pub(crate) planes: u32,
    pub(crate) up_to_hits: u32,
}
const _: () = assert!(size_of::<CountCandidates>() == 28);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct DrawTarget {
    pub(crate) side: [u32; 2],
}
const _: () = assert!(size_of::<DrawTarget>() == 8);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct GroupRange {
    pub(crate) first: u32,
    pub(crate) end: u32,
    pub(crate) first_plane: u32,
    pub(crate) end_plane: u32,
}
const _: () = assert!(size_of::<GroupRange>() == 16);

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlaneCandidate {
    pub(crate) turn: [i32; 4],
    pub(crate) entries: u32,
    pub(crate) first_slab: i32,
    pub(crate) slabs: u32,
    pub(crate) index: u32,
}
const _: () = assert!(size_of::<PlaneCandidate>() == 32);
