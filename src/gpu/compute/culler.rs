//! The `compute` culling path. CPU twin: `src/query/cull/cpu.rs`.
//!
//! Source: Masaoka & Oshita, section 5.3, for what is counted. Differs: a compute shader counts it, from planes of bits in
//! place of a stencil buffer: an invocation a candidate, which walks the attack block by block of texels.

use std::sync::atomic::Ordering;

use ash::vk;

use super::{
    gathered::{Capacity, Gathered},
    planes::Planes,
    slot::Slot,
};
use crate::{
    gpu::{
        Context, GpuError, Memory, Mismatch,
        barriers::Access,
        pipelines::{COUNT, Pipeline},
        shader_table::COUNTS,
        uploaded::{Upload, Uploaded},
    },
    maps::RegionAtlas,
    query::cull::{Counted, CullInput, Overlap},
};

/// How a cull's input comes to the shaders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InputWay {
    /// Through a staging buffer, by a copy: for devices with memory of their own, which every candidate would otherwise
    /// read the attack across.
    #[default]
    Staged,
    /// Shaders read the memory that the host has written: for devices that share the host's memory.
    Direct,
}

/// How a [`Culler`] is made. Memory grows with every maximum.
#[derive(Clone, Copy, Debug)]
pub struct CullerDesc<'a> {
    /// For debuggers and validation.
    pub name: &'a str,
    /// The maps of all evasions; they are copied.
    pub atlas: &'a RegionAtlas,
    /// What is counted. Default: everything.
    pub counted: Counted,
    /// Candidates in one cull. With more, record several.
    pub max_candidates: u32,
    /// Blocks of 8 × 4 texels that an attack is in, as wide as those of the evasions, over all slabs, clocks and slices, of inner and outer maps; those of the inner
    /// maps, all slices in one, once more.
    pub max_blocks: u32,
    /// Work groups in one dispatch, where the device takes as many; a larger cull is recorded as several dispatches.
    pub max_groups: u32,
    /// Bytes of maps that are bound at a time, where the device reads as many from one buffer (at least 128 MiB); larger
    /// maps are bound in turn, evasion by evasion.
    pub max_page: u64,
    /// How input comes to the shaders.
    pub input: InputWay,
    /// Culls that can be recorded before the first one's results have been read.
    pub frames_in_flight: u32,
}

impl<'a> CullerDesc<'a> {
    /// 4,096 candidates; attacks of 32,768 blocks of texels; groups and bytes of maps as many as the device takes; staged; 2 in flight.
    #[must_use]
    pub fn new(name: &'a str, atlas: &'a RegionAtlas) -> Self {
        Self {
            name,
            atlas,
            counted: Counted::default(),
            max_candidates: 4096,
            max_blocks: 32_768,
            max_groups: u32::MAX,
            max_page: u64::MAX,
            input: InputWay::default(),
            frames_in_flight: 2,
        }
    }
}

/// A cull that has been recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    slot: u32,
    serial: u32,
    candidates: u32,
}

/// Counts overlaps with a compute shader.
///
/// A slot is one cull in flight: [`Culler::record`] into a slot, submit, and [`Culler::poll`] until the results are there.
#[derive(Debug)]
pub struct Culler {
    pub(super) context: Context,
    pub(super) parts: Parts,
    pub(super) gathered: Gathered,
    pub(super) capacity: Capacity,
    planes: Planes,
    counted: Counted,
    upload: Upload,
}

#[derive(Debug, Default)]
pub(super) struct Parts {
    /// For turns that make blocks no larger, and for all others.
    pub(super) pipelines: [Pipeline; 2],
    pub(super) atlas: Uploaded,
    pub(super) slots: Vec<Slot>,
    pub(super) layout: vk::DescriptorSetLayout,
    pub(super) pool: vk::DescriptorPool,
    live: bool,
}

