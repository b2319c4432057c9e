//! The stencil culling path: its pipelines, maps, target and slots.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn once into the stencil of each slab; each candidate's body map
//! is drawn over it, transformed into the attack's frame, and an occlusion query counts the samples that pass. Differs: one query
//! spans all slabs and slices of a candidate, whose cells lie in one target (`cells.rs`). A second query counts its outer
//! map, which proves misses, and a third one its evasion map, for the score.

use ash::vk;

use super::{
    atlas::Atlas,
    boxes,
    gathered::{Capacity, Gathered},
    maps::{Maps, Part},
    slot::{Slot, SlotDesc},
};
use crate::math::parallel::both;
use crate::{
    gpu::{
        Context, CullerDesc, GpuError, Memory, MemoryUse,
        counts::Counts,
        device_path::{CullRequest, DevicePath},
        drivers,
        error::{Named, within},
        passes::Passes,
        pipelines::{CANDIDATES, DISCS, Pipeline, PipelineInputs},
        resources::{Buffer, BufferDesc, DeviceMemory, StencilTarget},
        uploaded::MapWords,
    },
    query::cull::{CullPath, Overlap},
};

/// Counts overlaps with the stencil buffer.
#[derive(Debug)]
pub(in crate::gpu) struct StencilPath {
    pub(super) context: Context,
    pub(super) parts: Parts,
    /// Input of each entry of a batch.
    pub(super) entries: Vec<Gathered>,
    pub(super) capacity: Capacity,
    maps: Maps,
}

#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) discs: Pipeline,
    pub(super) candidates: Pipeline,
    pub(super) target: StencilTarget,
    pub(super) atlas: Atlas,
    /// Index buffer for the maximum number of boxes of a draw.
    pub(super) indices: Buffer,
    pub(super) slots: Vec<Slot>,
    /// Occlusion query pool of all slots. Vulkan executes a reset after earlier commands that use the same queries, so that slots can share
    /// it.
    pub(super) pool: vk::QueryPool,
}

impl StencilPath {
    /// Creates pipelines and memory. On failure everything is freed again.
    pub(in crate::gpu) fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        context.runs(CullPath::Stencil)?;
        let mut parts = Parts::default();
        // The maps are packed on another thread while the driver compiles.
        let (maps, pipelines) = both(
            || Maps::new(desc.atlas),
            || parts.make_pipelines(context, desc),
        );
        let maps = match pipelines.and(maps) {
            Ok(maps) => maps,
            Err(error) => {
                parts.destroy(context, memory);
                return Err(error);
            }
        };
        let mut path = Self {
            context: context.clone(),
            parts,
            entries: vec![Gathered::default()],
            capacity: Self::capacity(context, desc),
            maps,
        };
        match path.fill(memory, desc) {
            Ok(()) => Ok(path),
            Err(error) => {
                path.destroy(memory);
                Err(error)
            }
        }
    }

    /// Capacity of a description, limited to that of the device.
    fn capacity(context: &Context, desc: &CullerDesc<'_>) -> Capacity {
        let settings = desc.stencil;
        let most = context.max_target_side().min(boxes::MOST_SIDE);
        let boxes = settings.max_boxes;
        Capacity {
            candidates: desc.max_candidates,
            discs: settings.max_discs,
            boxes,
            queries: settings.max_queries.min(boxes).max(1),
            target: settings.target.map(|side| side.clamp(1, most)),
        }
    }

    /// Memory of a culler of this description with the staging buffer of the maps, in bytes.
    pub(in crate::gpu) fn bytes(context: &Context, desc: &CullerDesc<'_>) -> Result<u64, GpuError> {
        let maps = Maps::new(desc.atlas)?;
        let capacity = Self::capacity(context, desc);
        let maps = 8 * maps.word_count() as u64;
        let indices = 2 * boxes::indices().len() as u64;
        let [columns, rows] = capacity.target.map(u64::from);
        let texel = match context.stencil_format() {
            vk::Format::S8_UINT => 1,
            vk::Format::D24_UNORM_S8_UINT => 4,
            _ => 8,
        };
        let slots = u64::from(desc.frames_in_flight.max(1));
        Ok(maps + indices + columns * rows * texel + slots * Slot::bytes(&capacity))
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let (context, parts, name) = (&self.context, &mut self.parts, desc.name);
        let atlas = format!("{name}: atlas");
        let mut device = DeviceMemory { context, memory };
        let maps = &self.maps;
        let words = MapWords {
            read_as: vk::BufferUsageFlags::STORAGE_BUFFER,
            count: maps.word_count(),
            write: |out: &mut [u32]| {
                Maps::write(desc.atlas, out);
                Ok(())
            },
        };
        parts.atlas.fill(&mut device, &atlas, words)?;
        let indices = boxes::indices();
        let bytes: &[u8] = bytemuck::cast_slice(&indices);
        let of_boxes = BufferDesc {
            name: &format!("{name}: indices"),
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::INDEX_BUFFER,
            memory: MemoryUse::Upload,
        };
        parts.indices = device.buffer(of_boxes)?;
        parts.indices.write(context, 0, bytes)?;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::OCCLUSION)
            .query_count(self.capacity.queries);
        // SAFETY: the context's device is valid.
        parts.pool =
            unsafe { context.device().create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        context.name(parts.pool, &format!("{name}: queries"));
        let target = format!("{name}: attack");
        parts.target = StencilTarget::new(&mut device, &target, self.capacity.target)?;
        for slot in 0..desc.frames_in_flight.max(1) {
            let name = format!("{name}: slot {slot}");
            let desc = SlotDesc {
                name: &name,
                capacity: &self.capacity,
            };
            // Stored before it is filled, so that it is freed after a failure.
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill(&mut device, &desc)?;
            }
        }
        Ok(())
    }
}

