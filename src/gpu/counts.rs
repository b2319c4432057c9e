//! The counts of a cull in memory that the host reads, with the number of that cull.
//!
//! The device makes the counts available to the host, and writes the number after that, so that the host can poll it without waiting.

use std::sync::atomic::{AtomicU32, Ordering};

use ash::vk;

use super::{
    Context, GpuError, Memory, MemoryUse,
    barriers::{self, Access},
    resources::{Buffer, BufferDesc, DeviceMemory},
};

/// Number of bytes before the counts: the number of the cull, and padding.
pub(crate) const HEADER: u64 = 8;

/// Number of the next cull of any culler. A ticket is valid for one cull.
static NEXT_SERIAL: AtomicU32 = AtomicU32::new(1);

/// The counts of one cull in flight. Default: null handles.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) buffer: Buffer,
    /// The number of the cull that was recorded last, or 0 for none.
    pub(crate) serial: u32,
}

impl Counts {
    /// Creates the buffer for a number of counts, each one word. `usage` is that by the commands that write them, besides copies and fills.
    /// Frees the buffer if a later step fails.
    pub(crate) fn new(
        device: &mut DeviceMemory<'_>,
        name: &str,
        words: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, GpuError> {
        let buffer = device.buffer(BufferDesc {
            name,
            size: HEADER + 4 * words,
            usage: usage | vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        })?;
        let mut counts = Self { buffer, serial: 0 };
        // The memory may hold the number of an earlier cull. No cull has the number 0.
        let cleared = counts
            .buffer
            .write(device.context, 0, &[0; HEADER as usize]);
        if let Err(error) = cleared {
            counts.destroy(device.context, device.memory);
            return Err(error);
        }
        Ok(counts)
    }

    /// Assigns a new number to the cull that is recorded now. It is never 0.
    pub(crate) fn start(&mut self) {
        let next = || NEXT_SERIAL.fetch_add(1, Ordering::Relaxed);
        self.serial = match next() {
            0 => next(),
            serial => serial,
        };
    }

    /// The first words of a cull's counts, or `None` while the device has not finished. Never waits.
    pub(crate) fn read(
        &self,
        context: &Context,
        serial: u32,
        words: usize,
    ) -> Result<Option<impl Iterator<Item = u32> + Clone>, GpuError> {
        if serial != self.serial {
            return Err(GpuError::StaleTicket);
        }
        self.buffer.invalidate(context)?;
        if self.buffer.word(0)? != serial {
            return Ok(None);
        }
        // Cached counts may be older than the number.
        self.buffer.invalidate(context)?;
        // SAFETY: the number has come, so the counts are written, and nothing writes them until they are recorded anew.
        let bytes = unsafe { self.buffer.bytes(HEADER + 4 * words as u64) }?;
        let word = |word: &[u8]| u32::from_ne_bytes([word[0], word[1], word[2], word[3]]);
        Ok(Some(bytes[HEADER as usize..].chunks_exact(4).map(word)))
    }

    /// Frees the buffer. The device must no longer use it.
    pub(crate) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.buffer.destroy(context, memory);
    }
}

/// Records the numbers of some culls, after their counts, which `writer` writes.
///
/// # Safety
/// `cmd` is being recorded outside of rendering, for a queue of the context's family.
pub(crate) unsafe fn record_numbers<'a>(
    context: &Context,
    cmd: vk::CommandBuffer,
    writer: Access,
    counts: impl Iterator<Item = &'a Counts>,
) {
    let number = Access::TRANSFER_WRITE;
    // SAFETY: the caller vouches for `cmd`; the buffers have a header.
    unsafe {
        context.begin_label(cmd, c"sabaki: counts to the host");
        // The counts reach the host's memory domain before the fill runs: no number overtakes its counts.
        barriers::memory(context, cmd, writer, number.and(Access::HOST_READ));
        for one in counts {
            let (device, buffer) = (context.device(), one.buffer.handle);
            device.cmd_fill_buffer(cmd, buffer, 0, 4, one.serial);
        }
        barriers::memory(context, cmd, writer.and(number), Access::HOST_READ);
        context.end_label(cmd);
    }
}
