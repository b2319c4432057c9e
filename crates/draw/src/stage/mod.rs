//! Records shots into command buffers.

mod desc;
mod drawing;
mod frame;
pub(crate) mod image_use;
mod mesh;
mod pipelines;
mod skinned;
mod skins;
mod slot;
mod targets;
mod upload;

use ash::vk;

pub use desc::StageDesc;
use mesh::Meshes;
use pipelines::Pipelines;
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory, within};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};
use sabaki::math::F32x16;
use skins::Skins;
use slot::Slot;
use targets::Targets;

use super::scene::{CrowdShot, Shot};

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
    meshes: Meshes,
    indices: Buffer,
    skins: Skins,
    slots: Vec<Slot>,
    pool: vk::DescriptorPool,
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
        let side = desc.size[0].max(desc.size[1]).max(desc.shadow_side);
        within(
            "side of a target",
            side.into(),
            context.max_target_side().into(),
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
        parts.meshes = Meshes::new();
        let indices = bytemuck::cast_slice(&parts.meshes.indices);
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
        parts.pool = slot::sets(context, parts.pipelines.set_layout, &mut parts.slots)?;
        for slot in &parts.slots {
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
        let side = size[0].max(size[1]);
        within(
            "side of a target",
            side.into(),
            self.context.max_target_side().into(),
        )?;
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
        let slot = self.slot_mut(slot)?;
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

    fn slot_mut(&mut self, slot: u32) -> Result<&mut Slot, GpuError> {
        let slots = self.parts.slots.len() as u32;
        let found = self.parts.slots.get_mut(slot as usize);
        found.ok_or(GpuError::NoSuchSlot { slot, slots })
    }

    /// Frees all resources. The device must have finished all recorded commands.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.free(memory);
    }

    fn free(&mut self, memory: &mut dyn Memory) {
        let (context, parts) = (&self.context, &mut self.parts);
        // SAFETY: the pool is null or of this device, and the caller knows that the device is done with its sets.
        unsafe { context.device().destroy_descriptor_pool(parts.pool, None) };
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
