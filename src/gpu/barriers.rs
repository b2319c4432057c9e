//! Barriers between named accesses. They are those of Vulkan 1.0, which every device has.

use ash::vk;

use super::Context;

/// Use of a resource before or after a barrier.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Access {
    stage: vk::PipelineStageFlags,
    access: vk::AccessFlags,
    layout: vk::ImageLayout,
}

impl Access {
    /// Use of a buffer.
    const fn new(stage: vk::PipelineStageFlags, access: vk::AccessFlags) -> Self {
        Self {
            stage,
            access,
            layout: vk::ImageLayout::UNDEFINED,
        }
    }

    /// The union of two uses of a buffer.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            stage: self.stage | other.stage,
            access: self.access | other.access,
            layout: self.layout,
        }
    }

    /// Both fragment test stages: a stencil buffer's clears, tests, operations and stores.
    pub(crate) const STENCIL: Self = Self {
        stage: vk::PipelineStageFlags::from_raw(
            vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS.as_raw()
                | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS.as_raw(),
        ),
        access: vk::AccessFlags::from_raw(
            vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
                | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
        ),
        layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    };
    /// Reads by a copy from an image.
    pub(crate) const COPY_READ: Self = Self {
        stage: vk::PipelineStageFlags::TRANSFER,
        access: vk::AccessFlags::TRANSFER_READ,
        layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    };
    /// Reads of instances by the vertex stage.
    pub(crate) const VERTEX_READ: Self = Self::new(
        vk::PipelineStageFlags::VERTEX_INPUT,
        vk::AccessFlags::VERTEX_ATTRIBUTE_READ,
    );
    /// Writes by copies, updates, fills and copies of query results.
    pub(crate) const TRANSFER_WRITE: Self = Self::new(
        vk::PipelineStageFlags::TRANSFER,
        vk::AccessFlags::TRANSFER_WRITE,
    );
    /// Reads of storage buffers by fragment shaders.
    pub(crate) const SHADER_READ: Self = Self::new(
        vk::PipelineStageFlags::FRAGMENT_SHADER,
        vk::AccessFlags::SHADER_READ,
    );
    /// Reads of storage and uniform buffers by compute shaders.
    pub(crate) const COMPUTE_READ: Self = Self::new(
        vk::PipelineStageFlags::COMPUTE_SHADER,
        vk::AccessFlags::from_raw(
            vk::AccessFlags::SHADER_READ.as_raw() | vk::AccessFlags::UNIFORM_READ.as_raw(),
        ),
    );
    /// Writes to storage buffers by compute shaders.
    pub(crate) const COMPUTE_WRITE: Self = Self::new(
        vk::PipelineStageFlags::COMPUTE_SHADER,
        vk::AccessFlags::SHADER_WRITE,
    );
    /// Reads by the host after it has seen that the commands have finished.
    pub(crate) const HOST_READ: Self =
        Self::new(vk::PipelineStageFlags::HOST, vk::AccessFlags::HOST_READ);
}

/// Records a memory barrier. It makes what the access `before` it wrote visible to the access `after` it.
///
/// # Safety
/// `cmd` is being recorded, outside of rendering, for a queue of the context's family.
pub(crate) unsafe fn memory(
    context: &Context,
    cmd: vk::CommandBuffer,
    before: Access,
    after: Access,
) {
    let barrier = [vk::MemoryBarrier::default()
        .src_access_mask(before.access)
        .dst_access_mask(after.access)];
    let (from, to, flags) = (before.stage, after.stage, vk::DependencyFlags::empty());
    // SAFETY: the caller vouches for `cmd`.
    unsafe {
        let device = context.device();
        device.cmd_pipeline_barrier(cmd, from, to, flags, &barrier, &[], &[]);
    }
}

/// Records the transition of a whole stencil image between two uses. `discards`: whether the contents are no longer needed.
///
/// # Safety
/// As for [`memory`]; the image is of the context's stencil format and, unless its contents are discarded, in the layout of `before`.
pub(crate) unsafe fn stencil_image(
    context: &Context,
    cmd: vk::CommandBuffer,
    image: vk::Image,
    before: Access,
    after: Access,
    discards: bool,
) {
    let old_layout = match discards {
        true => vk::ImageLayout::UNDEFINED,
        false => before.layout,
    };
    let barrier = [vk::ImageMemoryBarrier::default()
        .src_access_mask(before.access)
        .dst_access_mask(after.access)
        .old_layout(old_layout)
        .new_layout(after.layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(whole(context.stencil_format()))];
    let (from, to, flags) = (before.stage, after.stage, vk::DependencyFlags::empty());
    // SAFETY: the caller vouches for `cmd` and `image`.
    unsafe {
        let device = context.device();
        device.cmd_pipeline_barrier(cmd, from, to, flags, &[], &[], &barrier);
    }
}

/// The whole range of an image of a stencil format. Formats with depth change layout as a whole.
pub(crate) fn whole(format: vk::Format) -> vk::ImageSubresourceRange {
    let aspects = if format == vk::Format::S8_UINT {
        vk::ImageAspectFlags::STENCIL
    } else {
        vk::ImageAspectFlags::STENCIL | vk::ImageAspectFlags::DEPTH
    };
    vk::ImageSubresourceRange::default()
        .aspect_mask(aspects)
        .level_count(1)
        .layer_count(1)
}
