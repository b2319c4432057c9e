//! The begin of rendering for all stencil passes, and the instances of discs and maps.

use ash::vk;

use super::shelves::Place;
use crate::{
    gpu::{Context, resources::StencilTarget, shader_table::PlacedDisc},
    maps::{Disc, MapRect},
};

/// Target of a rendering, with its load and store operations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rendering<'a> {
    pub(crate) target: &'a StencilTarget,
    /// Number of columns and rows of the target that are drawn to.
    pub(crate) used: [u32; 2],
    /// Value that the target is cleared to, or `None` to load it.
    pub(crate) clear: Option<u32>,
    /// Whether the target is stored at the end.
    pub(crate) stored: bool,
}

/// Records the begin of rendering to a target.
///
/// # Safety
/// `cmd` is being recorded outside of rendering, for the context's device; the target is in the layout of a stencil
/// attachment, and lives until the commands are done.
pub(crate) unsafe fn begin(context: &Context, cmd: vk::CommandBuffer, rendering: Rendering<'_>) {
    let target = rendering.target;
    let [width, height] = rendering.used;
    let area = vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent: vk::Extent2D { width, height },
    };
    let stencil = vk::RenderingAttachmentInfo::default()
        .image_view(target.view)
        .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
        .load_op(match rendering.clear {
            Some(_) => vk::AttachmentLoadOp::CLEAR,
            None => vk::AttachmentLoadOp::LOAD,
        })
        .store_op(if rendering.stored {
            vk::AttachmentStoreOp::STORE
        } else {
            vk::AttachmentStoreOp::DONT_CARE
        })
        .clear_value(vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue {
                depth: 0.0,
                stencil: rendering.clear.unwrap_or(0),
            },
        });
    let info = vk::RenderingInfo::default()
        .render_area(area)
        .layer_count(1)
        .stencil_attachment(&stencil);
    // Quads are positioned relative to the whole target, regardless of the part in use.
    let viewport = [vk::Viewport {
        x: 0.0,
        y: 0.0,
        width: target.side[0] as f32,
        height: target.side[1] as f32,
        min_depth: 0.0,
        max_depth: 1.0,
    }];
    let device = context.device();
    // SAFETY: the caller vouches for `cmd` and the target.
    unsafe {
        device.cmd_begin_rendering(cmd, &info);
        device.cmd_set_viewport(cmd, 0, &viewport);
        device.cmd_set_scissor(cmd, 0, &[area]);
    }
}

impl Place {
    /// First and end texel of a map in the target. The sides of targets are below 2¹⁶.
    pub(crate) fn clip(self, rect: MapRect) -> [u16; 4] {
        [self.x, self.y, self.x + rect.width, self.y + rect.height].map(|texel| texel as u16)
    }

    /// Instance of a disc of a map.
    pub(crate) fn place(self, disc: Disc, rect: MapRect) -> PlacedDisc {
        let Disc { x, z, radius } = disc.relative_to(-(self.x as i32), -(self.y as i32));
        PlacedDisc {
            disc: [x, z, radius],
            clip: self.clip(rect),
        }
    }

    /// Instance of a whole map, for pipelines that draw no discs.
    pub(crate) fn whole(self, rect: MapRect) -> PlacedDisc {
        PlacedDisc {
            disc: [0; 3],
            clip: self.clip(rect),
        }
    }
}
