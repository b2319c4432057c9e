//! Maps drawn by the device. CPU twin: `src/maps/raster.rs`.
//!
//! Source: Masaoka & Oshita, section 4.3; `rules.rs` has the stencil rules.

use ash::vk;

use super::{
    batch::Batch,
    drawing::{self, Rendering},
    packing::{self, BatchLimits},
    rules::{self, Passes},
};
use crate::{
    gpu::{
        Context, GpuError, Memory, MemoryUse,
        barriers::{self, Access, MemoryBarrier, StencilBarrier},
        error::within,
        pipelines::{DISCS, Pipeline, PipelineInputs, RECTS},
        resources::{Buffer, BufferDesc, DeviceMemory, StencilTarget},
        shader_table::{PlacedDisc, TargetSide},
    },
    maps::Drawing,
    query::cull::CullPath,
};

/// Settings of a [`Rasterizer`].
#[derive(Clone, Copy, Debug)]
pub struct RasterizerDesc<'a> {
    /// Prefix of the names of Vulkan objects, for debuggers and validation.
    pub name: &'a str,
    /// Side of the target that maps are packed into, in texels. It is the maximum side of a map. Default 1,024.
    pub side: u32,
    /// Maximum number of discs of a batch, and so of a drawing. Default 262,144 (10 MiB, because the first frame's discs are drawn twice).
    pub max_discs: u32,
    /// Cache that pipelines are created with. Default: none.
    pub pipeline_cache: vk::PipelineCache,
}

impl Default for RasterizerDesc<'_> {
    fn default() -> Self {
        Self {
            name: "rasterizer",
            side: 1024,
            max_discs: 1 << 18,
            pipeline_cache: vk::PipelineCache::null(),
        }
    }
}

/// Kind of the maps that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapKind {
    /// Body and evasion maps: [`raster::every_frame`](crate::maps::raster::every_frame).
    EveryFrame,
    /// Attack maps: [`raster::any_frame`](crate::maps::raster::any_frame).
    AnyFrame,
}

/// Maps that are drawn together.
#[derive(Clone, Copy, Debug)]
pub struct BatchMaps<'a> {
    /// All drawings that [`Rasterizer::plan`] distributed.
    pub drawings: &'a [Drawing],
    /// A batch of [`Rasterizer::plan`] for these drawings.
    pub batch: &'a Batch,
    /// Kind of the maps.
    pub kind: MapKind,
}

/// Draws many maps at once with the stencil buffer.
///
/// [`Rasterizer::plan`] distributes drawings to batches. For each batch: [`Rasterizer::record`], submit, wait, then read. There is one
/// target. Record a batch only after the previous one has been read.
#[derive(Debug)]
pub struct Rasterizer {
    pub(super) context: Context,
    pub(super) parts: Parts,
    limits: BatchLimits,
    scratch: Passes,
}

#[derive(Debug, Default)]
pub(super) struct Parts {
    discs: Pipeline,
    rects: Pipeline,
    target: StencilTarget,
    instances: Buffer,
    pub(super) texels: Buffer,
    live: bool,
}

