//! What one cull in flight needs for itself: its input and its counts.

use ash::vk;

use super::gathered::{Capacity, Gathered};
use crate::gpu::{
    Context, GpuError, InputWay, Memory, MemoryUse,
    counts::{Counts, HEADER},
    resources::{Buffer, BufferDesc},
};

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Candidates, groups of them, then the attack, as the host writes them.
    upload: Buffer,
    /// The same on the device; null where shaders read what the host has written.
    copy: Buffer,
    /// Three for each part of a sum and candidate.
    pub(super) counts: Counts,
    /// Parts of a sum in the cull that was recorded last.
    pub(super) sums: u32,
    /// Candidates of that cull.
    pub(super) candidates: u32,
    /// By page of the maps.
    pub(super) sets: Vec<vk::DescriptorSet>,
}

impl Slot {
    /// Fills a default slot. After a failure [`Slot::destroy`] frees what there is.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        memory: &mut dyn Memory,
        name: &str,
        (capacity, way): (&Capacity, InputWay),
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let size = capacity.offsets().end;
        let mut buffer = |what: &str, usage, who| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage,
                memory: who,
            };
            Buffer::new(context, memory, desc)
        };
        let usage = Usage::STORAGE_BUFFER | Usage::UNIFORM_BUFFER;
        match way {
            InputWay::Staged => {
                self.upload = buffer("upload", Usage::TRANSFER_SRC, MemoryUse::Upload)?;
                let usage = usage | Usage::TRANSFER_DST;
                self.copy = buffer("input", usage, MemoryUse::Device)?;
            }
            InputWay::Direct => {
                self.upload = buffer("input", usage, MemoryUse::Upload)?;
            }
        }
        let counts = (&*format!("{name}: counts"), capacity.counts());
        self.counts = Counts::new(context, memory, counts, Usage::STORAGE_BUFFER)?;
        Ok(())
    }

    /// Bytes of a slot's buffers.
    pub(super) fn bytes(capacity: &Capacity, way: InputWay) -> u64 {
        let inputs = match way {
            InputWay::Staged => 2,
            InputWay::Direct => 1,
        };
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

    /// Writes a cull's input; no device uses it any more.
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

    /// Records the input's way to where shaders read it, and says whether there is one.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering, and the slot is free.
    pub(super) unsafe fn record_copy(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        (gathered, capacity): (&Gathered, &Capacity),
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
        // SAFETY: the caller vouches for `cmd`; both buffers hold this many bytes.
        unsafe {
            let device = context.device();
            device.cmd_copy_buffer(cmd, self.upload.handle, self.copy.handle, &copies);
        }
        true
    }

    fn is_direct(&self) -> bool {
        self.copy.handle == vk::Buffer::null()
    }

    /// Frees everything; the device must be done with it. The descriptor sets go with their pool.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.counts.destroy(context, memory);
        self.copy.destroy(context, memory);
        self.upload.destroy(context, memory);
    }
}

/// Where the parts of an input go. None is empty where there are candidates and blocks.
fn parts<'a>(gathered: &'a Gathered, capacity: &Capacity) -> [(u64, &'a [u8]); 3] {
    let offsets = capacity.offsets();
    [
        (0, bytemuck::cast_slice(&gathered.candidates)),
        (offsets.groups, bytemuck::cast_slice(&gathered.groups)),
        (offsets.chunks, bytemuck::cast_slice(&gathered.blocks.words)),
    ]
}
