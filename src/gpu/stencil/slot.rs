//! Resources of one cull in flight: vertices, queries and counts.

use ash::vk;

use super::{
    boxes::CORNERS,
    gathered::{Capacity, Query},
    maps::Part,
    tally::Sums,
};
use crate::gpu::{
    Context, Counting, GpuError, Memory, MemoryUse,
    counts::{Counts, HEADER},
    resources::{Buffer, BufferDesc},
    shader_table::{BoxCorner, PlacedDisc},
};

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Vertex attributes of the attack's discs.
    pub(super) discs: Buffer,
    /// Vertex attributes of the boxes.
    pub(super) corners: Buffer,
    /// Count of each query.
    pub(super) counts: Counts,
    /// Sums of atomics. Empty if occlusion queries count.
    pub(super) sums: Sums,
    /// Candidate and part of each query of the last recorded cull.
    pub(super) queries: Vec<(u32, Part)>,
}

impl Slot {
    /// Fills a default slot. After a failure, [`Slot::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        memory: &mut dyn Memory,
        name: &str,
        (capacity, counting): (&Capacity, Counting),
    ) -> Result<(), GpuError> {
        let discs = u64::from(capacity.discs) * size_of::<PlacedDisc>() as u64;
        let corners = u64::from(capacity.boxes) * (CORNERS * size_of::<BoxCorner>()) as u64;
        let mut vertices = |what: &str, size| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage: vk::BufferUsageFlags::VERTEX_BUFFER,
                memory: MemoryUse::Upload,
            };
            Buffer::new(context, memory, desc)
        };
        self.discs = vertices("discs", discs)?;
        self.corners = vertices("boxes", corners)?;
        // No query is without a box.
        let counts = (&*format!("{name}: counts"), capacity.boxes.into());
        self.counts = Counts::new(context, memory, counts, vk::BufferUsageFlags::empty())?;

        if counting == Counting::Atomics {
            let sums = (&*format!("{name}: sums"), capacity.boxes);
            return self.sums.fill(context, memory, sums);
        }
        Ok(())
    }

    /// Size of a slot's buffers, in bytes.
    pub(super) fn bytes(capacity: &Capacity, counting: Counting) -> u64 {
        let discs = u64::from(capacity.discs) * size_of::<PlacedDisc>() as u64;
        let boxes = u64::from(capacity.boxes);
        let corners = boxes * (CORNERS * size_of::<BoxCorner>()) as u64;
        let sums = match counting {
            Counting::Queries => 0,
            Counting::Atomics => 4 * boxes,
        };
        discs + corners + HEADER + 4 * boxes + sums
    }

    /// Stores candidate and part of each query of a cull.
    pub(super) fn note_queries(&mut self, queries: &[Query]) {
        self.queries.clear();
        let numbers = queries.iter().map(|query| (query.candidate, query.part));
        self.queries.extend(numbers);
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.sums.destroy(context, memory);
        self.counts.destroy(context, memory);
        self.corners.destroy(context, memory);
        self.discs.destroy(context, memory);
    }
}
