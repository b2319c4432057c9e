//! The compute culling path: its pipeline, maps and slots.
//!
//! Source: Masaoka & Oshita, section 5.3, for what is counted. Differs: a compute shader counts it, from planes of bits
//! instead of a stencil buffer. One invocation counts one candidate; it walks the attack block by block.

use ash::vk;

use super::{
    commands::BINDINGS,
    gathered::{Capacity, Gathered},
    planes::Planes,
    slot::Slot,
};
use crate::math::parallel::both;
use crate::{
    gpu::{
        Context, CullerDesc, GpuError, Memory,
        barriers::Access,
        counts::Counts,
        descriptors::DescriptorSets,
        device_path::{self, DevicePath},
        error::within,
        pipelines::{COUNT, Pipeline},
        resources::DeviceMemory,
        shader_table::COUNTS,
        uploaded::Uploaded,
    },
    query::cull::{Counted, CullInput, CullPath, Overlap},
};

/// Counts overlaps with a compute shader.
#[derive(Debug)]
pub(in crate::gpu) struct ComputePath {
    pub(super) context: Context,
    pub(super) pipeline: Pipeline,
    pub(super) atlas: Uploaded,
    pub(super) slots: Vec<Slot>,
    pub(super) sets: DescriptorSets,
    /// Input of each entry of a batch.
    pub(super) gathered: Vec<Gathered>,
    pub(super) capacity: Capacity,
    pub(super) planes: Planes,
}

impl ComputePath {
    /// Creates pipelines and memory. Frees everything if it fails.
    pub(in crate::gpu) fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        context.runs(CullPath::Compute)?;
        // A group has at least one candidate.
        let most_groups = context.limits().max_compute_work_group_count[0];
        let (most, groups) = (desc.max_candidates.into(), most_groups.into());
        within("maxComputeWorkGroupCount", most, groups)?;
        let mut path = Self {
            context: context.clone(),
            pipeline: Pipeline::default(),
            atlas: Uploaded::default(),
            slots: Vec::new(),
            sets: DescriptorSets::default(),
            gathered: vec![Gathered::default()],
            capacity: Self::capacity(desc),
            planes: Planes::default(),
        };
        match path.fill(memory, desc) {
            Ok(()) => {
                // The planes are in a buffer now.
                path.planes.forget_layouts();
                Ok(path)
            }
            Err(error) => {
                path.destroy(memory);
                Err(error)
            }
        }
    }

    fn capacity(desc: &CullerDesc<'_>) -> Capacity {
        Capacity {
            candidates: desc.max_candidates,
            blocks: desc.max_blocks,
        }
    }

    /// Memory of a culler of this description with the staging buffer of the maps, in bytes.
    pub(in crate::gpu) fn bytes(desc: &CullerDesc<'_>) -> u64 {
        let maps = 8 * Planes::new(desc.atlas).words as u64;
        let slots = u64::from(desc.frames_in_flight.max(1));
        maps + slots * Slot::bytes(&Self::capacity(desc))
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let (context, name) = (&self.context, desc.name);
        self.planes = Planes::new(desc.atlas);
        let stages = vk::ShaderStageFlags::COMPUTE;
        let bindings = BINDINGS.map(|kind| (kind, stages));
        self.sets.make_layout(context, &bindings)?;
        let (planes, sets, cache) = (&self.planes, [self.sets.layout], desc.pipeline_cache);
        let pipeline = &mut self.pipeline;
        // The planes are drawn on other threads while the driver compiles.
        let write = |out: &mut [u32]| {
            let make = || Pipeline::new(context, &COUNT, &sets, cache);
            let (_, made) = both(|| planes.write(desc.atlas, out), make);
            *pipeline = made?;
            Ok(())
        };
        let atlas = format!("{name}: atlas");
        let mut device = DeviceMemory { context, memory };
        let words = planes.words;
        self.atlas.fill(&mut device, &atlas, words, write)?;
        for slot in 0..desc.frames_in_flight.max(1) {
            let name = format!("{name}: slot {slot}");
            // Stored before it is filled, so that it is freed after a failure.
            self.slots.push(Slot::default());
            if let Some(slot) = self.slots.last_mut() {
                slot.fill(&mut device, &name, &self.capacity)?;
            }
        }
        self.make_sets()
    }
}

impl DevicePath for ComputePath {
    fn gather(
        &mut self,
        entry: usize,
        input: &CullInput<'_>,
        counted: Counted,
    ) -> Result<(), GpuError> {
        let gathered = device_path::entry(&mut self.gathered, entry);
        gathered.fill(input, counted, &self.planes, &self.capacity)
    }

    fn write(&mut self, entry: usize, slot: usize) -> Result<(), GpuError> {
        let (slot, gathered) = (&mut self.slots[slot], &self.gathered[entry]);
        slot.counts.start();
        slot.sums = gathered.sums();
        slot.candidates = gathered.candidates.len() as u32;
        slot.write(&self.context, gathered, &self.capacity)
    }

    unsafe fn record(&self, cmd: vk::CommandBuffer, slots: &[usize]) {
        // SAFETY: the caller vouches for the command buffer and the slots.
        unsafe { self.record_commands(cmd, slots) };
    }

    fn counts(&self, slot: usize) -> &Counts {
        &self.slots[slot].counts
    }

    fn words(&self, slot: usize) -> usize {
        let slot = &self.slots[slot];
        slot.sums as usize * slot.candidates as usize * COUNTS
    }

    fn add(&self, slot: usize, words: &mut dyn Iterator<Item = u32>, overlaps: &mut [Overlap]) {
        for _ in 0..self.slots[slot].sums {
            for overlap in &mut *overlaps {
                let mut next = || words.next().unwrap_or(0);
                overlap.body += next();
                overlap.outer += next();
                overlap.evasion += next();
            }
        }
    }

    unsafe fn record_upload(&self, cmd: vk::CommandBuffer) {
        // SAFETY: the caller vouches for `cmd` and staging.
        unsafe {
            self.atlas.record(&self.context, cmd, Access::COMPUTE_READ);
        };
    }

    fn release_staging(&mut self, memory: &mut dyn Memory) {
        self.atlas.release_staging(&self.context, memory);
    }

    fn destroy(&mut self, memory: &mut dyn Memory) {
        let context = &self.context;
        for slot in &mut self.slots {
            slot.destroy(context, memory);
        }
        self.pipeline.destroy(context);
        self.sets.destroy(context);
        self.atlas.destroy(context, memory);
    }
}
