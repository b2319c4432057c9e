//! Image layout transitions.

use ash::vk;

use sabaki::gpu::Context;

/// A use of an image.
#[derive(Clone, Copy)]
pub(crate) struct ImageUse {
    /// Pipeline stages that use it.
    pub(crate) stages: vk::PipelineStageFlags2,
    /// Access of these stages to the image.
    pub(crate) access: vk::AccessFlags2,
    /// Layout that the access needs.
    pub(crate) layout: vk::ImageLayout,
}

impl ImageUse {
    /// The same use of an image whose contents are no longer needed.
    pub(crate) fn discarded(self) -> Self {
        Self {
            layout: vk::ImageLayout::UNDEFINED,
            ..self
        }
    }
}

/// Source of a copy.
pub(crate) const COPIED: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::COPY,
    access: vk::AccessFlags2::TRANSFER_READ,
    layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
};

/// Colour attachment.
pub(crate) const DRAWN: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    access: vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
};

/// Records the transition of an image with one level and layer between two uses.
///
/// # Safety
/// `cmd` is in the recording state, outside of rendering, for the context's device. The image belongs to that device and is in the
/// state `before`; its format has `aspect`.
pub(crate) unsafe fn image_barrier(
    context: &Context,
    cmd: vk::CommandBuffer,
    (image, aspect): (vk::Image, vk::ImageAspectFlags),
    before: ImageUse,
    after: ImageUse,
) {
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
