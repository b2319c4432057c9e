//! An image to draw into if there is no window, with access to its pixels.

use ash::vk;

use super::Target;
use super::stage::check_side;
use super::stage::drawing::{COPIED, DRAWN, ImageUse, image_barrier};
use sabaki::gpu::internal::{Buffer, BufferDesc, DeviceMemory, Image, ImageDesc};
use sabaki::gpu::{Context, GpuError, Memory, MemoryUse};

/// A render target whose pixels the host can read.
#[derive(Debug)]
pub struct Offscreen {
    context: Context,
    image: Image,
    pixels: Buffer,
    live: bool,
}

impl Offscreen {
    /// Format of the image: red, green, blue (sRGB) and alpha, one byte each.
    pub const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

    /// Creates an image of `size` pixels; a side of 0 counts as 1. On failure, all resources are freed.
    ///
    /// # Errors
    /// An error of a Vulkan call or of the allocator; [`GpuError::Limit`] if the device does not support such a large image.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        use vk::ImageUsageFlags as Usage;
        let size = size.map(|side| side.max(1));
        check_side(context, size[0].max(size[1]))?;
        let desc = ImageDesc {
            name: "picture",
            side: size,
            format: Self::FORMAT,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: Usage::COLOR_ATTACHMENT | Usage::TRANSFER_SRC,
            aspect: vk::ImageAspectFlags::COLOR,
        };
        let mut device = DeviceMemory { context, memory };
        let mut image = device.image(&desc)?;
        let desc = BufferDesc {
            name: "picture's pixels",
            size: bytes(size),
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        };
        let pixels = match device.buffer(desc) {
            Ok(pixels) => pixels,
            Err(error) => {
                image.destroy(context, device.memory);
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

    /// Target for a stage, to use between [`Offscreen::record_start`] and
    /// [`Offscreen::record_end`].
    pub fn target(&self) -> Target {
        Target {
            view: self.image.view,
            size: self.image.side,
        }
    }

    /// Records the transition of the image to a colour attachment. Its contents are discarded.
    ///
    /// # Safety
    /// `cmd` is in the recording state, outside of rendering, for a queue of the context's family.
    pub unsafe fn record_start(&self, cmd: vk::CommandBuffer) {
        let copied = ImageUse {
            access: vk::AccessFlags2::NONE,
            ..COPIED.discarded()
        };
        // SAFETY: the caller vouches for `cmd`; the image is this one's.
        unsafe { image_barrier(&self.context, cmd, self.colour(), copied, DRAWN) };
    }

    /// Records the copy of the image to the buffer that [`Offscreen::pixels`] reads.
    ///
    /// # Safety
    /// As for [`Offscreen::record_start`], which must have been recorded before.
    pub unsafe fn record_end(&self, cmd: vk::CommandBuffer) {
        let [width, height] = self.image.side;
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let region = [vk::BufferImageCopy::default()
            .image_subresource(layers)
            .image_extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })];
        let read = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let info = vk::DependencyInfo::default().memory_barriers(&read);
        let device = self.context.device();
        let (image, pixels) = (self.image.handle, self.pixels.handle);
        // SAFETY: the caller vouches for `cmd`; the buffer has room for every pixel.
        unsafe {
            image_barrier(&self.context, cmd, self.colour(), DRAWN, COPIED);
            device.cmd_copy_image_to_buffer(cmd, image, COPIED.layout, pixels, &region);
            device.cmd_pipeline_barrier2(cmd, &info);
        }
    }

    fn colour(&self) -> (vk::Image, vk::ImageAspectFlags) {
        (self.image.handle, vk::ImageAspectFlags::COLOR)
    }

    /// Pixels of four bytes, row by row from the top left.
    ///
    /// # Errors
    /// The memory cannot be invalidated.
    ///
    /// # Safety
    /// The commands with [`Offscreen::record_end`] have finished.
    pub unsafe fn pixels(&self) -> Result<&[u8], GpuError> {
        self.pixels.invalidate(&self.context)?;
        // SAFETY: the caller knows that the device has written them.
        unsafe { self.pixels.bytes(bytes(self.image.side)) }
    }

    /// Frees all resources. The device must not use them any more.
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
