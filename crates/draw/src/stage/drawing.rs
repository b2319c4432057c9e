//! Records one shot: shadows, then opaque objects, then translucent objects.

use ash::vk;

use super::image_use::turn;
use super::pipelines::{Draw, PUSHED};
use super::slot::Slot;
use super::upload::{CrowdDraw, Draws};
use super::{Stage, Target};
use crate::scene::Detail;
use crate::shaders::{DrawBodies, DrawLayer};

impl Stage {
    /// # Safety
    /// As for [`Stage::record`].
    pub(super) unsafe fn draw(
        &self,
        cmd: vk::CommandBuffer,
        slot: &Slot,
        draws: &Draws,
        target: &Target,
    ) {
        let device = self.context.device();
        // SAFETY: the caller vouches for `cmd`, slot and target; all other handles are the stage's.
        unsafe {
            let graphics = vk::PipelineBindPoint::GRAPHICS;
            let (layout, sets) = (self.parts.pipelines.layout, [slot.set]);
            device.cmd_bind_descriptor_sets(cmd, graphics, layout, 0, &sets, &[]);
            device.cmd_bind_index_buffer(cmd, self.parts.indices.handle, 0, vk::IndexType::UINT16);
            self.begin_shadows(cmd);
            self.bodies(cmd, (Draw::BodyShadow, Detail::Medium), (0, draws.solids));
            self.crowd(cmd, Draw::CrowdShadow, &draws.crowd);
            device.cmd_end_rendering(cmd);
            self.begin_picture(cmd, target);
            self.bodies(cmd, (Draw::Body, Detail::Fine), (0, draws.solids));
            self.crowd(cmd, Draw::Crowd, &draws.crowd);
            self.bind(cmd, Draw::Floor);
            device.cmd_draw(cmd, 4, 1, 0, 0);
            self.bind(cmd, Draw::Sky);
            device.cmd_draw(cmd, 3, 1, 0, 0);
            self.layers(cmd, &draws.layers);
            let ghosts = (draws.solids, draws.ghosts);
            self.bodies(cmd, (Draw::GhostDepth, Detail::Fine), ghosts);
            self.bodies(cmd, (Draw::Ghost, Detail::Fine), ghosts);
            device.cmd_end_rendering(cmd);
        }
    }

    /// # Safety
    /// As for [`Stage::record`].
    unsafe fn begin_shadows(&self, cmd: vk::CommandBuffer) {
        let shadow = &self.parts.targets.shadow;
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stages};
        let tests = Stages::EARLY_FRAGMENT_TESTS | Stages::LATE_FRAGMENT_TESTS;
        // The previous shot has read the shadow map.
        let read = (Stages::FRAGMENT_SHADER, Access::NONE, Layout::UNDEFINED);
        let written = (
            tests,
            Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE,
            Layout::DEPTH_ATTACHMENT_OPTIMAL,
        );
        let depth = vk::RenderingAttachmentInfo::default()
            .image_view(shadow.view)
            .image_layout(Layout::DEPTH_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(depth_of(1.0));
        let info = vk::RenderingInfo::default()
            .render_area(area(shadow.side))
            .layer_count(1)
            .depth_attachment(&depth);
        // SAFETY: the caller vouches for `cmd`; the image is the stage's.
        unsafe {
            turn(
                &self.context,
                cmd,
                (shadow.handle, vk::ImageAspectFlags::DEPTH),
                (read, written),
            );
            self.context.device().cmd_begin_rendering(cmd, &info);
            self.full_viewport(cmd, shadow.side);
        }
    }