impl Parts {
    /// Creates the pipelines and the layouts of their descriptor sets.
    fn make_pipelines(&mut self, context: &Context, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let inputs = PipelineInputs {
            cache: desc.pipeline_cache,
            ..PipelineInputs::default()
        };
        self.discs = Pipeline::new(context, &DISCS, &inputs)?;
        self.atlas.make_layout(context)?;
        let sets = &[self.atlas.layout];
        let inputs = PipelineInputs { sets, ..inputs };
        self.candidates = Pipeline::new(context, &CANDIDATES, &inputs)?;
        Ok(())
    }

    /// Frees everything. The device must no longer use it.
    fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        for slot in &mut self.slots {
            slot.destroy(context, memory);
        }
        // SAFETY: the handle is null or was made from this device, which the caller says is done with it.
        unsafe { context.device().destroy_query_pool(self.pool, None) };
        self.target.destroy(context, memory);
        self.candidates.destroy(context);
        self.discs.destroy(context);
        self.indices.destroy(context, memory);
        self.atlas.destroy(context, memory);
    }
}

impl DevicePath for StencilPath {
    fn gather(&mut self, entry: usize, request: CullRequest<'_>) -> Result<(), GpuError> {
        if self.entries.len() <= entry {
            self.entries.resize_with(entry + 1, Gathered::default);
        }
        self.entries[entry].fill(request, &self.maps, &self.capacity)?;
        let entries = self.entries[..=entry].iter();
        let queries = entries.map(|one| one.queries.len() as u64).sum();
        let most = drivers::most_queries(self.context.driver());
        within("the driver's queries in one submission", queries, most)
    }

    fn write(&mut self, entry: usize, slot: usize) -> Result<(), GpuError> {
        let gathered = &self.entries[entry];
        let slot = &mut self.parts.slots[slot];
        slot.note_queries(&gathered.queries);
        let discs = bytemuck::cast_slice(&gathered.cells.discs);
        slot.discs.write(&self.context, 0, discs)?;
        let corners = bytemuck::cast_slice(&gathered.corners);
        slot.corners.write(&self.context, 0, corners)
    }

    unsafe fn record(&self, passes: &mut Passes<'_>, slots: &[usize]) {
        // SAFETY: the caller vouches for the command buffer and the slots.
        unsafe { self.record_commands(passes, slots) };
    }

    fn counts(&self, slot: usize) -> &Counts {
        &self.parts.slots[slot].counts
    }

    fn counts_mut(&mut self, slot: usize) -> &mut Counts {
        &mut self.parts.slots[slot].counts
    }

    fn words(&self, slot: usize) -> usize {
        self.parts.slots[slot].queries.len()
    }

    fn add(&self, slot: usize, words: &mut dyn Iterator<Item = u32>, overlaps: &mut [Overlap]) {
        let queries = &self.parts.slots[slot].queries;
        for (&(candidate, part), count) in queries.iter().zip(words) {
            let overlap = &mut overlaps[candidate as usize];
            let sum = match part {
                Part::Body => &mut overlap.body,
                Part::Outer => &mut overlap.outer,
                Part::Evasion => &mut overlap.evasion,
            };
            *sum = sum.saturating_add(count);
        }
    }

    unsafe fn record_upload(&self, cmd: vk::CommandBuffer) {
        // SAFETY: the caller vouches for `cmd` and staging.
        unsafe { self.parts.atlas.record_upload(&self.context, cmd) };
    }

    fn release_staging(&mut self, memory: &mut dyn Memory) {
        self.parts.atlas.release_staging(&self.context, memory);
    }

    fn destroy(&mut self, memory: &mut dyn Memory) {
        self.parts.destroy(&self.context, memory);
    }
}
