//! Image layout transitions, and the copy of an image to the host.

use ash::vk;

use sabaki::gpu::Context;

/// Pipeline stage, access and layout of an image.
pub type Use = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// Source of a copy.
pub const COPIED: Use = (
    vk::PipelineStageFlags2::COPY,
    vk::AccessFlags2::TRANSFER_READ,
    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
);

/// Colour attachment.
pub const DRAWN: Use = (
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
);

/// Records the transition of an image with one level and layer between two uses.
///
/// # Safety
/// `cmd` is in the recording state, outside of rendering, for the context's device. The image
/// belongs to that device and is in the state `before`.
pub unsafe fn turn(
    context: &Context,
    cmd: vk::CommandBuffer,
    (image, aspect): (vk::Image, vk::ImageAspectFlags),
    (before, after): (Use, Use),
) {
    let range = vk::ImageSubresourceRange::default()
        .aspect_mask(aspect)
        .level_count(1)
        .layer_count(1);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.0)
        .src_access_mask(before.1)
        .old_layout(before.2)
        .dst_stage_mask(after.0)
        .dst_access_mask(after.1)
        .new_layout(after.2)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(range)];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: the caller vouches for `cmd` and the image.
    unsafe { context.device().cmd_pipeline_barrier2(cmd, &info) };
}

/// Records the copy of all pixels of a colour image in the state [`COPIED`] to a host-visible
/// buffer.
///
/// # Safety
/// As for [`turn`]. The buffer has space for four bytes for each pixel.
pub unsafe fn copy_to_host(
    context: &Context,
    cmd: vk::CommandBuffer,
    (image, [width, height]): (vk::Image, [u32; 2]),
    buffer: vk::Buffer,
) {
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
        device.cmd_copy_image_to_buffer(cmd, image, COPIED.2, buffer, &region);
        device.cmd_pipeline_barrier2(cmd, &info);
    }
}
