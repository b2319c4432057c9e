//! Draws shots.

mod drawing;
mod frame;
pub(crate) mod image_use;
mod mesh;
mod pipelines;
mod slot;
mod targets;
mod upload;

use ash::vk;

use mesh::Meshes;
use pipelines::Pipelines;
use sabaki::gpu::internal::within;
use sabaki::gpu::internal::{Buffer, BufferDesc};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse, Mismatch};
use sabaki::math::F32x16;
use slot::Slot;
use targets::Targets;

use super::scene::{CrowdShot, Shot};

/// How a [`Stage`] is made.
#[derive(Clone, Copy, Debug)]
pub struct StageDesc<'a> {
    /// For debuggers and validation.
    pub name: &'a str,
    /// Of the targets. Default `R8G8B8A8_SRGB`. One that does not encode sRGB by itself gets encoded colours.
    pub format: vk::Format,
    /// Columns and rows of the targets, at most; [`Stage::resize`] makes it others. Default 1,280 × 720.
    pub size: [u32; 2],
    /// Samples a pixel, where the device has them: 1, 2, 4 or 8. Default 4.
    pub samples: u32,
    /// The caller's frames in flight. Default 1.
    pub frames_in_flight: u32,
    /// Solids and ghosts of a shot together. Default 4,096.
    pub max_capsules: u32,
    /// 32 texels each, of all layers of a shot together; rows end on whole words. Default 262,144 (1 MiB).
    pub max_map_words: u32,
    /// Columns and rows of the shadow map. Default 2,048.
    pub shadow_side: u32,
    /// Characters of a crowd. Default 0.
    pub max_members: u32,
    /// Lines of their poses ([`crowd::Crowd::lines`](sabaki::crowd::Crowd::lines)). Default 0.
    pub max_crowd_lines: u32,
    /// Parts of a crowd's figures together. Default 4,096.
    pub max_parts: u32,
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
            max_crowd_lines: 0,
            max_parts: 4096,
        }
    }
}

/// What a shot is drawn into.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Of an image of [`StageDesc::format`] with one sample a pixel, used as a colour attachment.
    pub view: vk::ImageView,
    /// Columns and rows.
    pub size: [u32; 2],
}

/// Draws shots on a device of the caller's; [the contract](super).
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
    slots: Vec<Slot>,
    pool: vk::DescriptorPool,
    live: bool,
}

impl Stage {
    /// Makes pipelines and memory. Leaves nothing behind when it fails.
    ///
    /// # Errors
    /// A Vulkan call's, the allocator's, [`GpuError::Limit`] where the device has no such large targets, [`GpuError::Missing`]
    /// where the context's queue family has no graphics.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &StageDesc<'_>,
    ) -> Result<Self, GpuError> {
        if !context.queue_has(vk::QueueFlags::GRAPHICS) {
            return Err(GpuError::Missing(vec!["a queue family with graphics"]));
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
        parts.pipelines.fill(context, desc.format, self.samples)?;
        parts.targets.fill_shadow((context, memory), desc)?;
        parts
            .targets
            .resize((context, memory), (desc, self.samples), desc.size)?;
        parts.meshes = Meshes::new();
        let indices = bytemuck::cast_slice(&parts.meshes.indices);
        parts.indices = Buffer::new(
            context,
            memory,
            BufferDesc {
                name: &format!("{}: meshes", desc.name),
                size: indices.len() as u64,
                usage: vk::BufferUsageFlags::INDEX_BUFFER,
                memory: MemoryUse::Upload,
            },
        )?;
        parts.indices.write(context, 0, indices)?;
        for number in 0..desc.frames_in_flight.max(1) {
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill((context, memory), desc, number)?;
            }
        }
        parts.pool = slot::sets(context, parts.pipelines.set_layout, &mut parts.slots)?;
        for slot in &parts.slots {
            slot.point(context, parts.targets.shadow.view);
        }
        Ok(())
    }

    /// Makes it for targets of another size, after a window's has changed. The device is done with what was recorded.
    ///
    /// # Errors
    /// As for [`Stage::new`]; it can then be made for another size again.
    pub fn resize(&mut self, memory: &mut dyn Memory, size: [u32; 2]) -> Result<(), GpuError> {
        let side = size[0].max(size[1]);
        within(
            "side of a target",
            side.into(),
            self.context.max_target_side().into(),
        )?;
        // Nothing is drawn until it has succeeded.
        self.desc.size = [0; 2];
        let (context, targets) = (&self.context, &mut self.parts.targets);
        targets.resize((context, memory), (&self.desc, self.samples), size)?;
        self.desc.size = size;
        Ok(())
    }

    /// Memory that the device reads a crowd's poses from, for [`crowd::Crowd::pose`](sabaki::crowd::Crowd::pose) to write into.
    ///
    /// # Errors
    /// [`GpuError::Mismatch`] for a slot that does not exist.
    ///
    /// # Safety
    /// The commands that were recorded into this slot last have finished, or were never submitted.
    pub unsafe fn poses(&mut self, slot: u32) -> Result<&mut [F32x16], GpuError> {
        let slot = self.slot_mut(slot)?;
        // SAFETY: the caller knows that the device does not read it.
        unsafe { slot.poses() }
    }

    /// Records the drawing of a shot, and of the crowd whose poses were written into the slot's memory.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more than the stage was made for, [`GpuError::Mismatch`] for a slot that does not exist; a flush
    /// that failed.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family. The target is as [`Target`] says, in the
    /// layout of a colour attachment. What was recorded into this slot has finished, or was never submitted; all that a stage has
    /// recorded runs on one queue in the order of recording.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        slot: u32,
        (shot, crowd): (&Shot, Option<&CrowdShot>),
        target: &Target,
    ) -> Result<(), GpuError> {
        for axis in 0..2 {
            let (needed, most) = (target.size[axis], self.desc.size[axis]);
            within("StageDesc::size", needed.into(), most.into())?;
        }
        let draws = self.upload(slot, (shot, crowd), target)?;
        let slot = &self.parts.slots[slot as usize];
        // SAFETY: the caller vouches for `cmd`, the slot and the target.
        unsafe { self.draw(cmd, slot, &draws, target) };
        Ok(())
    }

    fn slot_mut(&mut self, slot: u32) -> Result<&mut Slot, GpuError> {
        let slots = self.parts.slots.len() as u32;
        let found = self.parts.slots.get_mut(slot as usize);
        found.ok_or(Mismatch::Slot { slot, slots }.into())
    }

    /// Frees everything. The device must be done with what was recorded.
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

/// As many samples as are wished for, or the most below that the device has.
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
