//! Uses of a window's image in the course of a frame, and the rendering of panels over it.

use ash::vk;

use sabaki::gpu::Context;
use sabaki_draw::Target;
use sabaki_draw::internal::ImageUse;

const OUTPUT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;

/// The image was acquired. It has no contents.
pub(super) const ACQUIRED: ImageUse = ImageUse {
    stages: OUTPUT,
    access: vk::AccessFlags2::NONE,
    layout: vk::ImageLayout::UNDEFINED,
};
/// Panels are drawn over the picture.
pub(super) const BLENDED: ImageUse = ImageUse {
    stages: OUTPUT,
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
            | vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw(),
    ),
    layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
};
/// The window shows the image.
pub(super) const PRESENTED: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::BOTTOM_OF_PIPE,
    access: vk::AccessFlags2::NONE,
    layout: vk::ImageLayout::PRESENT_SRC_KHR,
};

/// Begins the rendering of panels.
///
/// # Safety
/// `cmd` is being recorded, outside of rendering; the target is a colour attachment.
pub(super) unsafe fn begin_panels(context: &Context, cmd: vk::CommandBuffer, target: &Target) {
    let [width, height] = target.size;
    let colours = [vk::RenderingAttachmentInfo::default()
        .image_view(target.view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::LOAD)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let info = vk::RenderingInfo::default()
        .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }))
        .layer_count(1)
        .color_attachments(&colours);
    // SAFETY: the caller vouches for `cmd` and the target.
    unsafe { context.device().cmd_begin_rendering(cmd, &info) };
}
