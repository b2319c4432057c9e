//! Barriers, named by what they are for: those of synchronization2 where it is enabled, otherwise those of Vulkan 1.0.

use ash::vk;

use super::Context;

/// What a resource was, or will be, used for.
#[derive(Clone, Copy)]
pub(crate) struct Access {
    stage: vk::PipelineStageFlags2,
    access: vk::AccessFlags2,
    layout: vk::ImageLayout,
}

impl Access {
    const fn new(
        stage: vk::PipelineStageFlags2,
        access: vk::AccessFlags2,
        layout: vk::ImageLayout,
    ) -> Self {
        Self {
            stage,
            access,
            layout,
        }
    }

    /// Both uses, of a buffer.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            stage: self.stage | other.stage,
            access: self.access | other.access,
            layout: self.layout,
        }
    }

    /// The stages as Vulkan 1.0 has them: what synchronization2 divides is one stage there.
    fn old_stage(self) -> vk::PipelineStageFlags {
        let copies = self.stage.contains(vk::PipelineStageFlags2::COPY);
        let copies = match copies {
            true => vk::PipelineStageFlags::TRANSFER,
            false => vk::PipelineStageFlags::empty(),
        };
        vk::PipelineStageFlags::from_raw(self.stage.as_raw() as u32) | copies
    }

    /// The accesses as Vulkan 1.0 has them.
    fn old_access(self) -> vk::AccessFlags {
        let divided = [
            (
                vk::AccessFlags2::SHADER_STORAGE_READ,
                vk::AccessFlags::SHADER_READ,
            ),
            (
                vk::AccessFlags2::SHADER_SAMPLED_READ,
                vk::AccessFlags::SHADER_READ,
            ),
            (
                vk::AccessFlags2::SHADER_STORAGE_WRITE,
                vk::AccessFlags::SHADER_WRITE,
            ),
        ];
        let same = vk::AccessFlags::from_raw(self.access.as_raw() as u32);
        divided
            .iter()
            .fold(same, |all, &(new, old)| match self.access.contains(new) {
                true => all | old,
                false => all,
            })
    }

    /// Both fragment test stages: a stencil buffer's clears, tests, operations and stores.
    pub(crate) const STENCIL: Self = Self::new(
        vk::PipelineStageFlags2::from_raw(
            vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
                | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
        ),
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
                | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
        ),
        vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    );
    /// The source of a copy.
    pub(crate) const COPY_READ: Self = Self::new(
        vk::PipelineStageFlags2::COPY,
        vk::AccessFlags2::TRANSFER_READ,
        vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    );
    /// What copies, fills and query results wrote.
    pub(crate) const TRANSFER_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
        vk::ImageLayout::UNDEFINED,
    );
    /// Storage and texel buffers, as the shaders read them.
    pub(crate) const SHADER_READ: Self = Self::new(
        vk::PipelineStageFlags2::from_raw(
            vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
                | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw(),
        ),
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_READ.as_raw()
                | vk::AccessFlags2::SHADER_SAMPLED_READ.as_raw(),
        ),
        vk::ImageLayout::UNDEFINED,
    );
    /// The source of a copy of a buffer.
    pub(crate) const TRANSFER_READ: Self = Self::new(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_READ,
        vk::ImageLayout::UNDEFINED,
    );
    /// Storage buffers in which fragment shaders count.
    pub(crate) const FRAGMENT_COUNT: Self = Self::new(
        vk::PipelineStageFlags2::FRAGMENT_SHADER,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_READ.as_raw()
                | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw(),
        ),
        vk::ImageLayout::UNDEFINED,
    );
    /// Storage and uniform buffers, as compute shaders read them.
    pub(crate) const COMPUTE_READ: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_READ.as_raw()
                | vk::AccessFlags2::UNIFORM_READ.as_raw(),
        ),
        vk::ImageLayout::UNDEFINED,
    );
    /// What compute shaders wrote into storage buffers.
    pub(crate) const COMPUTE_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_STORAGE_WRITE,
        vk::ImageLayout::UNDEFINED,
    );
    /// The host, after it has learnt that the commands are done.
    pub(crate) const HOST_READ: Self = Self::new(
        vk::PipelineStageFlags2::HOST,
        vk::AccessFlags2::HOST_READ,
        vk::ImageLayout::UNDEFINED,
    );
}

/// Makes what `before` wrote visible to `after`.
///
/// # Safety
/// `cmd` is being recorded, outside of rendering, for a queue of the context's family.
pub(crate) unsafe fn memory(
    context: &Context,
    cmd: vk::CommandBuffer,
    before: Access,
    after: Access,
) {
    if !context.features().synchronization2 {
        let barrier = [vk::MemoryBarrier::default()
            .src_access_mask(before.old_access())
            .dst_access_mask(after.old_access())];
        let (from, to) = (before.old_stage(), after.old_stage());
        let no_flags = vk::DependencyFlags::empty();
        // SAFETY: the caller vouches for `cmd`.
        unsafe {
            let device = context.device();
            device.cmd_pipeline_barrier(cmd, from, to, no_flags, &barrier, &[], &[]);
        }
        return;
    }
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(before.stage)
        .src_access_mask(before.access)
        .dst_stage_mask(after.stage)
        .dst_access_mask(after.access)];
    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the caller vouches for `cmd`.
    unsafe { context.device().cmd_pipeline_barrier2(cmd, &info) };
}

/// A transition of a whole stencil image between two uses.
#[derive(Clone, Copy)]
pub(crate) struct StencilBarrier {
    pub(crate) image: vk::Image,
    pub(crate) before: Access,
    pub(crate) after: Access,
    /// Whether the contents are no longer needed.
    pub(crate) discards: bool,
}

impl StencilBarrier {
    /// Before the image is drawn to; `discards` as in the field.
    pub(crate) fn before_drawing(image: vk::Image, discards: bool) -> Self {
        Self {
            image,
            before: Access::STENCIL,
            after: Access::STENCIL,
            discards,
        }
    }
}

/// Records the transition of a stencil image.
///
/// # Safety
/// As for [`memory`]; the image is of the context's stencil format and, unless its contents are discarded, in the layout of `before`.
pub(crate) unsafe fn stencil_image(
    context: &Context,
    cmd: vk::CommandBuffer,
    barrier: StencilBarrier,
) {
    let StencilBarrier {
        image,
        before,
        after,
        discards,
    } = barrier;
    let old_layout = match discards {
        true => vk::ImageLayout::UNDEFINED,
        false => before.layout,
    };
    if !context.features().synchronization2 {
        let barrier = [vk::ImageMemoryBarrier::default()
            .src_access_mask(before.old_access())
            .dst_access_mask(after.old_access())
            .old_layout(old_layout)
            .new_layout(after.layout)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(whole(context.stencil_format()))];
        let (from, to) = (before.old_stage(), after.old_stage());
        let no_flags = vk::DependencyFlags::empty();
        // SAFETY: the caller vouches for `cmd` and `image`.
        unsafe {
            let device = context.device();
            device.cmd_pipeline_barrier(cmd, from, to, no_flags, &[], &[], &barrier);
        }
        return;
    }
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(before.stage)
        .src_access_mask(before.access)
        .dst_stage_mask(after.stage)
        .dst_access_mask(after.access)
        .old_layout(old_layout)
        .new_layout(after.layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(whole(context.stencil_format()))];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: the caller vouches for `cmd` and `image`.
    unsafe { context.device().cmd_pipeline_barrier2(cmd, &info) };
}

/// All of an image of one of the stencil formats. Formats with depth change layout as a whole.
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
