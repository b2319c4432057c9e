//! The `stencil` culling path. CPU twin: `src/query/cull/cpu.rs`.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn once into the stencil of each slab; each candidate's body map
//! is drawn over it, moved and turned into place, and an occlusion query counts the samples that pass. One query spans all
//! slabs and slices of a candidate, whose cells lie in one target (`cells.rs`). A second query counts its outer map, which
//! proves misses, and a third one its evasion map, for the score. In place of queries, fragments may count (`tally.rs`).

use std::sync::atomic::Ordering;

use ash::vk;

use super::{
    atlas::Atlas,
    commands, drawing,
    gathered::{Capacity, Gathered, MOST_BOXES},
    maps::{Maps, Part},
    slot::Slot,
    tally::{self, ByPlane, Counting},
};
use crate::{
    gpu::{
        Context, GpuError, Memory, MemoryUse, Mismatch,
        error::within,
        pipelines::{CANDIDATES, DISCS, Pipeline, TALLY},
        resources::{Buffer, BufferDesc, StencilTarget},
        uploaded::Upload,
    },
    maps::RegionAtlas,
    query::cull::{Counted, CullInput, Overlap},
};

/// How a [`Culler`] is made. Memory grows with every maximum.
#[derive(Clone, Copy, Debug)]
pub struct CullerDesc<'a> {
    /// For debuggers and validation.
    pub name: &'a str,
    /// The maps of all evasions; they are copied.
    pub atlas: &'a RegionAtlas,
    /// What is counted. Default: everything.
    pub counted: Counted,
    /// How. Default: by occlusion queries.
    pub counting: Counting,
    /// Candidates in one cull. With more, record several.
    pub max_candidates: u32,
    /// Discs of an attack, over all slabs and slices; where maps are timed, those of the inner maps count twice, as the
    /// evasion maps are held against all slices at once.
    pub max_discs: u32,
    /// Boxes of a cull: for each candidate its maps, of all slabs and slices, that the attack is near.
    pub max_boxes: u32,
    /// Queries of a pool. A cull that has more of them takes several turns.
    pub max_queries: u32,
    /// Columns and rows of the stencil target, texels, as far as the device allows. Where an attack does not fit its
    /// eight planes, a cull takes several passes.
    pub target: [u32; 2],
    /// Culls that can be recorded before the first one's results have been read.
    pub frames_in_flight: u32,
}

