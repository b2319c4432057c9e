//! Reads the pixels of a window's image back.

use ash::vk;

use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};
use sabaki_draw::internal::{HostCopy, copy_to_host};

/// A buffer that an image is copied to.
pub(super) struct Capture {
    pixels: Buffer,
    size: [u32; 2],
    /// Pixels are stored as blue, green, red.
    swapped: bool,
}

impl Capture {
    pub(super) fn new(
        device: &mut DeviceMemory<'_>,
        size: [u32; 2],
        format: vk::Format,
    ) -> Result<Self, GpuError> {
        let desc = BufferDesc {
            name: "screenshot",
            size: 4 * u64::from(size[0]) * u64::from(size[1]),
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        };
        Ok(Self {
            pixels: device.buffer(desc)?,
            size,
            swapped: matches!(
                format,
                vk::Format::B8G8R8A8_SRGB | vk::Format::B8G8R8A8_UNORM
            ),
        })
    }

    /// Records the copy of an image, whose layout is that of a transfer source.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering; the image is of the size and format of [`Capture::new`].
    pub(super) unsafe fn record(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        image: vk::Image,
    ) {
        // SAFETY: the caller vouches for `cmd` and the image; the buffer has room for every pixel.
        unsafe {
            let copy = HostCopy {
                image,
                size: self.size,
                buffer: self.pixels.handle,
            };
            copy_to_host(context, cmd, copy);
        }
    }

    /// Returns red, green and blue of each pixel, row by row from the upper left, and frees the buffer.
    ///
    /// # Safety
    /// The commands have finished.
    pub(super) unsafe fn take(
        mut self,
        context: &Context,
        memory: &mut dyn Memory,
    ) -> Result<Vec<u8>, GpuError> {
        let order = match self.swapped {
            true => [2, 1, 0],
            false => [0, 1, 2],
        };
        let count = 4 * u64::from(self.size[0]) * u64::from(self.size[1]);
        let read = self.pixels.invalidate(context);
        // SAFETY: the caller knows that the device has written them.
        let taken = read.and_then(|()| unsafe { self.pixels.bytes(count) });
        let taken = taken.map(|bytes| {
            let pixels = bytes.chunks_exact(4);
            pixels
                .flat_map(|pixel| order.map(|channel| pixel[channel]))
                .collect()
        });
        self.pixels.destroy(context, memory);
        taken
    }

    /// Frees the buffer unread; nothing was submitted.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.pixels.destroy(context, memory);
    }
}
