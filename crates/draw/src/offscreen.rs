//! An image to draw into where there is no window, and its pixels.

use ash::vk;

use super::Target;
use super::stage::image_use::{COPIED, DRAWN, copy_to_host, turn};
use sabaki::gpu::internal::{Buffer, BufferDesc};
use sabaki::gpu::internal::{Image, ImageDesc};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};

/// A target with a way to read it.
#[derive(Debug)]
pub struct Offscreen {
    context: Context,
    image: Image,
    pixels: Buffer,
    live: bool,
}

impl Offscreen {
    /// Of the images: four bytes a pixel, red, green, blue (sRGB) and alpha.
    pub const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

    /// Makes the image. Leaves nothing behind when it fails.
    ///
    /// # Errors
    /// A Vulkan call's, or the allocator's.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        use vk::ImageUsageFlags as Usage;
        let desc = ImageDesc {
            name: "picture",
            side: size,
            format: Self::FORMAT,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: Usage::COLOR_ATTACHMENT | Usage::TRANSFER_SRC,
            aspect: vk::ImageAspectFlags::COLOR,
        };
        let mut image = Image::new(context, memory, &desc)?;
        let desc = BufferDesc {
            name: "picture's pixels",
            size: bytes(size),
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        };
        let pixels = match Buffer::new(context, memory, desc) {
            Ok(pixels) => pixels,
            Err(error) => {
                image.destroy(context, memory);
                return Err(error);
            }
        };
        Ok(Self {
            context: context.clone(),
            image,
            pixels,
            live: true,
        })
    }

    /// What a stage draws into between [`Offscreen::record_start`] and [`Offscreen::record_end`].
    #[must_use]
    pub fn target(&self) -> Target {
        Target {
            view: self.image.view,
            size: self.image.side,
        }
    }

    /// Makes the image one to draw into; what it held is gone.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family.
    pub unsafe fn record_start(&self, cmd: vk::CommandBuffer) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stages};
        let copied = (Stages::COPY, Access::NONE, Layout::UNDEFINED);
        let colour = (self.image.handle, vk::ImageAspectFlags::COLOR);
        // SAFETY: the caller vouches for `cmd`; the image is this one's.
        unsafe { turn(&self.context, cmd, colour, (copied, DRAWN)) };
    }

    /// Copies the image to where [`Offscreen::pixels`] reads it.
    ///
    /// # Safety
    /// As for [`Offscreen::record_start`], which comes before it.
    pub unsafe fn record_end(&self, cmd: vk::CommandBuffer) {
        let (image, buffer) = (self.image.handle, self.pixels.handle);
        let colour = (image, vk::ImageAspectFlags::COLOR);
        // SAFETY: the caller vouches for `cmd`; the buffer has room for every pixel.
        unsafe {
            turn(&self.context, cmd, colour, (DRAWN, COPIED));
            copy_to_host(&self.context, cmd, (image, self.image.side), buffer);
        }
    }

    /// Four bytes of each pixel, row by row from the upper left.
    ///
    /// # Errors
    /// An invalidate that failed.
    ///
    /// # Safety
    /// The commands with [`Offscreen::record_end`] have finished.
    pub unsafe fn pixels(&self) -> Result<&[u8], GpuError> {
        self.pixels.invalidate(&self.context)?;
        // SAFETY: the caller knows that the device has written them.
        unsafe { self.pixels.bytes(bytes(self.image.side)) }
    }

    /// Frees everything. The device must be done with it.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.image.destroy(&self.context, memory);
        self.pixels.destroy(&self.context, memory);
        self.live = false;
    }
}

impl Drop for Offscreen {
    fn drop(&mut self) {
        if self.live {
            tracing::error!("an Offscreen was dropped without destroy: its Vulkan objects leak");
        }
    }
}

fn bytes([width, height]: [u32; 2]) -> u64 {
    4 * u64::from(width) * u64::from(height)
}
