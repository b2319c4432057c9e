//! Counts on their way from the device to the host, with the number of the cull that they belong to.
//!
//! The device writes the number after the counts, so that the host can look for it without waiting.

use std::sync::atomic::{AtomicU32, Ordering};

use ash::vk;

use super::{
    Context, GpuError, Memory, MemoryUse, Mismatch,
    barriers::{self, Access},
    passes::Passes,
    resources::{Buffer, BufferDesc},
};

/// Bytes before the counts: the number, and padding.
pub(crate) const HEADER: u64 = 8;

/// Of the next cull, whichever culler's: a ticket fits one cull alone.
static NEXT_SERIAL: AtomicU32 = AtomicU32::new(1);

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) buffer: Buffer,
    /// The number of the cull that was recorded last; 0 for none.
    pub(crate) serial: u32,
}

impl Counts {
    /// Makes room for so many words, written by copies, fills, and `usage`.
    pub(crate) fn new(
        context: &Context,
        memory: &mut dyn Memory,
        (name, words): (&str, u64),
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, GpuError> {
        let desc = BufferDesc {
            name,
            size: HEADER + 4 * words,
            usage: usage | vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        };
        let mut counts = Self {
            buffer: Buffer::new(context, memory, desc)?,
            serial: 0,
        };
        // No cull has the number 0, and memory may hold anything.
        let cleared = counts.buffer.write(context, 0, &[0; HEADER as usize]);
        if let Err(error) = cleared {
            counts.destroy(context, memory);
            return Err(error);
        }
        Ok(counts)
    }

    /// Takes a new number, for the cull that is recorded now.
    pub(crate) fn start(&mut self) -> u32 {
        self.serial = next_serial();
        self.serial
    }

    /// The first words of a cull's counts, once they are there. Never waits.
    pub(crate) fn read(
        &self,
        context: &Context,
        serial: u32,
        words: usize,
    ) -> Result<Option<impl Iterator<Item = u32> + Clone>, GpuError> {
        if serial != self.serial {
            return Err(Mismatch::Ticket.into());
        }
        self.buffer.invalidate(context)?;
        if self.buffer.word(0)? != serial {
            return Ok(None);
        }
        // What was cached of the counts may be older than their number.
        self.buffer.invalidate(context)?;
        // SAFETY: the number has come, so the counts are written, and nothing writes them until they are recorded anew.
        let bytes = unsafe { self.buffer.bytes(HEADER + 4 * words as u64) }?;
        let word = |word: &[u8]| u32::from_ne_bytes([word[0], word[1], word[2], word[3]]);
        Ok(Some(bytes[HEADER as usize..].chunks_exact(4).map(word)))
    }

    /// Frees everything; the device must be done with it.
    pub(crate) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.buffer.destroy(context, memory);
    }
}

/// Records that some culls' counts, which `writer` writes, are there.
///
/// # Safety
/// `cmd` is being recorded outside of rendering, for a queue of the context's family.
pub(crate) unsafe fn record_numbers<'a>(
    passes: &mut Passes<'_>,
    writer: Access,
    counts: impl Iterator<Item = &'a Counts>,
) {
    let (context, cmd, number) = (passes.context, passes.cmd, Access::TRANSFER_WRITE);
    // SAFETY: the caller vouches for `cmd`; the buffers have a header.
    unsafe {
        passes.begin(c"sabaki: counts to the host");
        barriers::memory(context, cmd, writer, number);
        for one in counts {
            let (device, buffer) = (context.device(), one.buffer.handle);
            device.cmd_fill_buffer(cmd, buffer, 0, 4, one.serial);
        }
        barriers::memory(context, cmd, writer.and(number), Access::HOST_READ);
        passes.end();
    }
}

/// Never 0, which means none.
fn next_serial() -> u32 {
    loop {
        let serial = NEXT_SERIAL.fetch_add(1, Ordering::Relaxed);
        if serial != 0 {
            return serial;
        }
    }
}
