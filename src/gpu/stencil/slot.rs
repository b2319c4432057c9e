//! Resources of one cull in flight: vertices, queries and counts.

use ash::vk;

use super::{
    boxes::CORNERS,
    gathered::{Capacity, Query},
    maps::Part,
};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    counts::{Counts, CountsDesc, HEADER},
    resources::{Buffer, BufferDesc, DeviceMemory},
    shader_table::{BoxCorner, PlacedDisc},
};

/// Buffers of one cull in flight. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// Vertex attributes of the attack's discs.
    pub(super) discs: Buffer,
    /// Vertex attributes of the boxes.
    pub(super) corners: Buffer,
    /// Count of each query.
    pub(super) counts: Counts,
    /// Candidate and part of each query of the last recorded cull.
    pub(super) queries: Vec<(u32, Part)>,
}

/// Settings of a [`Slot`].
pub(super) struct SlotDesc<'a> {
    /// Prefix of the names of its buffers.
    pub(super) name: &'a str,
    pub(super) capacity: &'a Capacity,
}

impl Slot {
    /// Fills a default slot. After a failure, [`Slot::destroy`] frees what was created.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &SlotDesc<'_>,
    ) -> Result<(), GpuError> {
        let SlotDesc { name, capacity } = *desc;
        let discs = u64::from(capacity.discs) * size_of::<PlacedDisc>() as u64;
        let corners = u64::from(capacity.boxes) * (CORNERS * size_of::<BoxCorner>()) as u64;
        let mut vertices = |what: &str, size| {
            let desc = BufferDesc {
                name: &format!("{name}: {what}"),
                size,
                usage: vk::BufferUsageFlags::VERTEX_BUFFER,
                memory: MemoryUse::Upload,
            };
            device.buffer(desc)
        };
        self.discs = vertices("discs", discs)?;
        self.corners = vertices("boxes", corners)?;
        let counts = CountsDesc {
            name: &format!("{name}: counts"),
            words: capacity.boxes.into(),
            usage: vk::BufferUsageFlags::empty(),
        };
        self.counts = Counts::new(device, &counts)?;
        Ok(())
    }

    /// Size of a slot's buffers, in bytes.
    pub(super) fn bytes(capacity: &Capacity) -> u64 {
        let discs = u64::from(capacity.discs) * size_of::<PlacedDisc>() as u64;
        let boxes = u64::from(capacity.boxes);
        let corners = boxes * (CORNERS * size_of::<BoxCorner>()) as u64;
        discs + corners + HEADER + 4 * boxes
    }

    /// Stores candidate and part of each query of a cull.
    pub(super) fn note_queries(&mut self, queries: &[Query]) {
        self.queries.clear();
        let numbers = queries.iter().map(|query| (query.candidate, query.part));
        self.queries.extend(numbers);
    }

    /// Frees everything. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.counts.destroy(context, memory);
        self.corners.destroy(context, memory);
        self.discs.destroy(context, memory);
    }
}
