//! Records one shot: shadows, then opaque objects, then translucent objects.

use std::ops::Range;

use ash::vk;
use bytemuck::Zeroable;

use super::meshes::{RINGS, SEGMENTS};
use super::pipelines::{Draw, PUSHED};
use super::slot::Slot;
use super::upload::{Draws, SkinDraw};
use super::{Stage, Target};
use crate::shaders::{DrawBodies, DrawCommand, DrawSkin};
use sabaki::gpu::Context;
use sabaki::gpu::internal::Image;

impl Stage {
    /// # Safety
    /// As for [`Stage::record`].
    pub(super) unsafe fn draw(&self, cmd: vk::CommandBuffer, slot: &Slot, draws: &Draws) {
        let device = self.context.device();
        let solids = 0..draws.solids;
        let first_ghost = solids.end + draws.occluders;
        let ghosts = first_ghost..first_ghost + draws.ghosts;
        let commands = slot.commands.handle;
        let skins = |is_ghost: bool| {
            let all = draws.skins.iter().enumerate();
            all.filter(move |(_, draw)| draw.is_ghost == is_ghost)
        };
        // SAFETY: the caller vouches for `cmd`, slot and target; all other handles are the stage's.
        unsafe {
            let graphics = vk::PipelineBindPoint::GRAPHICS;
            let (layout, sets) = (self.parts.pipelines.layout, [slot.set]);
            device.cmd_bind_descriptor_sets(cmd, graphics, layout, 0, &sets, &[]);
            self.context.begin_label(cmd, c"sabaki: shadows");
            self.begin_shadows(cmd);
            self.bodies(cmd, Draw::BodyShadow, solids.clone());
            let casting = skins(false).filter(|(_, draw)| draw.casts);
            self.skins(cmd, Draw::SkinShadow, commands, casting);
            device.cmd_end_rendering(cmd);
            self.context.end_label(cmd);
            self.context.begin_label(cmd, c"sabaki: picture");
            self.begin_picture(cmd, &draws.target);
            self.bodies(cmd, Draw::Body, solids);
            self.skins(cmd, Draw::Skin, commands, skins(false));
            self.bind(cmd, Draw::Floor);
            device.cmd_draw(cmd, 4, 1, 0, 0);
            self.bind(cmd, Draw::Sky);
            device.cmd_draw(cmd, 3, 1, 0, 0);
            self.bind(cmd, Draw::Layer);
            for layer in &draws.layers {
                self.push(cmd, layer);
                device.cmd_draw(cmd, 4, 1, 0, 0);
            }
            self.skins(cmd, Draw::SkinGhostDepth, commands, skins(true));
            self.skins(cmd, Draw::SkinGhost, commands, skins(true));
            self.bodies(cmd, Draw::GhostDepth, ghosts.clone());
            self.bodies(cmd, Draw::Ghost, ghosts);
            device.cmd_end_rendering(cmd);
            self.context.end_label(cmd);
        }
    }

    /// # Safety
    /// As for [`Stage::record`].
    unsafe fn begin_shadows(&self, cmd: vk::CommandBuffer) {
        let shadow = &self.parts.targets.shadow;
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stages};
        // The previous shot has read the shadow map.
        let read = ImageUse {
            stages: Stages::FRAGMENT_SHADER,
            access: Access::NONE,
            layout: Layout::UNDEFINED,
        };
        let depth = vk::RenderingAttachmentInfo::default()
            .image_view(shadow.view)
            .image_layout(Layout::DEPTH_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(cleared(1.0));
        let info = vk::RenderingInfo::default()
            .render_area(area(shadow.side))
            .layer_count(1)
            .depth_attachment(&depth);
        // SAFETY: the caller vouches for `cmd`; the image is the stage's.
        unsafe {
            image_barrier(&self.context, cmd, depth_of(shadow), read, DEPTH_DRAWN);
            self.context.device().cmd_begin_rendering(cmd, &info);
            self.full_viewport(cmd, shadow.side);
        }
    }

