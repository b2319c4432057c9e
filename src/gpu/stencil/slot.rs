//! What one cull in flight needs for itself: uploads, queries, results.

use ash::vk;

use super::{
    gathered::{Capacity, Query},
    maps::Part,
};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    error::Named,
    resources::{Buffer, BufferDesc},
    shader_table::{PlacedBox, PlacedDisc},
};
use crate::{avoid::cull::Counted, region::MapTurn};

/// Bytes before the counts in [`Slot::results`]: the number of the cull that they belong to.
pub(super) const HEADER: u64 = 8;

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// The attack's discs: vertex attributes.
    pub(super) discs: Buffer,
    /// Turns, then boxes, as the host writes them.
    pub(super) upload: Buffer,
    /// As the shaders read them.
    pub(super) turns: Buffer,
    pub(super) boxes: Buffer,
    /// A header, then a count for each query.
    pub(super) results: Buffer,
    pub(super) pool: vk::QueryPool,
    pub(super) set: vk::DescriptorSet,
    /// The number of the cull that was recorded last.
    pub(super) serial: u32,
    /// Whose numbers that cull counts: candidate and part of each query.
    pub(super) queries: Vec<(u32, Part)>,
    /// What it counts.
    pub(super) counted: Counted,
    /// Whether it carries the maps to the device.
    pub(super) uploads: bool,
}

impl Slot {
    /// Fills a default slot. After a failure [`Slot::destroy`] frees what there is.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        memory: &mut dyn Memory,
        name: &str,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        let discs = u64::from(capacity.discs) * size_of::<PlacedDisc>() as u64;
        let boxes = u64::from(capacity.boxes) * size_of::<PlacedBox>() as u64;
        let turns = u64::from(capacity.candidates) * size_of::<MapTurn>() as u64;
        let mut buffer = |what: &str, size, usage, who| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage,
                memory: who,
            };
            Buffer::new(context, memory, desc)
        };
        use vk::BufferUsageFlags as Usage;
        self.discs = buffer("discs", discs, Usage::VERTEX_BUFFER, MemoryUse::Upload)?;
        let upload = turns + boxes;
        self.upload = buffer("upload", upload, Usage::TRANSFER_SRC, MemoryUse::Upload)?;
        let usage = Usage::STORAGE_BUFFER | Usage::TRANSFER_DST;
        self.turns = buffer("turns", turns, usage, MemoryUse::Device)?;
        self.boxes = buffer("boxes", boxes, usage, MemoryUse::Device)?;
        // No query is without a box.
        let counts = HEADER + 4 * u64::from(capacity.boxes);
        self.results = buffer("counts", counts, Usage::TRANSFER_DST, MemoryUse::Readback)?;
        // No cull has the number 0, and memory may hold anything.
        self.results.write(context, 0, &[0; HEADER as usize])?;

        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::OCCLUSION)
            .query_count(capacity.queries);
        // SAFETY: the context's device is valid.
        self.pool =
            unsafe { context.device().create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        context.name(self.pool, &format!("{name}: queries"));
        Ok(())
    }

    /// Remembers which numbers a cull's queries count.
    pub(super) fn note_queries(&mut self, queries: &[Query]) {
        self.queries.clear();
        let numbers = queries.iter().map(|query| (query.candidate, query.part));
        self.queries.extend(numbers);
    }

    /// Frees everything; the device must be done with it. The descriptor set goes with its pool.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handle is null or was made from this device, which the caller says is done with it.
        unsafe { context.device().destroy_query_pool(self.pool, None) };
        self.pool = vk::QueryPool::null();
        for buffer in [
            &mut self.results,
            &mut self.boxes,
            &mut self.turns,
            &mut self.upload,
            &mut self.discs,
        ] {
            buffer.destroy(context, memory);
        }
    }
}
