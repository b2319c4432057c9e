//! The shaders, and what the host must know of them: written by `shaders/build.rs` from the committed SPIR-V.

use std::mem::{offset_of, size_of};

use crate::gpu::stencil::maps::MapBits as HostBits;
use crate::region::{Disc, MapTurn};

/// One entry of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shader {
    /// Of its file, without the ending.
    pub(crate) name: &'static str,
    pub(crate) stage: Stage,
    /// Bytes.
    pub(crate) push_constants: u32,
    /// Bytes that a work group shares.
    pub(crate) shared: u32,
    /// Invocations of a work group, by axis; zeros where there are no groups.
    pub(crate) group: [u32; 3],
    /// Of its buffers, how many are storage buffers.
    pub(crate) storage_buffers: u32,
    /// Its storage and uniform buffers.
    pub(crate) bindings: &'static [Binding],
    /// SPIR-V.
    pub(crate) words: &'static [u32],
}

/// The stages in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    Vertex,
    Fragment,
    Compute,
}

/// A storage or uniform buffer that holds one array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Binding {
    pub(crate) set: u32,
    pub(crate) binding: u32,
    /// Of its elements, bytes.
    pub(crate) stride: u32,
}

include!(concat!(env!("OUT_DIR"), "/shader_table.rs"));

/// Push constants of the shaders that draw maps.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct TargetSide {
    pub(crate) side: [u32; 2],
}

/// A candidate's map of one slab and slice over the attack's: 2 × 16 bits a word, as the shader has
/// it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlacedBox {
    pub(crate) low: u32,
    pub(crate) high: u32,
    pub(crate) origin: u32,
    pub(crate) map: u32,
}

/// Push constants of the compute shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct CountSettings {
    pub(crate) first: u32,
    pub(crate) parts: u32,
    pub(crate) candidates: u32,
    pub(crate) sums: u32,
    pub(crate) slices: u32,
    pub(crate) planes: u32,
}

/// One candidate, with the planes of its region.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlacedPlanes {
    pub(crate) turn: [i32; 4],
    pub(crate) entries: u32,
    pub(crate) first_slab: i32,
    pub(crate) slabs: u32,
    pub(crate) index: u32,
}

/// Candidates of a work group, and what of the attack they are held against.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct CandidateGroup {
    pub(crate) first: u32,
    pub(crate) end: u32,
    pub(crate) first_plane: u32,
    pub(crate) end_plane: u32,
}

/// What the compute shader counts of a candidate: body, outer, evasion.
pub(crate) const COUNTS: usize = 3;

/// A disc on the target, cut off at its map: vertex attributes, one an instance.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PlacedDisc {
    /// Centre and radius, sub-texels of the target.
    pub(crate) disc: [i32; 3],
    /// First and end texel of the map, in the target.
    pub(crate) clip: [u16; 4],
}

/// Stride of a buffer's elements as a shader reads them; 0 where it does not read that buffer.
const fn stride(shader: &Shader, binding: u32) -> usize {
    let mut index = 0;
    while index < shader.bindings.len() {
        if shader.bindings[index].binding == binding {
            return shader.bindings[index].stride as usize;
        }
        index += 1;
    }
    0
}

/// Whether every device takes it, however few its limits: those that Vulkan guarantees (`limits.rs`).
const fn runs_anywhere(shader: &Shader) -> bool {
    let [x, y, z] = shader.group;
    shader.push_constants <= 128
        && shader.storage_buffers <= 4
        && shader.shared <= 16_384
        && x <= 128
        && y <= 128
        && z <= 64
        && x * y * z <= 128
}

