//! Barriers between named accesses. They are recorded with `synchronization2` where it is enabled, otherwise as in Vulkan 1.0.

use ash::vk;

use super::Context;

/// Use of a resource before or after a barrier.
#[derive(Clone, Copy, Debug)]
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

    /// The union of two uses of a buffer.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            stage: self.stage | other.stage,
            access: self.access | other.access,
            layout: self.layout,
        }
    }

    /// The stages of Vulkan 1.0. Stages that only `synchronization2` tells apart become the one stage that contains them.
    fn old_stage(self) -> vk::PipelineStageFlags {
        let copies = self.stage.contains(vk::PipelineStageFlags2::COPY);
        let copies = match copies {
            true => vk::PipelineStageFlags::TRANSFER,
            false => vk::PipelineStageFlags::empty(),
        };
        vk::PipelineStageFlags::from_raw(self.stage.as_raw() as u32) | copies
    }

    /// The access flags of Vulkan 1.0.
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
    /// Reads by a copy from an image.
    pub(crate) const COPY_READ: Self = Self::new(
        vk::PipelineStageFlags2::COPY,
        vk::AccessFlags2::TRANSFER_READ,
        vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    );
    /// Writes by copies, fills and copies of query results.
    pub(crate) const TRANSFER_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
        vk::ImageLayout::UNDEFINED,
    );
    /// Reads of storage buffers by shaders.
    pub(crate) const SHADER_READ: Self = Self::new(
        vk::PipelineStageFlags2::from_raw(
            vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
                | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw(),
        ),
        vk::AccessFlags2::SHADER_STORAGE_READ,
        vk::ImageLayout::UNDEFINED,
    );
    /// Reads of storage and uniform buffers by compute shaders.
    pub(crate) const COMPUTE_READ: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_READ.as_raw()
                | vk::AccessFlags2::UNIFORM_READ.as_raw(),
        ),
        vk::ImageLayout::UNDEFINED,
    );
    /// Writes to storage buffers by compute shaders.
    pub(crate) const COMPUTE_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_STORAGE_WRITE,
        vk::ImageLayout::UNDEFINED,
    );
    /// Reads by the host after it has seen that the commands have finished.
    pub(crate) const HOST_READ: Self = Self::new(
        vk::PipelineStageFlags2::HOST,
        vk::AccessFlags2::HOST_READ,
        vk::ImageLayout::UNDEFINED,
    );
}

/// Two accesses to memory of which the second waits for the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MemoryBarrier {
    pub(crate) before: Access,
    pub(crate) after: Access,
}

impl MemoryBarrier {
    pub(crate) const fn new(before: Access, after: Access) -> Self {
        Self { before, after }
    }
}

/// Records a memory barrier. It makes what the access before it wrote visible to the access after it.
///
/// # Safety
/// `cmd` is being recorded, outside of rendering, for a queue of the context's family.
pub(crate) unsafe fn memory(context: &Context, cmd: vk::CommandBuffer, barrier: MemoryBarrier) {
    let MemoryBarrier { before, after } = barrier;
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
    /// The transition before an image is drawn to. `discards` is as [`StencilBarrier::discards`].
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
