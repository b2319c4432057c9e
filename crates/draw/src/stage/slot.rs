//! Buffers of one frame in flight: camera and light, capsules, maps, skinned bodies and the crowd.

use ash::vk;
use bytemuck::Pod;

use super::StageDesc;
use super::pipelines::BINDINGS;
use crate::scene::Capsule;
use crate::shaders::{Bone, Character, DrawCommand, FrameData};
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};
use sabaki::math::F32x16;

/// Numbers of a joint of a skinned body: three rows of its frame, and the weight of its tint.
pub(super) const POSE_NUMBERS: usize = 13;
/// Maximum number of groups of a crowd that are drawn with a mesh.
pub(super) const MOST_SKINNED_GROUPS: u32 = 1024;

/// Buffers and descriptor set of a slot. Handles are null by default.
#[derive(Debug, Default)]
pub(super) struct Slot {
    pub(super) frame: Buffer,
    pub(super) capsules: Buffer,
    pub(super) words: Buffer,
    poses: Buffer,
    pub(super) members: Buffer,
    pub(super) bones: Buffer,
    pub(super) commands: Buffer,
    pub(super) set: vk::DescriptorSet,
    /// Index of the first number of the first aligned line in the crowd's memory.
    pub(super) first_number: u32,
    lines: usize,
}

impl Slot {
    /// Creates the buffers. After a failure, [`Slot::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
        number: u32,
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let mut buffer = |what: &str, count: u64, element: usize, usage| {
            device.buffer(BufferDesc {
                name: &format!("{}: {what} {number}", desc.name),
                size: count * element as u64,
                usage,
                memory: MemoryUse::Upload,
            })
        };
        let [capsules, words, bones] =
            [desc.max_capsules, desc.max_map_words, desc.max_bones].map(u64::from);
        let [members, skinned, lines, joints] = [
            desc.max_members,
            desc.max_skinned,
            desc.max_crowd_len,
            desc.max_skinned_joints,
        ]
        .map(u64::from);
        let storage = Usage::STORAGE_BUFFER;
        self.frame = buffer("frame", 1, size_of::<FrameData>(), Usage::UNIFORM_BUFFER)?;
        self.capsules = buffer("capsules", capsules, size_of::<Capsule>(), storage)?;
        self.words = buffer("maps", words, size_of::<u32>(), storage)?;
        // One additional line, because the memory may start within a line.
        let crowd = (lines + u64::from(lines > 0)) * F32x16::LANES as u64;
        let numbers = crowd + joints * POSE_NUMBERS as u64;
        self.poses = buffer("poses", numbers, size_of::<f32>(), storage)?;
        let count = members + skinned;
        self.members = buffer("crowd", count, size_of::<Character>(), storage)?;
        let (count, command) = (
            skinned + u64::from(MOST_SKINNED_GROUPS),
            size_of::<DrawCommand>(),
        );
        self.commands = buffer("draw commands", count, command, Usage::INDIRECT_BUFFER)?;
        self.bones = buffer("bones", bones, size_of::<Bone>(), storage)?;
        self.lines = desc.max_crowd_len as usize;
        // SAFETY: no other code has the buffer yet.
        let start = unsafe { self.poses.bytes_mut() }?.as_ptr() as usize;
        let skipped = start.next_multiple_of(align_of::<F32x16>()) - start;
        self.first_number = (skipped / size_of::<f32>()) as u32;
        Ok(())
    }

    /// Number of numbers in the crowd's memory.
    pub(super) fn crowd_numbers(&self) -> u64 {
        (self.lines * F32x16::LANES) as u64
    }

    /// Aligned lines of the crowd's memory.
    ///
    /// # Safety
    /// The device has finished the commands that were recorded into this slot.
    pub(super) unsafe fn poses(&mut self) -> Result<&mut [F32x16], GpuError> {
        let lines = self.lines;
        // SAFETY: the caller knows that the device does not read it.
        let bytes = unsafe { self.poses.bytes_mut() }?;
        let start = self.first_number as usize * size_of::<f32>();
        let end = (start + lines * size_of::<F32x16>()).min(bytes.len());
        Ok(bytemuck::try_cast_slice_mut(&mut bytes[start..end]).unwrap_or(&mut []))
    }

    /// Index of the first number of skinned bodies' poses, which follow the crowd's.
    pub(super) fn first_skinned_number(&self) -> u32 {
        self.first_number + (self.lines * F32x16::LANES) as u32
    }

    /// Writes the poses of skinned bodies.
    pub(super) fn write_skinned(&self, context: &Context, numbers: &[f32]) -> Result<(), GpuError> {
        let offset = u64::from(self.first_skinned_number()) * size_of::<f32>() as u64;
        self.poses
            .write(context, offset, bytemuck::cast_slice(numbers))
    }

    /// Flushes the crowd's memory.
    pub(super) fn flush_poses(&self, context: &Context) -> Result<(), GpuError> {
        self.poses.flush(context)
    }

    /// Writes the buffers and the shadow map to the descriptor set.
    pub(super) fn point(&self, context: &Context, shadow: vk::ImageView, texels: &Buffer) {
        let buffer = |buffer: &Buffer| {
            [vk::DescriptorBufferInfo::default()
                .buffer(buffer.handle)
                .range(vk::WHOLE_SIZE)]
        };
        let image = [vk::DescriptorImageInfo::default()
            .image_view(shadow)
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
        let all = [
            &self.frame,
            &self.capsules,
            &self.words,
            &self.poses,
            &self.members,
            &self.bones,
            texels,
        ];
        let infos = all.map(buffer);
        let writes: Vec<_> = (0..)
            .zip(BINDINGS)
            .map(|(number, (kind, _))| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(self.set)
                    .dst_binding(number)
                    .descriptor_type(kind);
                // Binding 1 is the image.
                match number {
                    1 => write.image_info(&image),
                    0 => write.buffer_info(&infos[0]),
                    _ => write.buffer_info(&infos[number as usize - 1]),
                }
            })
            .collect();
        // SAFETY: the set is of this device, not in use yet, and of the layout that the bindings describe.
        unsafe { context.device().update_descriptor_sets(&writes, &[]) };
    }

    /// Frees all buffers. The device must not use them any more.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        for buffer in [
            &mut self.frame,
            &mut self.capsules,
            &mut self.words,
            &mut self.poses,
            &mut self.members,
            &mut self.bones,
            &mut self.commands,
        ] {
            buffer.destroy(context, memory);
        }
    }
}

/// Writes elements to the start of a buffer.
pub(super) fn write<T: Pod>(
    context: &Context,
    buffer: &Buffer,
    elements: &[T],
) -> Result<(), GpuError> {
    buffer.write(context, 0, bytemuck::cast_slice(elements))
}
