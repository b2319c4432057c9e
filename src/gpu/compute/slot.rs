//! Buffers of one cull in flight: its input and its counts.

use ash::vk;

use super::gathered::{Capacity, Gathered};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    counts::{Counts, CountsDesc, HEADER},
    passes::Passes,
    resources::{Buffer, BufferDesc, DeviceMemory},
};

/// Buffers and descriptor sets of one cull in flight. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Input that the host writes: candidates, groups of candidates, and the attack.
    upload: Buffer,
    /// Copy of the input on the device. Null if shaders read `upload`.
    copy: Buffer,
    /// Three counts for each candidate and part of a sum.
    pub(super) counts: Counts,
    /// Number of parts of each sum in the cull that was recorded last.
    pub(super) sums: u32,
    /// Number of candidates of the cull that was recorded last.
    pub(super) candidates: u32,
    /// Descriptor set of each page of the maps.
    pub(super) sets: Vec<vk::DescriptorSet>,
}

/// Settings of a [`Slot`].
pub(super) struct SlotDesc<'a> {
    /// Prefix of the names of its buffers.
    pub(super) name: &'a str,
    pub(super) capacity: &'a Capacity,
    /// Whether shaders read the buffer that the host writes, without a copy.
    pub(super) direct_input: bool,
}

impl Slot {
    /// Fills a default slot. After a failure, [`Slot::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &SlotDesc<'_>,
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let SlotDesc {
            name,
            capacity,
            direct_input,
        } = *desc;
        let size = capacity.offsets().end;
        let mut buffer = |what: &str, usage, who| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage,
                memory: who,
            };
            device.buffer(desc)
        };
        let usage = Usage::STORAGE_BUFFER | Usage::UNIFORM_BUFFER;
        if direct_input {
            self.upload = buffer("input", usage, MemoryUse::Upload)?;
        } else {
            self.upload = buffer("upload", Usage::TRANSFER_SRC, MemoryUse::Upload)?;
            let usage = usage | Usage::TRANSFER_DST;
            self.copy = buffer("input", usage, MemoryUse::Device)?;
        }
        let counts = CountsDesc {
            name: &format!("{name}: counts"),
            words: capacity.counts(),
            usage: Usage::STORAGE_BUFFER,
        };
        self.counts = Counts::new(device, &counts)?;
        Ok(())
    }

    /// Size of a slot's buffers, in bytes.
    pub(super) fn bytes(capacity: &Capacity, direct_input: bool) -> u64 {
        let inputs = if direct_input { 1 } else { 2 };
        inputs * capacity.offsets().end + HEADER + 4 * capacity.counts()
    }

    /// The buffer that shaders read.
    pub(super) fn input(&self) -> vk::Buffer {
        if self.is_direct() {
            self.upload.handle
        } else {
            self.copy.handle
        }
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

    /// Records the copy of the input to the buffer that shaders read. Returns whether there is one.
    ///
    /// # Safety
    /// The passes are being recorded outside of rendering, and the slot is free.
    pub(super) unsafe fn record_copy(
        &self,
        passes: &Passes<'_>,
        gathered: &Gathered,
        capacity: &Capacity,
    ) -> bool {
        if self.is_direct() {
            return false;
        }
        let copies = parts(gathered, capacity).map(|(offset, part)| {
            vk::BufferCopy::default()
                .src_offset(offset)
                .dst_offset(offset)
                .size(part.len() as u64)
        });
        let (device, cmd) = (passes.context.device(), passes.cmd);
        // SAFETY: the caller vouches for the command buffer; both buffers hold this many bytes.
        unsafe { device.cmd_copy_buffer(cmd, self.upload.handle, self.copy.handle, &copies) };
        true
    }

    fn is_direct(&self) -> bool {
        self.copy.handle == vk::Buffer::null()
    }

    /// Frees the buffers. The device must no longer use them. The descriptor sets are freed with their pool.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.counts.destroy(context, memory);
        self.copy.destroy(context, memory);
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