impl<'a> CullerDesc<'a> {
    /// 1,024 candidates, 65,536 discs, 65,536 boxes, 4,096 queries at once, a target of 1,024 × 1,024 texels; 2 in flight.
    #[must_use]
    pub fn new(name: &'a str, atlas: &'a RegionAtlas) -> Self {
        Self {
            name,
            atlas,
            counted: Counted::default(),
            counting: Counting::default(),
            max_candidates: 1024,
            max_discs: 1 << 16,
            max_boxes: 1 << 16,
            max_queries: 1 << 12,
            target: [1024; 2],
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
    pub(super) capacity: Capacity,
    maps: Maps,
    counted: Counted,
    pub(super) counting: Counting,
    pub(super) by_plane: ByPlane,
    upload: Upload,
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
    live: bool,
}

/// What is said of outer maps that are not counted: that they may share anything.
const NOT_COUNTED: u32 = u32::MAX;

impl Culler {
    /// Makes pipelines and memory. Leaves nothing behind when it fails.
    ///
    /// # Errors
    /// A Vulkan call's, the allocator's, [`GpuError::Limit`] where a maximum, or the size of the maps, is more than
    /// the device offers, [`GpuError::Missing`] where the context's queue family has no graphics, or the device not what
    /// [`CullerDesc::counting`] asks for.
    pub fn new(
        context: &Context,
        memory: &mut dyn Memory,
        desc: &CullerDesc<'_>,
    ) -> Result<Self, GpuError> {
        drawing::needs_graphics(context)?;
        if desc.counting == Counting::Atomics && !context.fragment_atomics() {
            return Err(GpuError::Missing(vec!["fragmentStoresAndAtomics"]));
        }
        // Places in a target are numbers of 16 bits with a sign.
        let most = context.max_target_side().min(1 << 14);
        let boxes = desc.max_boxes.min(MOST_BOXES);
        let capacity = Capacity {
            candidates: desc.max_candidates,
            discs: desc.max_discs,
            boxes,
            queries: desc.max_queries.min(boxes).max(1),
            target: desc.target.map(|side| side.clamp(1, most)),
        };
        let mut culler = Self {
            context: context.clone(),
            parts: Parts::default(),
            gathered: Gathered::default(),
            maps: Maps::new(desc.atlas)?,
            counted: desc.counted,
            counting: desc.counting,
            by_plane: ByPlane::default(),
            upload: Upload::default(),
            capacity,
        };
        match culler.fill(memory, desc) {
            Ok(()) => {
                // The staging buffer has them now.
                culler.maps.forget_words();
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
        parts
            .atlas
            .fill(context, memory, &atlas, self.maps.words())?;
        let indices = commands::indices();
        let bytes: &[u8] = bytemuck::cast_slice(&indices);
        let of_boxes = BufferDesc {
            name: &format!("{name}: indices"),
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::INDEX_BUFFER,
            memory: MemoryUse::Upload,
        };
        parts.indices = Buffer::new(context, memory, of_boxes)?;
        parts.indices.write(context, 0, bytes)?;
        parts.discs = Pipeline::new(context, &DISCS, &[])?;
        let slots = desc.frames_in_flight.max(1);
        parts.candidates = match self.counting {
            Counting::Queries => Pipeline::new(context, &CANDIDATES, &[parts.atlas.layout])?,
            Counting::Atomics => {
                parts.tally.fill(context, slots)?;
                Pipeline::new(context, &TALLY, &[parts.tally.layout])?
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
            // SAFETY: the caller vouches for `cmd`; staging is released after the upload only.
            unsafe { self.parts.atlas.record_upload(&self.context, cmd) };
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

    /// Records a whole cull into the caller's command buffer: the attack, a query for each candidate's body maps, one for
    /// its outer maps, one for its evasion maps, and the way of the counts to the host. It neither submits nor waits, and
    /// allocates nothing once it has recorded as much.
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
    /// has finished, or will never be submitted.
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
        self.gathered.fill(wanted, &self.maps, &self.capacity)?;
        let corners = match self.counting {
            Counting::Queries => {
                let queries = self.gathered.queries.len() as u64;
                let most = self.context.most_queries();
                within("the driver's queries in one submission", queries, most)?;
                &self.gathered.corners
            }
            Counting::Atomics => {
                let Gathered {
                    cells,
                    draws,
                    corners,
                    ..
                } = &self.gathered;
                self.by_plane.fill(&cells.planes, draws, corners);
                &self.by_plane.corners
            }
        };
        let place = &mut self.parts.slots[slot as usize];
        let serial = place.counts.start();
        place.counted = self.counted;
        place.uploads = !*self.upload.done.get_mut();
        place.note_queries(&self.gathered.queries);
        let discs = bytemuck::cast_slice(&self.gathered.cells.discs);
        place.discs.write(&self.context, 0, discs)?;
        place
            .corners
            .write(&self.context, 0, bytemuck::cast_slice(corners))?;
        // SAFETY: the caller vouches for `cmd`, and for the slot being free.
        unsafe {
            self.record_upload(cmd);
            self.record_commands(cmd, &self.parts.slots[slot as usize]);
        }
        Ok(Ticket {
            slot,
            serial,
            candidates: input.candidates.len() as u32,
            counts_exact: self.counting == Counting::Atomics || self.context.precise_queries(),
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
        let queries = slot.queries.len();
        let Some(words) = slot.counts.read(&self.context, ticket.serial, queries)? else {
            return Ok(false);
        };
        if slot.uploads {
            self.upload.done.store(true, Ordering::Relaxed);
        }
        let nothing = Overlap {
            outer: if slot.counted.outer { 0 } else { NOT_COUNTED },
            ..Overlap::default()
        };
        overlaps.clear();
        overlaps.resize(ticket.candidates as usize, nothing);
        for (&(candidate, part), count) in slot.queries.iter().zip(words) {
            let overlap = &mut overlaps[candidate as usize];
            let sum = match part {
                Part::Body => &mut overlap.body,
                Part::Outer => &mut overlap.outer,
                Part::Evasion => &mut overlap.evasion,
            };
            *sum = sum.saturating_add(count);
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
        parts.target.destroy(context, memory);
        parts.candidates.destroy(context);
        parts.discs.destroy(context);
        parts.indices.destroy(context, memory);
        parts.tally.destroy(context);
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
