//! Draws body, evasion and attack maps on the device, and reads them back. CPU twin: `src/maps/regions/raster.rs`.
//!
//! Source: Masaoka & Oshita, section 4.3: for each evasion and attack, its maps are drawn with the stencil buffer and kept as textures.
//! [`rules`] has the order of the draws. Differs: many maps are drawn at once, side by side.

use ash::vk;

use super::{
    rules,
    screen::{Draws, Place, Screen, Shelves},
};
use crate::{
    gpu::{
        Context, GpuError, Memory, MemoryUse,
        barriers::{self, Access},
        error::within,
        resources::{Buffer, BufferDesc, DeviceMemory},
    },
    maps::{BitMap, Drawing, EvasionMaps, MapRect},
    query::cull::CullPath,
};

/// Settings of a [`Rasterizer`].
#[derive(Clone, Copy, Debug)]
pub struct RasterizerDesc<'a> {
    /// Prefix of the names of Vulkan objects, for debuggers and validation.
    pub name: &'a str,
    /// Side of the target that maps are packed into, in texels. It is the maximum side of a map. Default 1,024.
    pub side: u32,
    /// Cache that pipelines are created with. Default: none.
    pub pipeline_cache: vk::PipelineCache,
}

impl Default for RasterizerDesc<'_> {
    fn default() -> Self {
        Self {
            name: "rasterizer",
            side: 1024,
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

/// Drawings that are drawn into the target together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Batch {
    /// Index and position in the target of each drawing.
    pub(super) members: Vec<(usize, Place)>,
    /// Number of used columns and rows of the target.
    used: [u32; 2],
}

/// Draws many maps at once with the stencil buffer.
///
/// [`Rasterizer::plan`] distributes drawings to batches. For each batch: [`Rasterizer::record`], submit, wait, then read. There is one
/// target. Record a batch only after the previous one has been read.
#[derive(Debug)]
pub struct Rasterizer {
    context: Context,
    screen: Screen,
    /// Stencil values of the last batch, one byte for each texel.
    texels: Buffer,
    side: u32,
    draws: Draws,
    is_live: bool,
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
        let most = context.max_target_side().min(u16::MAX.into());
        within("side of a stencil target", side.into(), most.into())?;
        let mut rasterizer = Self {
            context: context.clone(),
            screen: Screen::default(),
            texels: Buffer::default(),
            side,
            draws: Draws::default(),
            is_live: true,
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
        let context = &self.context;
        let mut device = DeviceMemory { context, memory };
        self.screen
            .fill(&mut device, desc.name, self.side, desc.pipeline_cache)?;
        self.texels = device.buffer(BufferDesc {
            name: &format!("{}: texels", desc.name),
            size: u64::from(self.side) * u64::from(self.side),
            usage: vk::BufferUsageFlags::TRANSFER_DST,
            memory: MemoryUse::Readback,
        })?;
        Ok(())
    }

    /// Distributes drawings to batches that fit the target. Drawings without texels or without frames are in no batch; their maps are
    /// empty.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if a drawing is larger than the target, [`GpuError::FrameEnds`] if its frame ends are wrong.
    pub fn plan(&self, drawings: &[Drawing]) -> Result<Vec<Batch>, GpuError> {
        let mut order = Vec::with_capacity(drawings.len());
        for (index, drawing) in drawings.iter().enumerate() {
            let ends = &drawing.frame_ends;
            if !ends.is_sorted()
                || ends.last().map_or(0, |&end| end as usize) != drawing.discs.len()
            {
                return Err(GpuError::FrameEnds { drawing: index });
            }
            let longest = drawing.rect.width.max(drawing.rect.height);
            if drawing.rect.is_empty() || drawing.frames() == 0 {
                continue;
            }
            within("side of a map", longest.into(), self.side.into())?;
            order.push(index);
        }
        // Maps of similar height share shelves.
        order.sort_by_key(|&index| std::cmp::Reverse(drawings[index].rect.height));
        let mut batches: Vec<Batch> = Vec::new();
        let mut shelves = Shelves::default();
        for index in order {
            let rect = drawings[index].rect;
            let (place, begins) = shelves.place(rect, [self.side; 2]);
            if begins {
                batches.push(Batch::default());
            }
            if let Some(batch) = batches.last_mut() {
                batch.members.push((index, place));
                batch.used[0] = batch.used[0].max(place.x + rect.width);
                batch.used[1] = batch.used[1].max(place.y + rect.height);
            }
        }
        Ok(batches)
    }

    /// Records the drawing of a batch of [`Rasterizer::plan`] for these drawings, and the copy of its texels to memory that the host reads.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family. Commands that were recorded before with this
    /// rasterizer have finished.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        drawings: &[Drawing],
        batch: &Batch,
        kind: MapKind,
    ) {
        match kind {
            MapKind::EveryFrame => {
                rules::body_and_evasion(drawings, &batch.members, &mut self.draws)
            }
            MapKind::AnyFrame => rules::attack(drawings, &batch.members, &mut self.draws),
        }
        let (context, image) = (&self.context, self.screen.target.handle);
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
        // SAFETY: the caller vouches for `cmd`; the target is this rasterizer's and not in use. The buffer has a byte for every texel.
        unsafe {
            context.begin_label(cmd, c"sabaki: maps");
            self.screen
                .record_draws(context, cmd, &self.draws, batch.used, rules::START);
            context.end_label(cmd);
            context.begin_label(cmd, c"sabaki: maps to the host");
            let (drawn, copied) = (Access::STENCIL, Access::COPY_READ);
            barriers::stencil_image(context, cmd, image, drawn, copied, false);
            context.device().cmd_copy_image_to_buffer(
                cmd,
                image,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                self.texels.handle,
                &region,
            );
            barriers::memory(context, cmd, Access::TRANSFER_WRITE, Access::HOST_READ);
            context.end_label(cmd);
        }
    }

    /// Reads the maps of a batch recorded with [`MapKind::EveryFrame`] into `maps`, by the positions of the drawings.
    ///
    /// # Errors
    /// The error of an invalidate.
    ///
    /// # Safety
    /// This batch was recorded last, and it has finished on the device.
    pub unsafe fn read_every_frame(
        &self,
        drawings: &[Drawing],
        batch: &Batch,
        maps: &mut [EvasionMaps],
    ) -> Result<(), GpuError> {
        // SAFETY: the caller says that the device has finished.
        let texels = unsafe { self.read(batch) }?;
        for &(index, place) in &batch.members {
            let rect = drawings[index].rect;
            let map = |wanted| to_map(texels, batch.used[0], place, rect, wanted);
            maps[index] = EvasionMaps {
                body: map(|value| value > rules::EVASION),
                evasion: map(|value| value == rules::EVASION),
            };
        }
        Ok(())
    }

    /// Reads the maps of a batch recorded with [`MapKind::AnyFrame`] into `maps`, by the positions of the drawings.
    ///
    /// # Errors
    /// The error of an invalidate.
    ///
    /// # Safety
    /// This batch was recorded last, and it has finished on the device.
    pub unsafe fn read_any_frame(
        &self,
        drawings: &[Drawing],
        batch: &Batch,
        maps: &mut [BitMap],
    ) -> Result<(), GpuError> {
        // SAFETY: the caller says that the device has finished.
        let texels = unsafe { self.read(batch) }?;
        for &(index, place) in &batch.members {
            let is_drawn = |value| u32::from(value) > rules::START;
            let rect = drawings[index].rect;
            maps[index] = to_map(texels, batch.used[0], place, rect, is_drawn);
        }
        Ok(())
    }

    /// Stencil values of the part of the target that a batch used.
    ///
    /// # Safety
    /// The device has finished.
    unsafe fn read(&self, batch: &Batch) -> Result<&[u8], GpuError> {
        self.texels.invalidate(&self.context)?;
        let [width, height] = batch.used.map(u64::from);
        // SAFETY: the caller says that nothing is being written.
        unsafe { self.texels.bytes(width * height) }
    }

    /// Frees everything. No recorded batch may be in flight.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.free(memory);
    }

    fn free(&mut self, memory: &mut dyn Memory) {
        self.texels.destroy(&self.context, memory);
        self.screen.destroy(&self.context, memory);
        self.is_live = false;
    }
}

impl Drop for Rasterizer {
    fn drop(&mut self) {
        if self.is_live {
            tracing::error!("a Rasterizer was dropped without destroy: its Vulkan objects leak");
        }
    }
}

/// The map of the texels at a place of the target whose stencil value is `wanted`.
fn to_map(
    texels: &[u8],
    columns: u32,
    place: Place,
    rect: MapRect,
    wanted: fn(u8) -> bool,
) -> BitMap {
    let mut map = BitMap::new(rect);
    for row in 0..rect.height {
        let start = ((place.y + row) * columns + place.x) as usize;
        let values = &texels[start..start + rect.width as usize];
        for (&value, column) in values.iter().zip(0..) {
            if wanted(value) {
                map.set(column, row as i32);
            }
        }
    }
    map
}
