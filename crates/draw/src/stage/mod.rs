//! Records shots into command buffers.

pub(crate) mod drawing;
mod meshes;
mod pipelines;
mod slot;
mod upload;

use ash::vk;

use meshes::{Skins, capsule_indices};
use pipelines::{DEPTH, Pipelines};
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory, Image, ImageDesc, within};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};
use sabaki::math::F32x16;
use slot::Slot;

use super::scene::{CrowdShot, Formation, Mesh, Shot};

/// Settings of a [`Stage`].
#[derive(Clone, Copy, Debug)]
pub struct StageDesc<'a> {
    /// Name for debuggers and validation.
    pub name: &'a str,
    /// Format of the targets. Default `R8G8B8A8_SRGB`. For formats without sRGB encoding, the
    /// shaders encode colours.
    pub format: vk::Format,
    /// Maximum width and height of the targets, in pixels. [`Stage::resize`] changes it. With 0, as that of a
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
    /// Maximum number of bones of all skins. Default 4,096.
    pub max_bones: u32,
    /// Meshes that skins refer to by index. They are copied to the device. Default: none.
    pub meshes: &'a [Mesh],
    /// Maximum number of skinned bodies in a shot. Default 8.
    pub max_skinned: u32,
    /// Maximum number of joints of all skinned bodies in a shot. Default 2,048.
    pub max_skinned_joints: u32,
    /// Cache that pipelines are created with: the host's. Default: none.
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
            max_bones: formation.bones() as u32,
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
            max_bones: 4096,
            meshes: &[],
            max_skinned: 8,
            max_skinned_joints: 2048,
            pipeline_cache: vk::PipelineCache::null(),
        }
    }
}

/// Image that a shot is drawn into.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// View of an image of [`StageDesc::format`] with one sample per pixel and colour-attachment
    /// usage.
    pub view: vk::ImageView,
    /// Width and height, in pixels.
    pub size: [u32; 2],
}

/// A shot, and the image that it is drawn into.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Bodies, maps, camera and light.
    pub shot: &'a Shot,
    /// The crowd whose poses are in the slot's memory. `None` for no crowd.
    pub crowd: Option<&'a CrowdShot>,
    /// Image that is drawn into.
    pub target: Target,
}

/// Draws shots on the caller's device. See [the contract](super).
#[derive(Debug)]
pub struct Stage {
    context: Context,
    desc: StageDesc<'static>,
    samples: vk::SampleCountFlags,
    parts: Parts,
}

#[derive(Debug, Default)]
struct Parts {
    pipelines: Pipelines,
    targets: Targets,
    indices: Buffer,
    skins: Skins,
    slots: Vec<Slot>,
    live: bool,
}

impl Stage {
    /// Creates pipelines and memory. On failure, all resources are freed.
    ///
    /// # Errors
    /// An error of a Vulkan call or of the allocator; [`GpuError::Limit`] if the device does not
    /// support such large targets or buffers, or if a mesh lacks vertices or texels that it refers to;
    /// [`GpuError::Missing`] if the context lacks graphics,
    /// dynamic rendering or synchronization2.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &StageDesc<'_>,
    ) -> Result<Self, GpuError> {
        let report = context.report();
        if !report.stencil.runs() {
            return Err(GpuError::Missing(report.stencil.lacks.clone()));
        }
        if !report.features.synchronization2 {
            return Err(GpuError::Missing(vec!["synchronization2"]));
        }
        check_side(
            context,
            desc.size[0].max(desc.size[1]).max(desc.shadow_side),
        )?;
        let mut stage = Self {
            context: context.clone(),
            desc: StageDesc {
                name: "view",
                meshes: &[],
                ..*desc
            },
            samples: samples(context, desc.samples),
            parts: Parts::default(),
        };
        match stage.fill(memory, desc) {
            Ok(()) => Ok(stage),
            Err(error) => {
                stage.free(memory);
                Err(error)
            }
        }
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &StageDesc<'_>) -> Result<(), GpuError> {
        let (context, parts) = (&self.context, &mut self.parts);
        parts.live = true;
        parts.pipelines.fill(context, desc, self.samples)?;
        let mut device = DeviceMemory { context, memory };
        parts.targets.fill_shadow(&mut device, desc)?;
        parts.targets.resize(&mut device, desc, self.samples)?;
        let indices = capsule_indices();
        let indices = bytemuck::cast_slice(&indices);
        parts.indices = device.buffer(BufferDesc {
            name: &format!("{}: meshes", desc.name),
            size: indices.len() as u64,
            usage: vk::BufferUsageFlags::INDEX_BUFFER,
            memory: MemoryUse::Upload,
        })?;
        parts.indices.write(context, 0, indices)?;
        parts.skins.fill(&mut device, desc)?;
        for number in 0..desc.frames_in_flight.max(1) {
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill(&mut device, desc, number)?;
            }
        }
        let sets = parts.pipelines.sets.allocate(context, parts.slots.len())?;
        for (slot, set) in parts.slots.iter_mut().zip(sets) {
            slot.set = set;
            slot.point(context, parts.targets.shadow.view, &parts.skins.texels);
        }
        Ok(())
    }

    /// Changes the size of the targets, for example after a window was resized. The device must
    /// have finished all recorded commands.
    ///
    /// # Errors
    /// As for [`Stage::new`]. After an error, `resize` can be called again.
    pub fn resize(&mut self, memory: &mut dyn Memory, size: [u32; 2]) -> Result<(), GpuError> {
        check_side(&self.context, size[0].max(size[1]))?;
        // Nothing can be drawn until the resize has succeeded.
        self.desc.size = [0; 2];
        let (context, targets) = (&self.context, &mut self.parts.targets);
        let desc = StageDesc { size, ..self.desc };
        targets.resize(&mut DeviceMemory { context, memory }, &desc, self.samples)?;
        self.desc.size = size;
        Ok(())
    }

    /// Memory from which the device reads a crowd's poses.
    /// [`crowd::Crowd::pose`](sabaki::crowd::Crowd::pose) writes them.
    ///
    /// # Errors
    /// [`GpuError::NoSuchSlot`] if the slot does not exist.
    ///
    /// # Safety
    /// The commands that were last recorded into this slot have finished or were never submitted.
    pub unsafe fn poses(&mut self, slot: u32) -> Result<&mut [F32x16], GpuError> {
        let slots = self.parts.slots.len() as u32;
        let found = self.parts.slots.get_mut(slot as usize);
        let slot = found.ok_or(GpuError::NoSuchSlot { slot, slots })?;
        // SAFETY: the caller knows that the device does not read it.
        unsafe { slot.poses() }
    }

    /// Records a picture, or nothing for a target without pixels.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if the shot exceeds the stage's sizes or refers to what it does not have;
    /// [`GpuError::NoSuchSlot`] if the slot does not exist; an error if memory cannot be flushed.
    ///
    /// # Safety
    /// `cmd` is in the recording state, outside of rendering, for a queue of the context's family.
    /// The target meets the requirements of [`Target`] and is in the layout of a colour attachment.
    /// The commands that were last recorded into this slot have finished or were never submitted.
    /// All commands of a stage run on one queue in the order of recording.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        slot: u32,
        picture: &Picture<'_>,
    ) -> Result<(), GpuError> {
        for axis in 0..2 {
            let (needed, most) = (picture.target.size[axis], self.desc.size[axis]);
            within("StageDesc::size", needed.into(), most.into())?;
        }
        if picture.target.size.contains(&0) {
            return Ok(());
        }
        let draws = self.upload(slot, picture)?;
        let slot = &self.parts.slots[slot as usize];
        // SAFETY: the caller vouches for `cmd`, the slot and the target.
        unsafe { self.draw(cmd, slot, &draws) };
        Ok(())
    }

    /// Frees all resources. The device must have finished all recorded commands.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.free(memory);
    }

    fn free(&mut self, memory: &mut dyn Memory) {
        let (context, parts) = (&self.context, &mut self.parts);
        for slot in &mut parts.slots {
            slot.destroy(context, memory);
        }
        parts.indices.destroy(context, memory);
        parts.skins.destroy(context, memory);
        parts.targets.destroy(context, memory);
        parts.pipelines.destroy(context);
        parts.live = false;
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if self.parts.live {
            tracing::error!("a Stage was dropped without destroy: its Vulkan objects leak");
        }
    }
}

