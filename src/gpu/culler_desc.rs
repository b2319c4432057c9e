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
    ///
    /// The stencil path takes up to three occlusion queries for each candidate. MoltenVK counts at most 32,768 queries in a submission. The
    /// culler refuses a batch with more there. The queries of several batches in one submission, and those of the host, are not added up: if
    /// they may exceed the limit, submit them separately.
    pub path: CullPath,
    /// Parts of the overlaps that are counted. Default: all.
    pub counted: Counted,
    /// Maximum number of candidates of a cull. Default 1,024 for the stencil path, 4,096 for the compute path.
    pub max_candidates: u32,
    /// Maximum number of culls in flight, at most [`CullerDesc::MOST_FRAMES`]; 0 counts as 1. Default 2.
    pub frames_in_flight: u32,
    /// Cache that pipelines are created with: the host's. Default: none.
    pub pipeline_cache: vk::PipelineCache,
    /// Maximum number of blocks of an attack on the compute path. A block is 8 × 4 texels of the evasions' maps that the attack covers at
    /// least one of. Blocks are counted over all slabs, clocks and slices, of inner and outer maps, and once more for the inner maps of all
    /// slices together. Default 32,768.
    pub max_blocks: u32,
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
            pipeline_cache: vk::PipelineCache::null(),
            max_blocks: 32_768,
        }
    }
}

impl CullerDesc<'_> {
    /// Sets the maxima for `queries` queries in flight, each of the usual size under `settings`. With default settings a slot then takes at
    /// most a third of a megabyte. Larger inputs (on the compute path also large attacks) are refused with an error that names the limit, and
    /// the CPU counts them.
    #[must_use]
    pub fn for_settings(mut self, settings: &QuerySettings, queries: u32) -> Self {
        let most = settings.most_evasions + settings.moves.candidates;
        self.max_candidates = u32::try_from(most).unwrap_or(u32::MAX);
        self.frames_in_flight = queries.max(1);
        self.max_blocks = 2728;
        self
    }
}
