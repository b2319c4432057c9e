//! What one cull in flight needs for itself: uploads, queries, results.

use ash::vk;

use super::candidates::Capacity;
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    error::Named,
    resources::{Buffer, BufferDesc},
    shader_table::{Placed, PlacedDisc},
};

/// Bytes before the counts in [`Slot::results`]: the number of the cull that they belong to.
pub(super) const HEADER: u64 = 8;

/// Null handles by default; destroying those does nothing.
#[derive(Debug, Default)]
pub(super) struct Slot {
    /// The attack's discs: vertex attributes.
    pub(super) discs: Buffer,
    /// Candidates, as the host writes them.
    pub(super) upload: Buffer,
    /// Candidates, as the shaders read them.
    pub(super) placed: Buffer,
    /// A header, then a count for each query.
    pub(super) results: Buffer,
    /// One for each candidate's body, then one for each candidate's evasion.
    pub(super) queries: vk::QueryPool,
    pub(super) set: vk::DescriptorSet,
    /// The number of the cull that was recorded last.
    pub(super) serial: u32,
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
        let placed = u64::from(capacity.placed()) * size_of::<Placed>() as u64;
        let queries = capacity.candidates.saturating_mul(2).max(1);
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
        self.upload = buffer("upload", placed, Usage::TRANSFER_SRC, MemoryUse::Upload)?;
        let usage = Usage::STORAGE_BUFFER | Usage::TRANSFER_DST;
        self.placed = buffer("candidates", placed, usage, MemoryUse::Device)?;
        let counts = HEADER + 4 * u64::from(queries);
        self.results = buffer("counts", counts, Usage::TRANSFER_DST, MemoryUse::Readback)?;
        // No cull has the number 0, and memory may hold anything.
        self.results.write(context, 0, &[0; HEADER as usize])?;

        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::OCCLUSION)
            .query_count(queries);
        // SAFETY: the context's device is valid.
        self.queries =
            unsafe { context.device().create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        context.name(self.queries, &format!("{name}: queries"));
        Ok(())
    }

    /// Frees everything; the device must be done with it. The descriptor set goes with its pool.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        // SAFETY: the handle is null or was made from this device, which the caller says is done with it.
        unsafe { context.device().destroy_query_pool(self.queries, None) };
        self.queries = vk::QueryPool::null();
        for buffer in [
            &mut self.results,
            &mut self.placed,
            &mut self.upload,
            &mut self.discs,
        ] {
            buffer.destroy(context, memory);
        }
    }
}