impl Rasterizer {
    /// Creates pipelines and allocates memory. On failure everything is freed again.
    ///
    /// # Errors
    /// Errors of Vulkan calls and of the allocator; [`GpuError::Limit`] if the device does not support a target of that side;
    /// [`GpuError::Missing`] if a requirement of the stencil path is missing.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &RasterizerDesc<'_>,
    ) -> Result<Self, GpuError> {
        context.runs(CullPath::Stencil)?;
        let side = desc.side.max(1);
        within(
            "side of a stencil target",
            side.into(),
            context.max_target_side().min(u16::MAX.into()).into(),
        )?;
        let mut rasterizer = Self {
            context: context.clone(),
            parts: Parts::default(),
            limits: BatchLimits {
                side,
                // Each drawing's first frame is drawn twice, and whole maps are instances too.
                instances: desc.max_discs.saturating_mul(2).saturating_add(64),
            },
            scratch: Passes::default(),
        };
        match rasterizer.fill(memory, desc) {
            Ok(()) => Ok(rasterizer),
            Err(error) => {
                rasterizer.free(memory);
                Err(error)
            }
        }
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &RasterizerDesc<'_>) -> Result<(), GpuError> {
        let (context, parts, name) = (&self.context, &mut self.parts, desc.name);
        let inputs = PipelineInputs {
            cache: desc.pipeline_cache,
            ..PipelineInputs::default()
        };
        let mut device = DeviceMemory { context, memory };
        parts.live = true;
        parts.discs = Pipeline::new(context, &DISCS, &inputs)?;
        parts.rects = Pipeline::new(context, &RECTS, &inputs)?;
        let side = self.limits.side;
        let target = format!("{name}: target");
        parts.target = StencilTarget::new(&mut device, &target, [side, side])?;
        parts.instances = device.buffer(BufferDesc {
            name: &format!("{name}: discs"),
            size: u64::from(self.limits.instances) * size_of::<PlacedDisc>() as u64,
            usage: vk::BufferUsageFlags::VERTEX_BUFFER,
            memory: MemoryUse::Upload,
        })?;
        parts.texels = device.buffer(BufferDesc {
            name: &format!("{name}: texels"),
            size: u64::from(side) * u64::from(side),
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        })?;
        Ok(())
    }

    /// Distributes drawings to batches that fit the target.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if a drawing is too large for a batch, [`GpuError::FrameEnds`] if its frame ends are wrong.
    pub fn plan(&self, drawings: &[Drawing]) -> Result<Vec<Batch>, GpuError> {
        packing::plan(drawings, self.limits)
    }

    /// Records the drawing of a batch, and the copy of its texels to memory that the host reads.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if the batch was planned for other drawings; the error of a flush.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family. Commands that were recorded before with this
    /// rasterizer have finished.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        maps: BatchMaps<'_>,
    ) -> Result<(), GpuError> {
        let BatchMaps {
            drawings,
            batch,
            kind,
        } = maps;
        match kind {
            MapKind::EveryFrame => rules::every_frame(drawings, batch, &mut self.scratch),
            MapKind::AnyFrame => rules::any_frame(drawings, batch, &mut self.scratch),
        }
        let bytes = bytemuck::cast_slice(&self.scratch.instances);
        self.parts.instances.write(&self.context, 0, bytes)?;
        let (context, image) = (&self.context, self.parts.target.image);
        // SAFETY: the caller vouches for `cmd`; the target is this rasterizer's and not in use.
        unsafe {
            context.begin_label(cmd, c"sabaki: maps");
            let barrier = StencilBarrier::before_drawing(image, true);
            barriers::stencil_image(context, cmd, barrier);
            self.record_passes(cmd, batch);
            context.end_label(cmd);
            context.begin_label(cmd, c"sabaki: maps to the host");
            let barrier = StencilBarrier {
                image,
                before: Access::STENCIL,
                after: Access::COPY_READ,
                discards: false,
            };
            barriers::stencil_image(context, cmd, barrier);
            self.record_copy(cmd, batch);
            barriers::memory(
                context,
                cmd,
                MemoryBarrier::new(Access::TRANSFER_WRITE, Access::HOST_READ),
            );
            context.end_label(cmd);
        }
        Ok(())
    }

    /// # Safety
    /// As for [`Rasterizer::record`], and the target is in the layout of a stencil attachment.
    unsafe fn record_passes(&self, cmd: vk::CommandBuffer, batch: &Batch) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let side = TargetSide {
            side: parts.target.side,
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this rasterizer's.
        unsafe {
            let rendering = Rendering {
                target: &parts.target,
                used: batch.used,
                clear: Some(rules::START),
                stored: true,
            };
            drawing::begin(context, cmd, rendering);
            device.cmd_bind_vertex_buffers(cmd, 0, &[parts.instances.handle], &[0]);
            let mut bound = None;
            for pass in &self.scratch.passes {
                if bound != Some(pass.whole_maps) {
                    let pipeline = if pass.whole_maps {
                        &parts.rects
                    } else {
                        &parts.discs
                    };
                    let graphics = vk::PipelineBindPoint::GRAPHICS;
                    device.cmd_bind_pipeline(cmd, graphics, pipeline.handle);
                    pipeline.push(context, cmd, &side);
                    bound = Some(pass.whole_maps);
                }
                pass.rule.set(context, cmd);
                let count = pass.instances.end - pass.instances.start;
                device.cmd_draw(cmd, 4, count, 0, pass.instances.start);
            }
            device.cmd_end_rendering(cmd);
        }
    }

    /// # Safety
    /// As for [`Rasterizer::record`], and the target is in the layout of a copy's source.
    unsafe fn record_copy(&self, cmd: vk::CommandBuffer, batch: &Batch) {
        let [width, height] = batch.used;
        let region = [vk::BufferImageCopy::default()
            .image_subresource(
                vk::ImageSubresourceLayers::default()
                    .aspect_mask(vk::ImageAspectFlags::STENCIL)
                    .layer_count(1),
            )
            .image_extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })];
        // SAFETY: the caller vouches for `cmd` and the layout; the buffer has a byte for every texel of the target.
        unsafe {
            self.context.device().cmd_copy_image_to_buffer(
                cmd,
                self.parts.target.image,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                self.parts.texels.handle,
                &region,
            );
        }
    }

    /// Frees everything. No recorded batch may be in flight.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.free(memory);
    }

    fn free(&mut self, memory: &mut dyn Memory) {
        let (context, parts) = (&self.context, &mut self.parts);
        parts.texels.destroy(context, memory);
        parts.instances.destroy(context, memory);
        parts.target.destroy(context, memory);
        parts.rects.destroy(context);
        parts.discs.destroy(context);
        parts.live = false;
    }
}

impl Drop for Rasterizer {
    fn drop(&mut self) {
        if self.parts.live {
            tracing::error!("a Rasterizer was dropped without destroy: its Vulkan objects leak");
        }
    }
}
