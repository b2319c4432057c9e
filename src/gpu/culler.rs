//! Culling on the device: one culler over the stencil path and the compute path. CPU twin: `src/query/cull/cpu.rs`.

use std::sync::atomic::Ordering;

use ash::vk;

use super::{
    Context, CullerDesc, GpuError, Memory, compute::ComputePath, device_path::DevicePath,
    error::within, stencil::StencilPath, uploaded::Upload,
};
use crate::query::cull::{Counted, CullCandidate, CullInput, CullPath, Overlap};

/// Identifies a recorded cull.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    slot: u32,
    serial: u32,
    candidates: u32,
}

/// A cull of a batch.
#[derive(Clone, Copy, Debug)]
pub struct BatchEntry<'a> {
    /// Slot that the cull is recorded into. No two entries have the same slot.
    pub slot: u32,
    /// Attack maps and candidates.
    pub input: CullInput<'a>,
    /// Ticket of the recorded cull; `None` before recording.
    pub ticket: Option<Ticket>,
}

/// Counts overlaps of attack and candidate maps on the device, by the stencil path or the compute path.
///
/// A slot is one cull in flight: [`Culler::record`] into a slot, submit, and [`Culler::poll`] until the counts are there.
#[derive(Debug)]
pub struct Culler {
    context: Context,
    path: CullPath,
    implementation: Box<dyn DevicePath>,
    /// For each slot, whether the commands of the cull that was recorded last upload the maps.
    uploads: Vec<bool>,
    regions: usize,
    max_candidates: u32,
    counts_exact: bool,
    counted: Counted,
    upload: Upload,
    /// Scratch: slots of the batch that is being recorded.
    batch: Vec<usize>,
    is_live: bool,
}

