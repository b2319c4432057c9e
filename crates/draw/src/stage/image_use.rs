//! Images from one use to the next, and their way to the host.

use ash::vk;

use sabaki::gpu::Context;

/// Where, how, and in which layout an image is used.
pub type Use = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// As the source of a copy.
pub const COPIED: Use = (
    vk::PipelineStageFlags2::COPY,
    vk::AccessFlags2::TRANSFER_READ,
    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
);

/// As a colour attachment.
pub const DRAWN: Use = (
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
);

/// Takes an image, which has one level and layer, from one use to the next.
///
/// # Safety
/// `cmd` is being recorded, outside of rendering, for the context's device; the image is of that device, and used as `before` says.
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

/// Copies all pixels of a colour image, which is [`COPIED`], for the host to read.
///
/// # Safety
/// As for [`turn`]; the buffer has room for four bytes of each pixel.
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