const _: () = {
    assert!(runs_anywhere(&DISC_VERT) && runs_anywhere(&DISC_FRAG) && runs_anywhere(&RECT_VERT));
    assert!(runs_anywhere(&CANDIDATE_VERT) && runs_anywhere(&CANDIDATE_FRAG));
    assert!(runs_anywhere(&COUNT_COMP));

    assert!(stride(&CANDIDATE_FRAG, 0) == size_of::<u32>());
    assert!(stride(&CANDIDATE_VERT, 1) == size_of::<HostBits>());
    assert!(stride(&CANDIDATE_VERT, 2) == size_of::<PlacedBox>());
    assert!(stride(&CANDIDATE_VERT, 3) == size_of::<MapTurn>());

    assert!(size_of::<TargetSide>() == DrawTarget::SIZE);
    assert!(offset_of!(TargetSide, side) == DrawTarget::SIDE);

    assert!(size_of::<PlacedBox>() == PlacedBits::SIZE);
    assert!(offset_of!(PlacedBox, low) == PlacedBits::LOW);
    assert!(offset_of!(PlacedBox, high) == PlacedBits::HIGH);
    assert!(offset_of!(PlacedBox, origin) == PlacedBits::ORIGIN);
    assert!(offset_of!(PlacedBox, map) == PlacedBits::MAP);

    assert!(size_of::<HostBits>() == MapBits::SIZE);
    assert!(offset_of!(HostBits, u) == MapBits::U);
    assert!(offset_of!(HostBits, v) == MapBits::V);
    assert!(offset_of!(HostBits, width) == MapBits::WIDTH);
    assert!(offset_of!(HostBits, height) == MapBits::HEIGHT);
    assert!(offset_of!(HostBits, first_bit) == MapBits::FIRST_BIT);
    assert!(offset_of!(HostBits, row_bits) == MapBits::ROW_BITS);
    assert!(offset_of!(HostBits, texel_bits_log2) == MapBits::TEXEL_BITS_LOG2);
    assert!(offset_of!(HostBits, padding) == MapBits::PADDING);

    assert!(stride(&COUNT_COMP, 0) == size_of::<u32>());
    assert!(stride(&COUNT_COMP, 1) == 4 * size_of::<u32>());
    assert!(stride(&COUNT_COMP, 2) == size_of::<PlacedPlanes>());
    assert!(stride(&COUNT_COMP, 3) == size_of::<CandidateGroup>());
    assert!(stride(&COUNT_COMP, 4) == size_of::<u32>());

    assert!(size_of::<CountSettings>() == CountCandidates::SIZE);
    assert!(offset_of!(CountSettings, first) == CountCandidates::FIRST);
    assert!(offset_of!(CountSettings, parts) == CountCandidates::PARTS);
    assert!(offset_of!(CountSettings, candidates) == CountCandidates::CANDIDATES);
    assert!(offset_of!(CountSettings, sums) == CountCandidates::SUMS);
    assert!(offset_of!(CountSettings, slices) == CountCandidates::SLICES);
    assert!(offset_of!(CountSettings, planes) == CountCandidates::PLANES);

    assert!(size_of::<PlacedPlanes>() == PlaneCandidate::SIZE);
    assert!(offset_of!(PlacedPlanes, turn) == PlaneCandidate::TURN);
    assert!(offset_of!(PlacedPlanes, entries) == PlaneCandidate::ENTRIES);
    assert!(offset_of!(PlacedPlanes, first_slab) == PlaneCandidate::FIRST_SLAB);
    assert!(offset_of!(PlacedPlanes, slabs) == PlaneCandidate::SLABS);
    assert!(offset_of!(PlacedPlanes, index) == PlaneCandidate::INDEX);

    assert!(size_of::<CandidateGroup>() == GroupRange::SIZE);
    assert!(offset_of!(CandidateGroup, first) == GroupRange::FIRST);
    assert!(offset_of!(CandidateGroup, end) == GroupRange::END);
    assert!(offset_of!(CandidateGroup, first_plane) == GroupRange::FIRST_PLANE);
    assert!(offset_of!(CandidateGroup, end_plane) == GroupRange::END_PLANE);

    // `disc` and `turn` are their host types, word for word.
    assert!(size_of::<Disc>() == size_of::<[i32; 3]>());
    assert!(size_of::<MapTurn>() == size_of::<[i32; 4]>());
};
