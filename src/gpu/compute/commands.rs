//! Descriptors, and the commands of one cull in order.

use ash::vk;

use super::{
    blocks::CHUNK,
    gathered::{Gathered, Offsets},
    path::ComputePath,
    slot::Slot,
};
use crate::gpu::{
    GpuError,
    barriers::{self, Access},
    counts::record_numbers,
    resources::Buffer,
    shader_table::{COUNT_COMP, CountCandidates},
};

const STORAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;
/// Kinds of the bindings: atlas, attack, candidates, groups, counts. The chunk of the attack is chosen when a set is bound.
pub(super) const BINDINGS: [vk::DescriptorType; 5] = [
    STORAGE,
    vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
    STORAGE,
    STORAGE,
    STORAGE,
];
const _: () = assert!(COUNT_COMP.bindings.len() == BINDINGS.len());

impl ComputePath {
    /// Creates the descriptor set of each slot.
    pub(super) fn make_sets(&mut self) -> Result<(), GpuError> {
        let (context, sets, atlas) = (&self.context, &mut self.sets, &self.atlas.buffer);
        let Offsets { groups, chunks, .. } = self.capacity.offsets();
        let part = |buffer: &Buffer, offset: u64, range: u64| {
            vk::DescriptorBufferInfo::default()
                .buffer(buffer.handle)
                .offset(offset)
                .range(range)
        };
        let free = sets.allocate(context, self.slots.len())?;
        for (slot, set) in self.slots.iter_mut().zip(free) {
            slot.set = set;
            let buffers = [
                part(atlas, 0, vk::WHOLE_SIZE),
                part(&slot.input, chunks, (4 * CHUNK) as u64),
                part(&slot.input, 0, groups),
                part(&slot.input, groups, chunks - groups),
                part(&slot.counts.buffer, 0, vk::WHOLE_SIZE),
            ];
            sets.write(context, set, &buffers);
        }
        Ok(())
    }

    /// Records all inputs, then all dispatches, then all copies of counts, so that no cull of a batch waits for another one.
    ///
    /// # Safety
    /// As for [`Culler::record_batch`](crate::gpu::Culler::record_batch); the slots have the inputs of the batch.
    pub(super) unsafe fn record_commands(&self, cmd: vk::CommandBuffer, slots: &[usize]) {
        let context = &self.context;
        let culls = || {
            let culls = self.gathered.iter().zip(slots);
            let culls = culls.map(|(gathered, &slot)| (gathered, &self.slots[slot]));
            culls.filter(|(one, _)| one.sums() > 0 && !one.candidates.is_empty())
        };
        // SAFETY: the caller vouches for the command buffer and the slots.
        unsafe {
            context.begin_label(cmd, c"sabaki: input");
            for (gathered, slot) in culls() {
                slot.record_copy(context, cmd, gathered, &self.capacity);
            }
            let (before, after) = (Access::TRANSFER_WRITE, Access::COMPUTE_READ);
            barriers::memory(context, cmd, before, after);
            context.end_label(cmd);
            context.begin_label(cmd, c"sabaki: count");
            for (gathered, slot) in culls() {
                self.record_dispatches(cmd, gathered, slot);
            }
            context.end_label(cmd);
            let counts = slots.iter().map(|&slot| &self.slots[slot].counts);
            record_numbers(context, cmd, Access::COMPUTE_WRITE, counts);
        }
    }

    /// # Safety
    /// As for [`ComputePath::record_commands`].
    unsafe fn record_dispatches(&self, cmd: vk::CommandBuffer, gathered: &Gathered, slot: &Slot) {
        let device = self.context.device();
        let pipeline = &self.pipeline;
        let point = vk::PipelineBindPoint::COMPUTE;
        let constants = gathered.constants();
        let layout = pipeline.layout;
        let (chunks, set) = (gathered.blocks.chunks(), [slot.set]);
        let groups = gathered.groups.len() as u32 / chunks.max(1);
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, and no dispatch has more groups than the
        // device takes.
        unsafe {
            device.cmd_bind_pipeline(cmd, point, pipeline.handle);
            for chunk in 0..chunks {
                let offset = [chunk * (4 * CHUNK) as u32];
                device.cmd_bind_descriptor_sets(cmd, point, layout, 0, &set, &offset);
                let constants = CountCandidates {
                    first: chunk * groups,
                    sums: chunk * constants.parts,
                    ..constants
                };
                pipeline.push(&self.context, cmd, &constants);
                device.cmd_dispatch(cmd, groups, constants.parts, 1);
            }
        }
    }
}
