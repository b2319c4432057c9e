//! The stencil culling path: its pipelines, maps, target and slots.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn once into the stencil of each slab; each candidate's body map
//! is drawn over it, moved and turned into place, and an occlusion query counts the samples that pass. Differs: one query
//! spans all slabs and slices of a candidate, whose cells lie in one target (`cells.rs`). A second query counts its outer
//! map, which proves misses, and a third one its evasion map, for the score. Fragments may count instead of queries
//! (`tally.rs`).

use ash::vk;

use super::{
    atlas::Atlas,
    boxes,
    gathered::{Capacity, Gathered, MOST_BOXES},
    maps::{Maps, Part},
    slot::Slot,
    tally::{self, ByPlane},
};
use crate::{
    gpu::{
        Context, Counting, CullerDesc, GpuError, Memory, MemoryUse,
        counts::Counts,
        device_path::DevicePath,
        drivers,
        error::within,
        passes::Passes,
        pipelines::{CANDIDATES, DISCS, Pipeline, PipelineInputs, TALLY},
        resources::{Buffer, BufferDesc, StencilTarget},
    },
    query::cull::{Counted, CullInput, CullPath, Overlap},
};

/// Counts overlaps with the stencil buffer.
#[derive(Debug)]
pub(in crate::gpu) struct StencilPath {
    pub(super) context: Context,
    pub(super) parts: Parts,
    pub(super) gathered: Gathered,
    pub(super) capacity: Capacity,
    maps: Maps,
    pub(super) counting: Counting,
    pub(super) by_plane: ByPlane,
}

#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) discs: Pipeline,
    pub(super) candidates: Pipeline,
    pub(super) target: StencilTarget,
    pub(super) atlas: Atlas,
    /// Of the sets in which fragments count.
    tally: tally::Layout,
    /// Of as many boxes as a draw has.
    pub(super) indices: Buffer,
    pub(super) slots: Vec<Slot>,
}

impl StencilPath {
    /// Creates pipelines and memory. Leaves nothing behind when it fails.
    pub(in crate::gpu) fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        let settings = desc.stencil;
        context.runs(CullPath::Stencil)?;
        let counting = StencilPath::counting(context, desc);
        if counting == Counting::Atomics && !context.features().fragment_atomics {
            return Err(GpuError::Missing(vec!["fragmentStoresAndAtomics"]));
        }
        // Places in a target are numbers of 16 bits with a sign.
        let most = context.max_target_side().min(1 << 14);
        let boxes = settings.max_boxes.min(MOST_BOXES);
        let capacity = Capacity {
            candidates: desc.max_candidates,
            discs: settings.max_discs,
            boxes,
            queries: settings.max_queries.min(boxes).max(1),
            target: settings.target.map(|side| side.clamp(1, most)),
        };
        let mut path = Self {
            context: context.clone(),
            parts: Parts::default(),
            gathered: Gathered::default(),
            maps: Maps::new(desc.atlas)?,
            counting,
            by_plane: ByPlane::default(),
            capacity,
        };
        match path.fill(memory, desc) {
            Ok(()) => {
                // The staging buffer has them now.
                path.maps.forget_words();
                Ok(path)
            }
            Err(error) => {
                path.destroy(memory);
                Err(error)
            }
        }
    }

    /// The way of counting that a description asks for, or that is known to be fast on the driver.
    pub(in crate::gpu) fn counting(context: &Context, desc: &CullerDesc<'_>) -> Counting {
        let known = || drivers::counting(context.driver(), context.features());
        desc.stencil.counting.unwrap_or_else(known)
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let (context, parts, name) = (&self.context, &mut self.parts, desc.name);
        let atlas = format!("{name}: atlas");
        parts
            .atlas
            .fill(context, memory, &atlas, self.maps.words())?;
        let indices = boxes::indices();
        let bytes: &[u8] = bytemuck::cast_slice(&indices);
        let of_boxes = BufferDesc {
            name: &format!("{name}: indices"),
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::INDEX_BUFFER,
            memory: MemoryUse::Upload,
        };
        parts.indices = Buffer::new(context, memory, of_boxes)?;
        parts.indices.write(context, 0, bytes)?;
        let inputs = PipelineInputs {
            cache: desc.pipeline_cache,
            ..PipelineInputs::default()
        };
        parts.discs = Pipeline::new(context, &DISCS, &inputs)?;
        let slots = desc.frames_in_flight.max(1);
        parts.candidates = match self.counting {
            Counting::Queries => {
                let sets = &[parts.atlas.layout];
                Pipeline::new(context, &CANDIDATES, &PipelineInputs { sets, ..inputs })?
            }
            Counting::Atomics => {
                parts.tally.fill(context, slots)?;
                let sets = &[parts.tally.layout];
                Pipeline::new(context, &TALLY, &PipelineInputs { sets, ..inputs })?
            }
        };
        let target = format!("{name}: attack");
        parts.target = StencilTarget::new(context, memory, &target, self.capacity.target)?;
        for slot in 0..slots {
            let name = format!("{name}: slot {slot}");
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill(context, memory, &name, (&self.capacity, self.counting))?;
                if self.counting == Counting::Atomics {
                    slot.sums.make_set(context, (&parts.tally, &parts.atlas))?;
                }
            }
        }
        Ok(())
    }
}

impl DevicePath for StencilPath {
    fn gather(&mut self, input: &CullInput<'_>, counted: Counted) -> Result<(), GpuError> {
        let wanted = (input, counted);
        self.gathered.fill(wanted, &self.maps, &self.capacity)?;
        match self.counting {
            Counting::Queries => {
                let queries = self.gathered.queries.len() as u64;
                let most = drivers::most_queries(self.context.driver());
                within("the driver's queries in one submission", queries, most)
            }
            Counting::Atomics => {
                let Gathered {
                    cells,
                    draws,
                    corners,
                    ..
                } = &self.gathered;
                self.by_plane.fill(&cells.planes, draws, corners);
                Ok(())
            }
        }
    }

    fn write(&mut self, slot: usize) -> Result<(), GpuError> {
        let slot = &mut self.parts.slots[slot];
        slot.note_queries(&self.gathered.queries);
        let corners = match self.counting {
            Counting::Queries => &self.gathered.corners,
            Counting::Atomics => &self.by_plane.corners,
        };
        let discs = bytemuck::cast_slice(&self.gathered.cells.discs);
        slot.discs.write(&self.context, 0, discs)?;
        let corners = bytemuck::cast_slice(corners);
        slot.corners.write(&self.context, 0, corners)
    }

    unsafe fn record(&self, passes: &mut Passes<'_>, slot: usize) {
        // SAFETY: the caller vouches for the command buffer and the slot.
        unsafe { self.record_commands(passes, &self.parts.slots[slot]) };
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
        let (context, parts) = (&self.context, &mut self.parts);
        for slot in &mut parts.slots {
            slot.destroy(context, memory);
        }
        parts.target.destroy(context, memory);
        parts.candidates.destroy(context);
        parts.discs.destroy(context);
        parts.indices.destroy(context, memory);
        parts.tally.destroy(context);
        parts.atlas.destroy(context, memory);
    }
}
