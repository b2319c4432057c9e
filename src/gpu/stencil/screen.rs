//! The virtual screen: a stencil target in which maps are drawn side by side.
//!
//! Source: Masaoka & Oshita, sections 4.3 and 5.3: maps are drawn on a virtual screen on the GPU, which is a stencil buffer.
//! Differs: one target holds many maps, so that one rendering draws all of them. They are packed on shelves (next fit; Coffman, Garey,
//! Johnson & Tarjan, "Performance bounds for level-oriented two-dimensional packing algorithms", 1980).

use std::ops::Range;

use ash::vk;

use crate::{
    gpu::{
        Context, GpuError, Memory, MemoryUse,
        barriers::{self, Access},
        image::{Image, ImageDesc},
        pipelines::{DISCS, Pipeline, RECTS, StencilRule},
        resources::{Buffer, BufferDesc, DeviceMemory},
        shader_table::{DrawTarget, PlacedDisc},
    },
    maps::{Disc, Drawing, MapRect},
};

/// Position of a map in a target: its first texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) x: u32,
    pub(super) y: u32,
}

impl Place {
    /// First and end texel in the target of a map of a size. The sides of targets are below 2¹⁶.
    pub(super) fn clip(self, rect: MapRect) -> [u16; 4] {
        [self.x, self.y, self.x + rect.width, self.y + rect.height].map(|texel| texel as u16)
    }

    pub(super) fn disc(self, disc: Disc, rect: MapRect) -> PlacedDisc {
        let Disc { x, z, radius } = disc.relative_to(-(self.x as i32), -(self.y as i32));
        PlacedDisc {
            disc: [x, z, radius],
            clip: self.clip(rect),
        }
    }

    pub(super) fn whole(self, rect: MapRect) -> PlacedDisc {
        PlacedDisc {
            disc: [0; 3],
            clip: self.clip(rect),
        }
    }
}

/// What the instances of a draw are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Discs,
    WholeMaps,
}

#[derive(Clone, Debug)]
pub(super) struct Draw {
    pub(super) shape: Shape,
    pub(super) rule: StencilRule,
    pub(super) instances: Range<u32>,
}

/// Draws and their instances. The memory is reused.
#[derive(Debug, Default)]
pub(super) struct Draws {
    pub(super) draws: Vec<Draw>,
    pub(super) instances: Vec<PlacedDisc>,
}

impl Draws {
    pub(super) fn clear(&mut self) {
        self.draws.clear();
        self.instances.clear();
    }

    pub(super) fn discs<'a>(
        &mut self,
        members: impl Iterator<Item = (&'a Drawing, Place)>,
        frame: usize,
    ) {
        for (drawing, place) in members.filter(|(drawing, _)| frame < drawing.frames()) {
            let discs = drawing.frame(frame).iter();
            let placed = discs.map(|&disc| place.disc(disc, drawing.rect));
            self.instances.extend(placed);
        }
    }

    pub(super) fn whole_maps<'a>(&mut self, members: impl Iterator<Item = (&'a Drawing, Place)>) {
        let placed = members.map(|(drawing, place)| place.whole(drawing.rect));
        self.instances.extend(placed);
    }

    /// Adds a draw of the instances since the last draw.
    pub(super) fn draw(&mut self, shape: Shape, rule: StencilRule) {
        let start = self.draws.last().map_or(0, |draw| draw.instances.end);
        let instances = start..self.instances.len() as u32;
        if !instances.is_empty() {
            self.draws.push(Draw {
                shape,
                rule,
                instances,
            });
        }
    }
}

/// The open shelf of a target: its end, its lower edge and its height, in texels.
#[derive(Debug, Default)]
pub(super) struct Shelves {
    x: u32,
    y: u32,
    height: u32,
}

impl Shelves {
    /// Position for a map in a target of these columns and rows, and whether it begins a target: the first one, or the next where the map does
    /// not fit the rest.
    pub(super) fn place(&mut self, rect: MapRect, sides: [u32; 2]) -> (Place, bool) {
        if self.x + rect.width > sides[0] {
            (self.x, self.y, self.height) = (0, self.y + self.height, 0);
        }
        let begins = (self.x, self.y) == (0, 0) || self.y + rect.height > sides[1];
        if begins {
            *self = Self::default();
        }
        let (x, y) = (self.x, self.y);
        self.x += rect.width;
        self.height = self.height.max(rect.height);
        (Place { x, y }, begins)
    }
}

/// The stencil target, and what draws discs into it. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Screen {
    pub(super) target: Image,
    discs: Pipeline,
    rects: Pipeline,
    /// Instances of one rendering. Each rendering fills it again, so that their number is not limited.
    pub(super) instances: Buffer,
}

impl Screen {
    pub(super) const INSTANCE_BYTES: usize = 1 << 20;