impl Culler {
    /// Makes pipeline and memory. Leaves nothing behind when it fails.
    ///
    /// # Errors
    /// A Vulkan call's, the allocator's, [`GpuError::Limit`] where the maps or a maximum are more than the device offers,
    /// [`GpuError::Missing`] where the context's queue family does not compute.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        computes(context)?;
        let limits = context.limits();
        let most = [
            (
                "maxStorageBufferRange",
                limits.max_storage_buffer_range.into(),
            ),
            ("CullerDesc::max_page", desc.max_page),
        ];
        let page = if most[1].1 < most[0].1 {
            most[1]
        } else {
            most[0]
        };
        let planes = Planes::new(desc.atlas, page)?;
        let capacity = Capacity {
            candidates: desc.max_candidates,
            blocks: desc.max_blocks,
            groups: desc
                .max_groups
                .clamp(1, limits.max_compute_work_group_count[0]),
        };
        let mut culler = Self {
            context: context.clone(),
            parts: Parts::default(),
            gathered: Gathered::default(),
            capacity,
            planes,
            counted: desc.counted,
            upload: Upload::default(),
        };
        match culler.fill(memory, desc) {
            Ok(()) => {
                // The staging buffer has them now.
                culler.planes.words = Vec::new();
                Ok(culler)
            }
            Err(error) => {
                culler.free(memory);
                Err(error)
            }
        }
    }

    fn fill(&mut self, memory: &mut dyn Memory, desc: &CullerDesc<'_>) -> Result<(), GpuError> {
        let (context, parts, name) = (&self.context, &mut self.parts, desc.name);
        parts.live = true;
        let words = bytemuck::cast_slice(&self.planes.words);
        let atlas = format!("{name}: atlas");
        parts.atlas.fill(context, memory, &atlas, words)?;
        parts.make_layout(context)?;
        for (pipeline, may_be_large) in parts.pipelines.iter_mut().zip([0, 1]) {
            let constants = [self.planes.grid.attack_pitch, may_be_large];
            *pipeline = Pipeline::specialized(context, &COUNT, &[parts.layout], &constants)?;
        }
        for slot in 0..desc.frames_in_flight.max(1) {
            let name = format!("{name}: slot {slot}");
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill(context, memory, &name, (&self.capacity, desc.input))?;
            }
        }
        parts.make_sets(context, &self.capacity, &self.planes.pages)
    }

    /// What culls count from now on: those that are recorded already do not change.
    pub fn count_only(&mut self, counted: Counted) {
        self.counted = counted;
    }

    /// What the next cull counts.
    #[must_use]
    pub fn counted(&self) -> Counted {
        self.counted
    }

    /// Records the upload of the maps, at a time of the caller's choice; when it has finished,
    /// [`Culler::release_staging`] says so. Otherwise culls carry it, until the first one's counts have been polled.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family, and runs before any cull.
    pub unsafe fn record_upload(&mut self, cmd: vk::CommandBuffer) {
        if !*self.upload.done.get_mut() {
            let reader = Access::COMPUTE_READ;
            // SAFETY: the caller vouches for `cmd`; staging is released after the upload only.
            unsafe { self.parts.atlas.record(&self.context, cmd, reader) };
            self.upload.recorded = true;
        }
    }

    /// Frees the staging buffer of the maps, which is idle from then on. Does nothing before the upload was recorded.
    ///
    /// # Safety
    /// A command buffer with the upload has finished, and no other one that carries it is in flight or will be submitted.
    pub unsafe fn release_staging(&mut self, memory: &mut dyn Memory) {
        if self.upload.recorded {
            *self.upload.done.get_mut() = true;
            self.parts.atlas.release_staging(&self.context, memory);
        }
    }

    /// Records a whole cull into the caller's command buffer. It neither submits nor waits, and allocates nothing once it
    /// has recorded as much.
    ///
    /// The barriers that it records, in order: the copy of the input before the shader's reads (where input is staged); the
    /// shader's counts before the fill of their number; both before the host's reads. It leaves its own compute pipeline,
    /// descriptor set 0 and push constants bound.
    ///
    /// # Errors
    /// [`GpuError::Limit`] names the maximum that the input exceeds, [`GpuError::Mismatch`] what does not fit the uploaded
    /// atlas; nothing is recorded then, and `cpu` culls the same input.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family. It is submitted once at most, on
    /// the same queue as all culls of this culler. What was recorded into this slot before has finished, or will never be
    /// submitted.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        slot: u32,
        input: &CullInput<'_>,
    ) -> Result<Ticket, GpuError> {
        let slots = self.parts.slots.len() as u32;
        if slot >= slots {
            return Err(Mismatch::Slot { slot, slots }.into());
        }
        let wanted = (input, self.counted);
        self.gathered.fill(wanted, &self.planes, &self.capacity)?;
        let place = &mut self.parts.slots[slot as usize];
        place.write(&self.context, &self.gathered, &self.capacity)?;
        place.uploads = !*self.upload.done.get_mut();
        place.sums = self.gathered.sums();
        place.counted = self.counted;
        let serial = place.counts.start();
        // SAFETY: the caller vouches for `cmd`, and for the slot being free.
        unsafe {
            self.record_upload(cmd);
            self.record_commands(cmd, &self.parts.slots[slot as usize]);
        }
        Ok(Ticket {
            slot,
            serial,
            candidates: input.candidates.len() as u32,
        })
    }

    /// Whether a cull's counts are there; if so they are in `overlaps`, in the order of the candidates. Never waits.
    ///
    /// The device writes the cull's number after its counts, and this looks for the number. A caller that wants Vulkan's
    /// full guarantee polls after it has seen the submission's fence or timeline semaphore.
    ///
    /// # Errors
    /// [`Mismatch::Ticket`] when the slot holds another cull; an invalidate that failed.
    pub fn poll(&self, ticket: Ticket, overlaps: &mut Vec<Overlap>) -> Result<bool, GpuError> {
        let slot = self.parts.slots.get(ticket.slot as usize);
        let slot = slot.ok_or(Mismatch::Ticket)?;
        let candidates = ticket.candidates as usize;
        let words = slot.sums as usize * candidates * COUNTS;
        let Some(mut words) = slot.counts.read(&self.context, ticket.serial, words)? else {
            return Ok(false);
        };
        if slot.uploads {
            self.upload.done.store(true, Ordering::Relaxed);
        }
        overlaps.clear();
        overlaps.resize(candidates, Overlap::default());
        for _ in 0..slot.sums {
            for overlap in &mut *overlaps {
                let mut next = || words.next().unwrap_or(0);
                overlap.body += next();
                overlap.outer += next();
                overlap.evasion += next();
            }
        }
        if !slot.counted.outer {
            overlaps.iter_mut().for_each(|one| one.outer = u32::MAX);
        }
        Ok(true)
    }

    /// Candidates in one cull at most.
    #[must_use]
    pub fn max_candidates(&self) -> u32 {
        self.capacity.candidates
    }

    /// Culls in flight at most.
    #[must_use]
    pub fn slots(&self) -> u32 {
        self.parts.slots.len() as u32
    }

    /// Frees everything. The device must be done with what was recorded.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.free(memory);
    }

    fn free(&mut self, memory: &mut dyn Memory) {
        let (context, parts) = (&self.context, &mut self.parts);
        for slot in &mut parts.slots {
            slot.destroy(context, memory);
        }
        for pipeline in &mut parts.pipelines {
            pipeline.destroy(context);
        }
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            let device = context.device();
            device.destroy_descriptor_pool(parts.pool, None);
            device.destroy_descriptor_set_layout(parts.layout, None);
        }
        parts.atlas.destroy(context, memory);
        parts.live = false;
    }
}

impl Drop for Culler {
    fn drop(&mut self) {
        if self.parts.live {
            tracing::error!("a Culler was dropped without destroy: its Vulkan objects leak");
        }
    }
}

/// Whether the context's queue family takes dispatches. Not every one with graphics has to.
fn computes(context: &Context) -> Result<(), GpuError> {
    if context.queue_has(vk::QueueFlags::COMPUTE) {
        return Ok(());
    }
    Err(GpuError::Missing(vec!["compute on the queue family"]))
}