/// Internal images. Handles are null by default.
#[derive(Debug, Default)]
struct Targets {
    shadow: Image,
    depth: Image,
    /// Colour samples, or null for one sample per pixel.
    samples: Image,
}

impl Targets {
    fn fill_shadow(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
    ) -> Result<(), GpuError> {
        use vk::ImageUsageFlags as Usage;
        let desc = ImageDesc {
            name: &format!("{}: shadow map", desc.name),
            side: [desc.shadow_side.max(1); 2],
            format: DEPTH,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: Usage::DEPTH_STENCIL_ATTACHMENT | Usage::SAMPLED,
            aspect: vk::ImageAspectFlags::DEPTH,
        };
        self.shadow = device.image(&desc)?;
        Ok(())
    }

    /// Creates depth buffer and colour samples of the size of `desc`, and frees the previous ones.
    fn resize(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
        samples: vk::SampleCountFlags,
    ) -> Result<(), GpuError> {
        use vk::ImageUsageFlags as Usage;
        self.depth.destroy(device.context, device.memory);
        self.samples.destroy(device.context, device.memory);
        let depth = ImageDesc {
            name: &format!("{}: depth", desc.name),
            side: desc.size.map(|side| side.max(1)),
            format: DEPTH,
            samples,
            usage: Usage::DEPTH_STENCIL_ATTACHMENT | Usage::TRANSIENT_ATTACHMENT,
            aspect: vk::ImageAspectFlags::DEPTH,
        };
        self.depth = device.image(&depth)?;
        if samples != vk::SampleCountFlags::TYPE_1 {
            let colour = ImageDesc {
                name: &format!("{}: samples", desc.name),
                format: desc.format,
                usage: Usage::COLOR_ATTACHMENT | Usage::TRANSIENT_ATTACHMENT,
                aspect: vk::ImageAspectFlags::COLOR,
                ..depth
            };
            self.samples = device.image(&colour)?;
        }
        Ok(())
    }

    fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        for image in [&mut self.shadow, &mut self.depth, &mut self.samples] {
            image.destroy(context, memory);
        }
    }
}

/// The requested number of samples, or the largest smaller number that the device supports.
fn samples(context: &Context, wished: u32) -> vk::SampleCountFlags {
    let limits = context.limits();
    let both = limits.framebuffer_color_sample_counts & limits.framebuffer_depth_sample_counts;
    use vk::SampleCountFlags as Count;
    let known = [(8, Count::TYPE_8), (4, Count::TYPE_4), (2, Count::TYPE_2)];
    let mut offered = known
        .iter()
        .filter(|(count, flag)| *count <= wished && both.contains(*flag));
    offered.next().map_or(Count::TYPE_1, |(_, flag)| *flag)
}

pub(crate) fn check_side(context: &Context, side: u32) -> Result<(), GpuError> {
    let most = context.max_target_side();
    within("side of a target", side.into(), most.into())
}