    /// Fills a default screen. After a failure, [`Screen::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        side: u32,
        cache: vk::PipelineCache,
    ) -> Result<(), GpuError> {
        self.discs = Pipeline::new(device.context, &DISCS, &[], cache)?;
        self.rects = Pipeline::new(device.context, &RECTS, &[], cache)?;
        use vk::ImageUsageFlags as Usage;
        let format = device.context.stencil_format();
        self.target = device.image(&ImageDesc {
            name: &format!("{name}: target"),
            side: [side; 2],
            format,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: Usage::DEPTH_STENCIL_ATTACHMENT | Usage::TRANSFER_SRC,
            aspect: barriers::whole(format).aspect_mask,
        })?;
        self.instances = device.buffer(BufferDesc {
            name: &format!("{name}: instances"),
            size: Self::INSTANCE_BYTES as u64,
            usage: vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Device,
        })?;
        Ok(())
    }

    /// Records the copy of instances to the buffer, by way of the command buffer.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering, for the context's device. The instances fit the buffer.
    pub(super) unsafe fn upload(&self, context: &Context, cmd: vk::CommandBuffer, bytes: &[u8]) {
        /// Maximum size of an update (`vkCmdUpdateBuffer`).
        const UPDATE: usize = 65_536;
        let (read, written) = (Access::VERTEX_READ, Access::TRANSFER_WRITE);
        // SAFETY: the caller vouches for `cmd` and the size. Instances consist of words.
        unsafe {
            barriers::memory(context, cmd, read.and(written), written);
            for (bytes, offset) in bytes.chunks(UPDATE).zip((0..).step_by(UPDATE)) {
                let device = context.device();
                device.cmd_update_buffer(cmd, self.instances.handle, offset, bytes);
            }
            barriers::memory(context, cmd, written, read);
        }
    }

    /// Records the begin of rendering to the used columns and rows. The target is cleared to a value, or keeps its texels.
    ///
    /// # Safety
    /// `cmd` is being recorded outside of rendering, for the context's device, and the screen lives until the commands are done.
    pub(super) unsafe fn begin(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        [width, height]: [u32; 2],
        clear: Option<u32>,
    ) {
        let target = &self.target;
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width, height },
        };
        let value = vk::ClearDepthStencilValue {
            depth: 0.0,
            stencil: clear.unwrap_or(0),
        };
        let stencil = vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
            .load_op(match clear {
                Some(_) => vk::AttachmentLoadOp::CLEAR,
                None => vk::AttachmentLoadOp::LOAD,
            })
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue {
                depth_stencil: value,
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
        let (device, stencil) = (context.device(), Access::STENCIL);
        // SAFETY: the caller vouches for `cmd`; target and buffer are this screen's.
        unsafe {
            barriers::stencil_image(
                context,
                cmd,
                target.handle,
                stencil,
                stencil,
                clear.is_some(),
            );
            device.cmd_begin_rendering(cmd, &info);
            device.cmd_set_viewport(cmd, 0, &viewport);
            device.cmd_set_scissor(cmd, 0, &[area]);
            device.cmd_bind_vertex_buffers(cmd, 0, &[self.instances.handle], &[0]);
        }
    }

    /// Binds a pipeline that draws into the target.
    ///
    /// # Safety
    /// As for [`Screen::begin`], within the rendering; the pipeline is of the context's device.
    pub(super) unsafe fn bind(&self, context: &Context, cmd: vk::CommandBuffer, with: &Pipeline) {
        let side = DrawTarget {
            side: self.target.side,
        };
        // SAFETY: the caller vouches for `cmd` and the pipeline.
        unsafe {
            let device = context.device();
            device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, with.handle);
            with.push(context, cmd, &side);
        }
    }

    /// Clears the used columns and rows to a value, and draws in order, in as many renderings as the instances need.
    ///
    /// # Safety
    /// As for [`Screen::begin`].
    pub(super) unsafe fn record_draws(
        &self,
        context: &Context,
        cmd: vk::CommandBuffer,
        draws: &Draws,
        used: [u32; 2],
        clear: u32,
    ) {
        const MOST: usize = Screen::INSTANCE_BYTES / size_of::<PlacedDisc>();
        let count = draws.instances.len();
        for start in (0..count.max(1)).step_by(MOST) {
            let end = count.min(start + MOST);
            let instances = bytemuck::cast_slice(&draws.instances[start..end]);
            let clear = (start == 0).then_some(clear);
            // SAFETY: the caller vouches for `cmd`; each draw is of instances that were just uploaded.
            unsafe {
                self.upload(context, cmd, instances);
                self.begin(context, cmd, used, clear);
                let mut bound = None;
                for Draw {
                    shape,
                    rule,
                    instances,
                } in &draws.draws
                {
                    let from = start.max(instances.start as usize);
                    let to = end.min(instances.end as usize);
                    if from >= to {
                        continue;
                    }
                    if bound != Some(*shape) {
                        bound = Some(*shape);
                        let pipeline = match shape {
                            Shape::Discs => &self.discs,
                            Shape::WholeMaps => &self.rects,
                        };
                        self.bind(context, cmd, pipeline);
                    }
                    rule.set(context, cmd);
                    let (first, count) = ((from - start) as u32, (to - from) as u32);
                    context.device().cmd_draw(cmd, 4, count, 0, first);
                }
                context.device().cmd_end_rendering(cmd);
            }
        }
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.instances.destroy(context, memory);
        self.target.destroy(context, memory);
        self.rects.destroy(context);
        self.discs.destroy(context);
    }
}
