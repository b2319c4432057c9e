//! Buffers of one cull in flight: its input and its counts.

use ash::vk;

use super::gathered::{Capacity, Gathered};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    counts::{Counts, HEADER},
    resources::{Buffer, BufferDesc, DeviceMemory},
};

/// Buffers and descriptor set of one cull in flight. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Input that the host writes: candidates, groups of candidates, and the attack.
    upload: Buffer,
    /// Copy of the input on the device, which shaders read.
    pub(super) input: Buffer,
    /// Three counts for each candidate and part of a sum.
    pub(super) counts: Counts,
    /// Number of parts of each sum in the cull that was recorded last.
    pub(super) sums: u32,
    /// Number of candidates of the cull that was recorded last.
    pub(super) candidates: u32,
    pub(super) set: vk::DescriptorSet,
}

impl Slot {
    /// Fills a default slot. After a failure, [`Slot::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let mut buffer = |what: &str, usage, memory| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size: capacity.offsets().end,
                usage,
                memory,
            };
            device.buffer(desc)
        };
        self.upload = buffer("upload", Usage::TRANSFER_SRC, MemoryUse::Upload)?;
        let usage = Usage::STORAGE_BUFFER | Usage::UNIFORM_BUFFER | Usage::TRANSFER_DST;
        self.input = buffer("input", usage, MemoryUse::Device)?;
        let name = format!("{name}: counts");
        self.counts = Counts::new(device, &name, capacity.counts(), Usage::STORAGE_BUFFER)?;
        Ok(())
    }

    /// Size of a slot's buffers, in bytes.
    pub(super) fn bytes(capacity: &Capacity) -> u64 {
        2 * capacity.offsets().end + HEADER + 4 * capacity.counts()
    }

    /// Writes a cull's input. The device must no longer use the slot.
    pub(super) fn write(
        &self,
        context: &Context,
        gathered: &Gathered,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        for (offset, part) in parts(gathered, capacity) {
            self.upload.write(context, offset, part)?;
        }
        Ok(())
    }

    /// Records the copy of the input to the device.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering, and the slot is free.
    pub(super) unsafe fn record_copy(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        gathered: &Gathered,
        capacity: &Capacity,
    ) {
        let copies = parts(gathered, capacity).map(|(offset, part)| {
            vk::BufferCopy::default()
                .src_offset(offset)
                .dst_offset(offset)
                .size(part.len() as u64)
        });
        let device = context.device();
        // SAFETY: the caller vouches for the command buffer; both buffers hold this many bytes.
        unsafe { device.cmd_copy_buffer(cmd, self.upload.handle, self.input.handle, &copies) };
    }

    /// Frees the buffers. The device must no longer use them. The descriptor set is freed with its pool.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.counts.destroy(context, memory);
        self.input.destroy(context, memory);
        self.upload.destroy(context, memory);
    }
}

/// Parts of an input with their offsets, in bytes. None is empty if there are candidates and blocks.
fn parts<'a>(gathered: &'a Gathered, capacity: &Capacity) -> [(u64, &'a [u8]); 3] {
    let offsets = capacity.offsets();
    [
        (0, bytemuck::cast_slice(&gathered.candidates)),
        (offsets.groups, bytemuck::cast_slice(&gathered.groups)),
        (offsets.chunks, bytemuck::cast_slice(&gathered.blocks.words)),
    ]
}
