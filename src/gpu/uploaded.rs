//! A buffer that is filled once: by the host if its memory is mapped, otherwise from a staging buffer.

use std::sync::atomic::AtomicBool;

use ash::vk;

use super::{
    Context, GpuError, Memory, MemoryUse,
    barriers::{self, Access},
    resources::{Buffer, BufferDesc, DeviceMemory},
};

/// State of the upload of a culler's maps.
#[derive(Debug, Default)]
pub(crate) struct Upload {
    pub(crate) recorded: bool,
    /// Whether the host has seen the end of an upload. Until then every cull records the upload, because earlier culls may never have been
    /// submitted.
    pub(crate) done: AtomicBool,
}

/// A buffer that is filled once. Default: null handles, which need not be destroyed.
#[derive(Debug, Default)]
pub(crate) struct Uploaded {
    pub(crate) buffer: Buffer,
    staging: Buffer,
    /// Number of bytes that are copied from the staging buffer.
    copied: u64,
}

impl Uploaded {
    /// Fills a default buffer with `count` words, which `write` writes to memory that may be slow to read and shaders read from a storage
    /// buffer. After a failure, [`Uploaded::destroy`] frees what was created.
    pub(crate) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        count: usize,
        write: impl FnOnce(&mut [u32]) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let size = 4 * count as u64;
        let mut buffer = |name: &str, usage, memory| {
            let desc = BufferDesc {
                name,
                size,
                usage,
                memory,
            };
            device.buffer(desc)
        };
        let usage = Usage::STORAGE_BUFFER | Usage::TRANSFER_DST;
        self.buffer = buffer(name, usage, MemoryUse::Device)?;
        let target = match self.buffer.is_mapped() {
            true => &mut self.buffer,
            false => {
                self.copied = size;
                let staging = format!("{name}, staging");
                self.staging = buffer(&staging, Usage::TRANSFER_SRC, MemoryUse::Upload)?;
                &mut self.staging
            }
        };
        // SAFETY: the buffer is new, and no command uses it yet.
        let bytes = unsafe { target.bytes_mut() }?;
        write(bytemuck::cast_slice_mut(&mut bytes[..size as usize]))?;
        target.flush(device.context)
    }

    /// Records the copy from the staging buffer, and the barrier that makes it visible to `reader`.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering; the staging buffer has not been released.
    pub(crate) unsafe fn record(&self, context: &Context, cmd: vk::CommandBuffer, reader: Access) {
        if self.copied == 0 {
            return;
        }
        let copy = [vk::BufferCopy::default().size(self.copied)];
        let (from, to) = (self.staging.handle, self.buffer.handle);
        // SAFETY: the caller vouches for `cmd` and staging; both buffers have this size.
        unsafe {
            // The copy may be recorded again, after culls that read the same words.
            let before = reader.and(Access::TRANSFER_WRITE);
            barriers::memory(context, cmd, before, Access::TRANSFER_WRITE);
            context.device().cmd_copy_buffer(cmd, from, to, &copy);
            barriers::memory(context, cmd, Access::TRANSFER_WRITE, reader);
        }
    }

    /// Frees the staging buffer. The device must have finished the copy.
    pub(crate) fn release_staging(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.staging.destroy(context, memory);
    }

    /// Frees the buffers. The device must no longer use them.
    pub(crate) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.staging.destroy(context, memory);
        self.buffer.destroy(context, memory);
    }
}
