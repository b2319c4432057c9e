//! Settings of a culler.

use ash::vk;

use crate::{
    maps::RegionAtlas,
    query::{
        QuerySettings,
        cull::{Counted, CullPath},
    },
};

/// Settings of a [`Culler`](super::Culler). Memory grows with every maximum.
#[derive(Clone, Copy, Debug)]
pub struct CullerDesc<'a> {
    /// Prefix of the names of Vulkan objects, for debuggers and validation. Default "sabaki".
    pub name: &'a str,
    /// Maps of all evasions. The culler copies them.
    pub atlas: &'a RegionAtlas,
    /// [`CullPath::Stencil`] or [`CullPath::Compute`].
    pub path: CullPath,
    /// Parts of the overlaps that are counted. Default: all.
    pub counted: Counted,
    /// Maximum number of candidates of a cull. Default 1,024 for the stencil path, 4,096 for the compute path.
    pub max_candidates: u32,
    /// Maximum number of culls in flight, at most [`CullerDesc::MOST_FRAMES`]; 0 counts as 1. Default 2.
    pub frames_in_flight: u32,
    /// Whether the device measures each pass, for [`Culler::pass_times`](super::Culler::pass_times). Default false.
    pub timestamps: bool,
    /// Cache that pipelines are created with: the host's own, or that of a [`PipelineCache`](super::PipelineCache). Default: none.
    pub pipeline_cache: vk::PipelineCache,
    /// Settings of the stencil path. The compute path ignores them.
    pub stencil: StencilSettings,
    /// Settings of the compute path. The stencil path ignores them.
    pub compute: ComputeSettings,
}

impl<'a> CullerDesc<'a> {
    /// Largest [`CullerDesc::frames_in_flight`].
    pub const MOST_FRAMES: u32 = 4096;

    /// Default settings for a path.
    #[must_use]
    pub fn new(path: CullPath, atlas: &'a RegionAtlas) -> Self {
        Self {
            name: "sabaki",
            atlas,
            path,
            counted: Counted::default(),
            max_candidates: match path {
                CullPath::Stencil => 1024,
                _ => 4096,
            },
            frames_in_flight: 2,
            timestamps: false,
            pipeline_cache: vk::PipelineCache::null(),
            stencil: StencilSettings::default(),
            compute: ComputeSettings::default(),
        }
    }
}

impl CullerDesc<'_> {
    /// Sets the maxima for `queries` queries in flight, each of the usual size under `settings`. With default settings a slot then takes at
    /// most a third of a megabyte instead of 11 MB. Larger inputs (large attacks; on the stencil path also many candidates on maps with many
    /// slices, one query in nine) are refused with an error that names the limit, and the CPU counts them.
    #[must_use]
    pub fn for_settings(mut self, settings: &QuerySettings, queries: u32) -> Self {
        /// Number of boxes of a candidate. Its maps are near the attack in few slabs and slices.
        const BOXES: u32 = 6;
        let most = settings.most_evasions + settings.moves.candidates;
        self.max_candidates = u32::try_from(most).unwrap_or(u32::MAX);
        self.frames_in_flight = queries.max(1);
        self.stencil.max_discs = 2048;
        self.stencil.max_boxes = self.max_candidates.saturating_mul(BOXES).max(1024);
        self.stencil.max_queries = self.stencil.max_boxes.min(1 << 12);
        self.compute.max_blocks = 2728;
        self
    }
}

/// Settings of the stencil path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StencilSettings {
    /// Maximum number of discs of an attack, over all slabs and slices. If maps are timed, discs of the inner maps count twice, because
    /// evasion maps are compared with all slices at once. Default 65,536.
    pub max_discs: u32,
    /// Maximum number of boxes of a cull. A candidate has one box for each of its maps (of all slabs and slices) that the attack is near.
    /// Default 65,536.
    pub max_boxes: u32,
    /// Number of occlusion queries of a pool. A cull that needs more renders several times. Default 4,096.
    ///
    /// MoltenVK counts at most 32,768 queries in a submission. The culler refuses a batch with more there. The queries of several batches in
    /// one submission, and those of the host, are not added up: if they may exceed the limit, submit them separately.
    pub max_queries: u32,
    /// Columns and rows of the stencil target, in texels, limited by the device. If an attack does not fit the eight planes of the target,
    /// a cull renders several passes. Default 1,024 × 1,024.
    pub target: [u32; 2],
}

impl Default for StencilSettings {
    fn default() -> Self {
        Self {
            max_discs: 1 << 16,
            max_boxes: 1 << 16,
            max_queries: 1 << 12,
            target: [1024; 2],
        }
    }
}

/// Settings of the compute path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComputeSettings {
    /// Maximum number of blocks of an attack. A block is 8 × 4 texels of the evasions' maps that the attack covers at least one of. Blocks
    /// are counted over all slabs, clocks and slices, of inner and outer maps, and once more for the inner maps of all slices
    /// together. Default 32,768.
    pub max_blocks: u32,
    /// Maximum number of work groups of a dispatch. A larger cull is recorded as several dispatches. Default: the device's limit.
    pub max_groups: u32,
    /// Maximum size of the maps that are bound at once, in bytes. Larger maps are bound in turn, evasion by evasion. Default: the device's
    /// limit on storage buffers, which is at least 128 MiB.
    pub max_page: u64,
    /// Whether the shader reads the input directly from host-visible memory. This is for devices that share the host's memory; others would
    /// read the attack across the bus for every candidate. Otherwise the input is copied from a staging buffer. Default false.
    pub direct_input: bool,
}

impl Default for ComputeSettings {
    fn default() -> Self {
        Self {
            max_blocks: 32_768,
            max_groups: u32::MAX,
            max_page: u64::MAX,
            direct_input: false,
        }
    }
}