    /// # Safety
    /// As for [`Stage::record`].
    unsafe fn begin_picture(&self, cmd: vk::CommandBuffer, target: &Target) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stages};
        let targets = &self.parts.targets;
        let shadow_read = ImageUse {
            stages: Stages::FRAGMENT_SHADER,
            // SHADER_SAMPLED_READ would be narrower, but best-practices validation does not accept
            // it with this layout.
            access: Access::SHADER_READ,
            layout: Layout::SHADER_READ_ONLY_OPTIMAL,
        };
        let is_single = self.samples == vk::SampleCountFlags::TYPE_1;
        let mut colour = vk::RenderingAttachmentInfo::default()
            .image_layout(Layout::COLOR_ATTACHMENT_OPTIMAL)
            // Every pixel is overwritten, but on tiled GPUs a clear is faster than a load.
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .image_view(target.view);
        if !is_single {
            colour = colour
                .image_view(targets.samples.view)
                .store_op(vk::AttachmentStoreOp::DONT_CARE)
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(target.view)
                .resolve_image_layout(Layout::COLOR_ATTACHMENT_OPTIMAL);
        }
        let depth = vk::RenderingAttachmentInfo::default()
            .image_view(targets.depth.view)
            .image_layout(Layout::DEPTH_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::DONT_CARE)
            .clear_value(cleared(0.0));
        let colours = [colour];
        let info = vk::RenderingInfo::default()
            .render_area(area(target.size))
            .layer_count(1)
            .color_attachments(&colours)
            .depth_attachment(&depth);
        // SAFETY: the caller vouches for `cmd` and the target; the other images are the stage's.
        unsafe {
            let context = &self.context;
            image_barrier(
                context,
                cmd,
                depth_of(&targets.shadow),
                DEPTH_DRAWN,
                shadow_read,
            );
            let (depth, fresh) = (depth_of(&targets.depth), DEPTH_DRAWN.discarded());
            image_barrier(context, cmd, depth, fresh, DEPTH_DRAWN);
            if !is_single {
                let samples = (targets.samples.handle, vk::ImageAspectFlags::COLOR);
                let blended = ImageUse {
                    access: Access::COLOR_ATTACHMENT_WRITE | Access::COLOR_ATTACHMENT_READ,
                    ..DRAWN
                };
                image_barrier(context, cmd, samples, blended.discarded(), blended);
            }
            self.context.device().cmd_begin_rendering(cmd, &info);
            self.full_viewport(cmd, target.size);
        }
    }

    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn bind(&self, cmd: vk::CommandBuffer, draw: Draw) {
        let pipeline = self.parts.pipelines.get(draw);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the caller vouches for `cmd`; the pipeline is the stage's.
        unsafe {
            self.context
                .device()
                .cmd_bind_pipeline(cmd, graphics, pipeline)
        };
    }

    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn push<T: bytemuck::Pod>(&self, cmd: vk::CommandBuffer, constants: &T) {
        let (layout, bytes) = (self.parts.pipelines.layout, bytemuck::bytes_of(constants));
        // SAFETY: the caller vouches for `cmd`; the layout has room for every block of the shaders.
        unsafe {
            let device = self.context.device();
            device.cmd_push_constants(cmd, layout, PUSHED, 0, bytes);
        }
    }

    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn bodies(&self, cmd: vk::CommandBuffer, draw: Draw, capsules: Range<u32>) {
        if capsules.is_empty() {
            return;
        }
        let is_shadow = matches!(draw, Draw::BodyShadow);
        let constants = DrawBodies {
            sun: u32::from(is_shadow),
            segments: SEGMENTS,
            rings: RINGS,
            // The shaders do not read the rest.
            ..DrawBodies::zeroed()
        };
        let indices = 6 * SEGMENTS * (2 * RINGS + 1);
        // SAFETY: the caller vouches for `cmd`; as many capsules were written.
        unsafe {
            self.bind(cmd, draw);
            self.push(cmd, &constants);
            let device = self.context.device();
            let buffer = self.parts.indices.handle;
            device.cmd_bind_index_buffer(cmd, buffer, 0, vk::IndexType::UINT16);
            let (first, count) = (capsules.start, capsules.len() as u32);
            device.cmd_draw_indexed(cmd, indices, count, 0, 0, first);
        }
    }

    /// Draws skinned meshes: one indirect draw for each mesh, level and resolution.
    ///
    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn skins<'d>(
        &self,
        cmd: vk::CommandBuffer,
        draw: Draw,
        commands: vk::Buffer,
        skins: impl Iterator<Item = (usize, &'d SkinDraw)>,
    ) {
        let (device, meshes) = (self.context.device(), &self.parts.skins);
        let stride = size_of::<DrawCommand>() as u32;
        let mut is_bound = false;
        for (command, skin) in skins {
            let constants = DrawSkin {
                sun: u32::from(matches!(draw, Draw::SkinShadow)),
                ..skin.constants
            };
            let offset = command as u64 * u64::from(stride);
            // SAFETY: the caller vouches for `cmd`; the buffers are the stage's, and the commands were written.
            unsafe {
                if !std::mem::replace(&mut is_bound, true) {
                    self.bind(cmd, draw);
                    device.cmd_bind_vertex_buffers(cmd, 0, &[meshes.vertices.handle], &[0]);
                    let indices = meshes.indices.handle;
                    device.cmd_bind_index_buffer(cmd, indices, 0, vk::IndexType::UINT32);
                }
                self.push(cmd, &constants);
                device.cmd_draw_indexed_indirect(cmd, commands, offset, 1, stride);
            }
        }
    }

    /// # Safety
    /// As for [`Stage::record`].
    unsafe fn full_viewport(&self, cmd: vk::CommandBuffer, side: [u32; 2]) {
        let device = self.context.device();
        let viewport = [vk::Viewport {
            width: side[0] as f32,
            height: side[1] as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        }];
        // SAFETY: the caller vouches for `cmd`.
        unsafe {
            device.cmd_set_viewport(cmd, 0, &viewport);
            device.cmd_set_scissor(cmd, 0, &[area(side)]);
        }
    }
}

const DEPTH_DRAWN: ImageUse = ImageUse {
    stages: vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
            | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
    ),
    access: vk::AccessFlags2::from_raw(
        vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
            | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
    ),
    layout: vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
};

fn depth_of(image: &Image) -> (vk::Image, vk::ImageAspectFlags) {
    (image.handle, vk::ImageAspectFlags::DEPTH)
}

fn area(side: [u32; 2]) -> vk::Rect2D {
    vk::Rect2D::default().extent(vk::Extent2D {
        width: side[0],
        height: side[1],
    })
}

fn cleared(depth: f32) -> vk::ClearValue {
    vk::ClearValue {
        depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 },
    }
}

#[derive(Clone, Copy)]
pub(crate) struct ImageUse {
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
