//! The `stencil` culling path. CPU twin: `src/avoid/cull/cpu.rs`.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn once into the stencil of each slab; each candidate's body map
//! is drawn over it, moved and turned into place, and an occlusion query counts the samples that pass. One query spans a
//! candidate's slabs, which lie side by side in one target. A second query counts its evasion map, for the score.

use std::sync::atomic::{AtomicU32, Ordering};

use ash::vk;

use super::{
    atlas::Atlas,
    bits::PackedBits,
    candidates::{Capacity, Gathered},
    slot::{HEADER, Slot},
};
use crate::{
    avoid::cull::{CullInput, Overlap},
    gpu::{
        Context, GpuError, Memory, Mismatch,
        error::within,
        pipelines::{CANDIDATES, DISCS, Pipeline},
        resources::StencilTarget,
    },
    region::RegionAtlas,
};

/// How a [`Culler`] is made. Memory grows with every maximum.
#[derive(Clone, Copy, Debug)]
pub struct CullerDesc<'a> {
    /// For debuggers and validation.
    pub name: &'a str,
    /// The maps of all evasions; they are copied.
    pub atlas: &'a RegionAtlas,
    /// Candidates in one cull. With more, record several.
    pub max_candidates: u32,
    /// Slabs that an attack can touch.
    pub max_slabs: u32,
    /// Discs of an attack, over all slabs.
    pub max_discs: u32,
    /// Columns and rows of an attack's map in one slab, texels.
    pub max_attack_texels: [u32; 2],
    /// Culls that can be recorded before the first one's results have been read.
    pub frames_in_flight: u32,
}

impl<'a> CullerDesc<'a> {
    /// 1,024 candidates; attacks of 16,384 discs in 8 slabs of 256 × 256 texels; 2 in flight.
    #[must_use]
    pub fn new(name: &'a str, atlas: &'a RegionAtlas) -> Self {
        Self {
            name,
            atlas,
            max_candidates: 1024,
            max_slabs: 8,
            max_discs: 16_384,
            max_attack_texels: [256; 2],
            frames_in_flight: 2,
        }
    }
}

/// A cull that has been recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    pub(super) slot: u32,
    pub(super) serial: u32,
    pub(super) candidates: u32,
    /// Whether [`Overlap`]s will be counts. Without precise queries each number only says none (0) or some (not 0):
    /// right for removing candidates, not for scoring them.
    pub counts_exact: bool,
}

/// Counts overlaps with the stencil buffer and occlusion queries.
///
/// A slot is one cull in flight: [`Culler::record`] into a slot, submit, and [`Culler::poll`] until the results are there. The
/// attack's target is shared, so all culls of a culler run on one queue.
#[derive(Debug)]
pub struct Culler {
    pub(super) context: Context,
    pub(super) parts: Parts,
    pub(super) gathered: Gathered,
    pub(super) uploaded: bool,
    packed: PackedBits,
    capacity: Capacity,
}

#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) discs: Pipeline,
    pub(super) candidates: Pipeline,
    pub(super) target: StencilTarget,
    pub(super) atlas: Atlas,
    pub(super) slots: Vec<Slot>,
    live: bool,
}

/// What is said of the outer maps, which the device does not count: that they may share anything.
const NOT_COUNTED: u32 = u32::MAX;

/// Of the next cull, whichever culler's: a ticket fits one cull alone.
static NEXT_SERIAL: AtomicU32 = AtomicU32::new(1);