impl Culler {
    /// Creates pipelines and allocates memory. On failure everything is freed again.
    ///
    /// # Errors
    /// Errors of Vulkan calls and of the allocator; [`GpuError::Limit`] if the maps or a maximum exceed a limit of the device;
    /// [`GpuError::Missing`] if the context lacks a requirement of the path; [`GpuError::NotADevicePath`] if [`CullerDesc::path`] is not
    /// a path of the device.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        let (frames, most) = (desc.frames_in_flight, CullerDesc::MOST_FRAMES);
        within("CullerDesc::frames_in_flight", frames.into(), most.into())?;
        let implementation: Box<dyn DevicePath> = match desc.path {
            CullPath::Stencil => Box::new(StencilPath::new(context, memory, desc)?),
            CullPath::Compute => Box::new(ComputePath::new(context, memory, desc)?),
            other => return Err(GpuError::NotADevicePath(other)),
        };
        let by_queries = desc.path == CullPath::Stencil;
        Ok(Self {
            context: context.clone(),
            path: desc.path,
            implementation,
            uploads: vec![false; desc.frames_in_flight.max(1) as usize],
            regions: desc.atlas.regions().len(),
            max_candidates: desc.max_candidates,
            counts_exact: !by_queries || context.features().precise_queries,
            counted: desc.counted,
            upload: Upload::default(),
            batch: Vec::new(),
            is_live: true,
        })
    }

    /// Memory that a culler needs, in bytes, including the staging buffer of the maps, which [`Culler::release_staging`] frees; there is
    /// none if the device's memory is mapped. It leaves out the allocator's rounding, and the driver's memory for query pools, descriptors
    /// and pipelines.
    ///
    /// # Errors
    /// As for [`Culler::new`], if the maps exceed a limit of the device.
    pub fn bytes(context: &Context, desc: &CullerDesc<'_>) -> Result<u64, GpuError> {
        match desc.path {
            CullPath::Stencil => StencilPath::bytes(context, desc),
            CullPath::Compute => Ok(ComputePath::bytes(desc)),
            other => Err(GpuError::NotADevicePath(other)),
        }
    }

    /// The culling path.
    pub fn path(&self) -> CullPath {
        self.path
    }

    /// Whether the numbers of an [`Overlap`] are exact counts. Without precise queries a number is 0 for no overlap and not 0 for some
    /// overlap, which is enough to remove candidates but not to score them.
    pub fn counts_exact(&self) -> bool {
        self.counts_exact
    }

    /// Maximum number of candidates of a cull.
    pub fn max_candidates(&self) -> u32 {
        self.max_candidates
    }

    /// Maximum number of culls in flight.
    pub fn slots(&self) -> u32 {
        self.uploads.len() as u32
    }

    /// Parts of the overlaps that are counted.
    pub fn counted(&self) -> Counted {
        self.counted
    }

    /// Records the upload of the maps at a time of the caller's choice. The caller reports its end with [`Culler::release_staging`].
    /// Without it, every cull records the upload until the counts of one cull have been polled.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family, and runs before any cull.
    pub unsafe fn record_upload(&mut self, cmd: vk::CommandBuffer) {
        if !*self.upload.done.get_mut() {
            // SAFETY: the caller vouches for `cmd`; staging is released after the upload only.
            unsafe {
                self.context.begin_label(cmd, c"sabaki: upload of the maps");
                self.implementation.record_upload(cmd);
                self.context.end_label(cmd);
            }
            self.upload.recorded = true;
        }
    }

    /// Frees the staging buffer of the maps. Does nothing before the upload was recorded.
    ///
    /// # Safety
    /// A command buffer with the upload has finished, and no other command buffer with the upload is in flight or will be submitted.
    pub unsafe fn release_staging(&mut self, memory: &mut dyn Memory) {
        if self.upload.recorded {
            *self.upload.done.get_mut() = true;
            self.implementation.release_staging(memory);
        }
    }

    /// Records a cull into the caller's command buffer. It does not submit, does not wait, and allocates nothing after
    /// recording a cull of the same size once.
    ///
    /// All barriers are recorded with the cull; the last one makes the counts visible to the host. The [contract](super) lists the state
    /// that stays bound.
    ///
    /// # Errors
    /// [`GpuError::Limit`] names the maximum that the input exceeds, [`GpuError::NoSuchRegion`] a candidate that does not fit the uploaded
    /// atlas. Nothing is recorded then, and [`cpu`](crate::query::cull::cpu) counts the same input.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering and of occlusion queries, for a queue of the context's family. It is
    /// submitted once at most, on the same queue as all culls of this culler. What was recorded into this slot before has
    /// finished, or will never be submitted.
    pub unsafe fn record(
        &mut self,
        cmd: vk::CommandBuffer,
        slot: u32,
        input: &CullInput<'_>,
    ) -> Result<Ticket, GpuError> {
        let mut batch = [BatchEntry {
            slot,
            input: *input,
            ticket: None,
        }];
        // SAFETY: the caller vouches for `cmd` and the slot.
        unsafe { self.record_batch(cmd, &mut batch) }?;
        batch[0].ticket.ok_or(GpuError::Unfinished)
    }

    /// Records many culls at once, with one barrier after all inputs and one before all counts. On the compute path no cull waits for
    /// another one. Each entry gets its ticket.
    ///
    /// # Errors
    /// As for [`Culler::record`], for the first entry that is refused; [`GpuError::NoSuchSlot`] also where two entries have one slot.
    /// Nothing is recorded then, and no entry has a ticket.
    ///
    /// # Safety
    /// As for [`Culler::record`], for every slot of the batch.
    pub unsafe fn record_batch(
        &mut self,
        cmd: vk::CommandBuffer,
        batch: &mut [BatchEntry<'_>],
    ) -> Result<(), GpuError> {
        let _span = tracing::trace_span!("gpu cull: record", path = self.path.name()).entered();
        let slots = self.slots();
        self.batch.clear();
        batch.iter_mut().for_each(|entry| entry.ticket = None);
        for (index, entry) in batch.iter().enumerate() {
            let slot = entry.slot;
            if slot >= slots || self.batch.contains(&(slot as usize)) {
                return Err(GpuError::NoSuchSlot { slot, slots });
            }
            self.batch.push(slot as usize);
            self.check(entry.input.candidates)?;
            self.implementation
                .gather(index, &entry.input, self.counted)?;
        }
        for (index, &slot) in self.batch.iter().enumerate() {
            self.implementation.write(index, slot)?;
            self.uploads[slot] = !*self.upload.done.get_mut();
        }
        // From here on nothing fails.
        for entry in batch.iter_mut() {
            let counts = self.implementation.counts(entry.slot as usize);
            entry.ticket = Some(Ticket {
                slot: entry.slot,
                serial: counts.serial,
                candidates: entry.input.candidates.len() as u32,
            });
        }
        if !batch.is_empty() {
            // SAFETY: the caller vouches for `cmd`, and for the slots being free.
            unsafe {
                self.record_upload(cmd);
                self.implementation.record(cmd, &self.batch);
            }
        }
        Ok(())
    }

    /// Checks the number of candidates, and that their regions are in the atlas.
    fn check(&self, candidates: &[CullCandidate]) -> Result<(), GpuError> {
        let (count, most) = (candidates.len() as u64, self.max_candidates.into());
        within("CullerDesc::max_candidates", count, most)?;
        let stranger = |one: &CullCandidate| one.region.index() >= self.regions;
        match candidates.iter().position(stranger) {
            Some(candidate) => Err(GpuError::NoSuchRegion {
                candidate,
                region: candidates[candidate].region.0,
                regions: self.regions,
            }),
            None => Ok(()),
        }
    }

    /// Returns whether a cull has finished. If so, `overlaps` holds its counts, in the order of the candidates. Never waits.
    ///
    /// The device makes the counts of a cull available to the host, then writes the number of the cull, and this function looks for the
    /// number. Vulkan guarantees the counts once the host has seen the submission's fence or timeline semaphore; before that, the order of
    /// number and counts is the device's ([contract](super)).
    ///
    /// # Errors
    /// [`GpuError::StaleTicket`] when the slot holds another cull; an invalidate that failed.
    pub fn poll(&self, ticket: Ticket, overlaps: &mut Vec<Overlap>) -> Result<bool, GpuError> {
        let _span = tracing::trace_span!("gpu cull: poll", path = self.path.name()).entered();
        let index = ticket.slot as usize;
        let uploads = *self.uploads.get(index).ok_or(GpuError::StaleTicket)?;
        let words = self.implementation.words(index);
        let counts = self.implementation.counts(index);
        let Some(mut words) = counts.read(&self.context, ticket.serial, words)? else {
            return Ok(false);
        };
        if uploads {
            self.upload.done.store(true, Ordering::Relaxed);
        }
        overlaps.clear();
        overlaps.resize(ticket.candidates as usize, Overlap::default());
        self.implementation.add(index, &mut words, overlaps);
        if !self.counted.outer {
            // Without a count, an outer map may overlap anything.
            overlaps.iter_mut().for_each(|one| one.outer = u32::MAX);
        }
        Ok(true)
    }

    /// Frees everything. No recorded cull may be in flight.
    pub fn destroy(mut self, memory: &mut dyn Memory) {
        self.implementation.destroy(memory);
        self.is_live = false;
    }
}

impl Drop for Culler {
    fn drop(&mut self) {
        if self.is_live {
            tracing::error!("a Culler was dropped without destroy: its Vulkan objects leak");
        }
    }
}