    /// # Safety
    /// As for [`Stage::record`].
    unsafe fn begin_picture(&self, cmd: vk::CommandBuffer, target: &Target) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stages};
        let targets = &self.parts.targets;
        let tests = Stages::EARLY_FRAGMENT_TESTS | Stages::LATE_FRAGMENT_TESTS;
        let depth_access =
            Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE;
        let drawn = (tests, depth_access, Layout::DEPTH_ATTACHMENT_OPTIMAL);
        let fresh = (tests, depth_access, Layout::UNDEFINED);
        let shadow = (
            Stages::FRAGMENT_SHADER,
            // SHADER_SAMPLED_READ would be narrower, but best-practices validation does not accept
            // it with this layout.
            Access::SHADER_READ,
            Layout::SHADER_READ_ONLY_OPTIMAL,
        );
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
            .clear_value(depth_of(0.0));
        let colours = [colour];
        let info = vk::RenderingInfo::default()
            .render_area(area(target.size))
            .layer_count(1)
            .color_attachments(&colours)
            .depth_attachment(&depth);
        // SAFETY: the caller vouches for `cmd` and the target; the other images are the stage's.
        unsafe {
            let aspect = vk::ImageAspectFlags::DEPTH;
            turn(
                &self.context,
                cmd,
                (targets.shadow.handle, aspect),
                (drawn, shadow),
            );
            turn(
                &self.context,
                cmd,
                (targets.depth.handle, aspect),
                (fresh, drawn),
            );
            if !is_single {
                let output = Stages::COLOR_ATTACHMENT_OUTPUT;
                let written = Access::COLOR_ATTACHMENT_WRITE | Access::COLOR_ATTACHMENT_READ;
                let fresh = (output, written, Layout::UNDEFINED);
                let drawn = (output, written, Layout::COLOR_ATTACHMENT_OPTIMAL);
                let image = (targets.samples.handle, vk::ImageAspectFlags::COLOR);
                turn(&self.context, cmd, image, (fresh, drawn));
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
    unsafe fn bodies(
        &self,
        cmd: vk::CommandBuffer,
        (draw, detail): (Draw, Detail),
        (first, count): (u32, u32),
    ) {
        if count == 0 {
            return;
        }
        let mesh = self.parts.meshes.of(detail);
        let constants = DrawBodies {
            sun: u32::from(matches!(draw, Draw::BodyShadow)),
            segments: mesh.segments,
            rings: mesh.rings,
            first_character: 0,
            first_part: 0,
            parts: 1,
        };
        // SAFETY: the caller vouches for `cmd`; as many capsules were written.
        unsafe {
            self.bind(cmd, draw);
            self.push(cmd, &constants);
            let device = self.context.device();
            device.cmd_draw_indexed(cmd, mesh.indices, count, mesh.first_index, 0, first);
        }
    }

    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn crowd(&self, cmd: vk::CommandBuffer, draw: Draw, crowd: &[CrowdDraw]) {
        let is_shadow = matches!(draw, Draw::CrowdShadow);
        let drawn = crowd.iter().filter(|group| group.casts || !is_shadow);
        let mut is_bound = false;
        for group in drawn {
            // Shadows use a coarser mesh, because the difference is not visible.
            let detail = match group.detail {
                Detail::Fine if is_shadow => Detail::Medium,
                _ if is_shadow => Detail::Coarse,
                detail => detail,
            };
            let mesh = self.parts.meshes.of(detail);
            let constants = DrawBodies {
                sun: u32::from(is_shadow),
                segments: mesh.segments,
                rings: mesh.rings,
                first_character: group.first_character,
                first_part: group.first_part,
                parts: group.parts,
            };
            let count = group.characters * group.parts;
            if count == 0 {
                continue;
            }
            // SAFETY: the caller vouches for `cmd`; as many characters and parts were written.
            unsafe {
                if !std::mem::replace(&mut is_bound, true) {
                    self.bind(cmd, draw);
                }
                self.push(cmd, &constants);
                let device = self.context.device();
                device.cmd_draw_indexed(cmd, mesh.indices, count, mesh.first_index, 0, 0);
            }
        }
    }

    /// # Safety
    /// As for [`Stage::record`], inside of rendering.
    unsafe fn layers(&self, cmd: vk::CommandBuffer, layers: &[DrawLayer]) {
        for (index, layer) in layers.iter().enumerate() {
            // SAFETY: the caller vouches for `cmd`; the words were written.
            unsafe {
                if index == 0 {
                    self.bind(cmd, Draw::Layer);
                }
                self.push(cmd, layer);
                self.context.device().cmd_draw(cmd, 4, 1, 0, 0);
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

fn area(side: [u32; 2]) -> vk::Rect2D {
    vk::Rect2D::default().extent(vk::Extent2D {
        width: side[0],
        height: side[1],
    })
}

fn depth_of(depth: f32) -> vk::ClearValue {
    vk::ClearValue {
        depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 },
    }
}