impl Culler {
    /// Makes pipelines and memory. Leaves nothing behind when it fails.
    ///
    /// # Errors
    /// A Vulkan call's, the allocator's, or [`GpuError::Limit`] where a maximum is more than the device offers, or where
    /// maps are timed: for now the device counts untimed ones alone ([`MapGrid::PAPER`](crate::region::MapGrid::PAPER)).
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        let slices = desc.atlas.grid().slices;
        within("slices of maps on the device", slices.into(), 1)?;
        let capacity = Capacity {
            candidates: desc.max_candidates,
            slabs: desc.max_slabs,
            discs: desc.max_discs,
            target: target_side(context, desc)?,
            regions: desc.atlas.regions().len(),
        };
        let mut culler = Self {
            context: context.clone(),
            parts: Parts::default(),
            gathered: Gathered::with_capacity(&capacity),
            uploaded: false,
            packed: PackedBits::new(desc.atlas),
            capacity,
        };
        match culler.fill(memory, desc) {
            Ok(()) => {
                // The staging buffer has them now.
                culler.packed.words = Vec::new();
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
        let atlas = format!("{name}: atlas");
        parts.atlas.fill(context, memory, &atlas, &self.packed)?;
        parts.atlas.make_layout(context)?;
        parts.discs = Pipeline::new(context, &DISCS, &[])?;
        parts.candidates = Pipeline::new(context, &CANDIDATES, &[parts.atlas.layout])?;
        let target = format!("{name}: attack");
        parts.target = StencilTarget::new(context, memory, &target, self.capacity.target)?;
        for slot in 0..desc.frames_in_flight.max(1) {
            let name = format!("{name}: slot {slot}");
            parts.slots.push(Slot::default());
            if let Some(slot) = parts.slots.last_mut() {
                slot.fill(context, memory, &name, &self.capacity)?;
            }
        }
        parts.atlas.make_sets(context, &mut parts.slots)
    }

    /// Records the upload of the maps, at a time of the caller's choice. Otherwise the first [`Culler::record`] does it.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering, for a queue of the context's family, and runs before any cull.
    pub unsafe fn record_upload(&mut self, cmd: vk::CommandBuffer) {
        if !self.uploaded {
            // SAFETY: the caller vouches for `cmd`; staging is released after the upload only.
            unsafe { self.parts.atlas.record_upload(&self.context, cmd) };
            self.uploaded = true;
        }
    }

    /// Frees the staging buffer of the maps, which is idle from then on. Does nothing before the upload was recorded.
    ///
    /// # Safety
    /// The command buffer with the upload has finished.
    pub unsafe fn release_staging(&mut self, memory: &mut dyn Memory) {
        if self.uploaded {
            self.parts.atlas.release_staging(&self.context, memory);
        }
    }

    /// Records a whole cull into the caller's command buffer: the attack, a query for each candidate's body map, one for its
    /// evasion map, and the way of the counts to the host. It neither submits nor waits, and allocates nothing.
    ///
    /// It leaves its own pipelines, descriptor set 0, vertex buffer 0, push constants and dynamic state bound.
    ///
    /// # Errors
    /// [`GpuError::Limit`] names the maximum that the input exceeds, [`GpuError::Mismatch`] what does not fit the uploaded
    /// atlas; nothing is recorded then, and `cpu` culls the same input.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering and of occlusion queries, for a queue of the context's family. It is
    /// submitted once at most, on the same queue as all culls of this culler. What was recorded into this slot before
    /// has finished, or will never be submitted. Where no [`Culler::record_upload`] came before, the first cull carries
    /// the upload of the maps: it is submitted, and before all others.
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
        self.gathered.fill(input, &self.packed, &self.capacity)?;
        let serial = next_serial();
        let place = &mut self.parts.slots[slot as usize];
        place.serial = serial;
        let discs = bytemuck::cast_slice(&self.gathered.discs);
        place.discs.write(&self.context, 0, discs)?;
        let placed = bytemuck::cast_slice(&self.gathered.placed);
        place.upload.write(&self.context, 0, placed)?;
        // SAFETY: the caller vouches for `cmd`, and for the slot being free.
        unsafe {
            self.record_upload(cmd);
            self.record_commands(cmd, &self.parts.slots[slot as usize]);
        }
        Ok(Ticket {
            slot,
            serial,
            candidates: input.candidates.len() as u32,
            counts_exact: self.context.precise_queries(),
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
        let slot = slot
            .filter(|slot| slot.serial == ticket.serial)
            .ok_or(Mismatch::Ticket)?;
        slot.results.invalidate(&self.context)?;
        if slot.results.word(0)? != ticket.serial {
            return Ok(false);
        }
        // What was cached of the counts may be older than their number.
        slot.results.invalidate(&self.context)?;
        let count = ticket.candidates as usize;
        let size = HEADER + 8 * count as u64;
        // SAFETY: the number has come, so the counts are written, and nothing writes them until the slot is recorded anew.
        let bytes = unsafe { slot.results.bytes(size) }?;
        let words = bytes[HEADER as usize..]
            .chunks_exact(4)
            .map(|word| u32::from_ne_bytes([word[0], word[1], word[2], word[3]]));
        overlaps.clear();
        let evasions = words.clone().skip(count);
        let pairs = words.take(count).zip(evasions);
        overlaps.extend(pairs.map(|(body, evasion)| Overlap {
            body,
            outer: NOT_COUNTED,
            evasion,
        }));
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
        parts.target.destroy(context, memory);
        parts.candidates.destroy(context);
        parts.discs.destroy(context);
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

/// The slabs' maps in a row, and in more rows where the device's targets are not that wide.
fn target_side(context: &Context, desc: &CullerDesc<'_>) -> Result<[u32; 2], GpuError> {
    let [width, height] = desc.max_attack_texels.map(|side| side.max(1));
    let slabs = desc.max_slabs.max(1);
    let most = context.max_target_side().min(u16::MAX.into());
    let limit = "side of a stencil target";
    within(limit, width.into(), most.into())?;
    let columns = (most / width).min(slabs);
    let rows = slabs.div_ceil(columns);
    let height = u64::from(rows) * u64::from(height);
    within(limit, height, most.into())?;
    Ok([columns * width, height as u32])
}

/// Never 0, which means none.
fn next_serial() -> u32 {
    loop {
        let serial = NEXT_SERIAL.fetch_add(1, Ordering::Relaxed);
        if serial != 0 {
            return serial;
        }
    }
}
