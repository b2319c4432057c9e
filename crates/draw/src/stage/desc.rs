use ash::vk;

use crate::scene::{Formation, Mesh};

/// Settings of a [`Stage`](super::Stage).
#[derive(Clone, Copy, Debug)]
pub struct StageDesc<'a> {
    /// Name for debuggers and validation.
    pub name: &'a str,
    /// Format of the targets. Default `R8G8B8A8_SRGB`. For formats without sRGB encoding, the
    /// shaders encode colours.
    pub format: vk::Format,
    /// Maximum width and height of the targets, in pixels. [`Stage::resize`](super::Stage::resize) changes it. With 0, as that of a
    /// minimised window, nothing is drawn. Default 1,280 × 720.
    pub size: [u32; 2],
    /// Samples per pixel: 1, 2, 4 or 8, limited by the device. Default 4.
    pub samples: u32,
    /// Number of the caller's frames in flight. Default 1.
    pub frames_in_flight: u32,
    /// Maximum number of solids and ghosts in a shot. Default 4,096.
    pub max_capsules: u32,
    /// Maximum size of all layers in a shot, in words of 32 texels. Rows are padded to whole words.
    /// Default 262,144 (1 MiB).
    pub max_map_words: u32,
    /// Width and height of the shadow map, in texels; 0 counts as 1. Default 2,048.
    pub shadow_side: u32,
    /// Maximum number of characters of a crowd. Default 0.
    pub max_members: u32,
    /// Maximum length of a crowd's poses, in [`F32x16`](sabaki::math::F32x16)s: see
    /// [`crowd::Crowd::output_len`](sabaki::crowd::Crowd::output_len). Default 0.
    pub max_crowd_len: u32,
    /// Maximum number of parts of a crowd's figures, and of bones of all skins. Default 4,096.
    pub max_parts: u32,
    /// Meshes that skins refer to by index. They are copied to the device. Default: none.
    pub meshes: &'a [Mesh],
    /// Maximum number of skinned bodies in a shot. Default 8.
    pub max_skinned: u32,
    /// Maximum number of joints of all skinned bodies in a shot. Default 2,048.
    pub max_skinned_joints: u32,
    /// Cache that pipelines are created with: the host's, or that of a
    /// [`PipelineCache`](sabaki::gpu::PipelineCache). Default: none.
    pub pipeline_cache: vk::PipelineCache,
}

impl<'a> StageDesc<'a> {
    /// Settings for a crowd that is drawn with these meshes.
    #[must_use]
    pub fn for_crowd(formation: &Formation, meshes: &'a [Mesh]) -> Self {
        Self {
            shadow_side: 4096,
            max_members: formation.len() as u32,
            max_crowd_len: formation.max_output_len() as u32,
            max_parts: formation.parts() as u32,
            meshes,
            ..Self::default()
        }
    }
}

impl Default for StageDesc<'_> {
    fn default() -> Self {
        Self {
            name: "view",
            format: vk::Format::R8G8B8A8_SRGB,
            size: [1280, 720],
            samples: 4,
            frames_in_flight: 1,
            max_capsules: 4096,
            max_map_words: 1 << 18,
            shadow_side: 2048,
            max_members: 0,
            max_crowd_len: 0,
            max_parts: 4096,
            meshes: &[],
            max_skinned: 8,
            max_skinned_joints: 2048,
            pipeline_cache: vk::PipelineCache::null(),
        }
    }
}
