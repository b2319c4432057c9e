//! Image layout transitions, and the copy of an image to the host.

use ash::vk;

use sabaki::gpu::Context;

/// A use of an image.
#[derive(Clone, Copy, Debug)]
pub struct ImageUse {
    /// Pipeline stages that use it.
    pub stages: vk::PipelineStageFlags2,
    /// Access of these stages to the image.
    pub access: vk::AccessFlags2,
    /// Layout that the access needs.
    pub layout: vk::ImageLayout,
}

impl ImageUse {
    /// The same use of an image whose contents are no longer needed.
    pub fn discarded(self) -> Self {
        Self {
            layout: vk::ImageLayout::UNDEFINED,
            ..self
        }
    }
}

/// Source of a copy.
pub const COPIED: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::COPY,
    access: vk::AccessFlags2::TRANSFER_READ,
    layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
};

/// Colour attachment.
pub const DRAWN: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    access: vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
};

/// Transition of an image with one level and layer between two uses.
#[derive(Clone, Copy, Debug)]
pub struct ImageBarrier {
    /// The image.
    pub image: vk::Image,
    /// Aspect of its format.
    pub aspect: vk::ImageAspectFlags,
    /// Use before the barrier.
    pub before: ImageUse,
    /// Use after the barrier.
    pub after: ImageUse,
}

impl ImageBarrier {
    /// Transition of a colour image.
    pub fn colour(image: vk::Image, before: ImageUse, after: ImageUse) -> Self {
        Self {
            image,
            aspect: vk::ImageAspectFlags::COLOR,
            before,
            after,
        }
    }
}

/// Records a transition.
///
/// # Safety
/// `cmd` is in the recording state, outside of rendering, for the context's device. The image
/// belongs to that device and is in the state `before`.
pub unsafe fn image_barrier(context: &Context, cmd: vk::CommandBuffer, barrier: ImageBarrier) {
    let ImageBarrier {
        image,
        aspect,
        before,
        after,
    } = barrier;
    let range = vk::ImageSubresourceRange::default()
        .aspect_mask(aspect)
        .level_count(1)
        .layer_count(1);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.stages)
        .src_access_mask(before.access)
        .old_layout(before.layout)
        .dst_stage_mask(after.stages)
        .dst_access_mask(after.access)
        .new_layout(after.layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(range)];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: the caller vouches for `cmd` and the image.
    unsafe { context.device().cmd_pipeline_barrier2(cmd, &info) };
}

/// A copy of all pixels of a colour image to a host-visible buffer.
#[derive(Clone, Copy, Debug)]
pub struct HostCopy {
    /// The image, in the state [`COPIED`].
    pub image: vk::Image,
    /// Width and height of the image, in pixels.
    pub size: [u32; 2],
    /// The buffer.
    pub buffer: vk::Buffer,
}

/// Records a copy to the host.
///
/// # Safety
/// As for [`image_barrier`]. The buffer has space for four bytes for each pixel.
pub unsafe fn copy_to_host(context: &Context, cmd: vk::CommandBuffer, copy: HostCopy) {
    let HostCopy {
        image,
        size: [width, height],
        buffer,
    } = copy;
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
    let device = context.device();
    // SAFETY: the caller vouches for `cmd`, image and buffer.
    unsafe {
        device.cmd_copy_image_to_buffer(cmd, image, COPIED.layout, buffer, &region);
        device.cmd_pipeline_barrier2(cmd, &info);
    }
}
