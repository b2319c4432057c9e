//! Descriptors, and the commands of one cull in order.

use std::ops::Range;

use ash::vk;

use super::{
    blocks::CHUNK,
    gathered::{Capacity, Gathered, Offsets},
    path::{ComputePath, Parts},
    slot::Slot,
};
use crate::gpu::{
    Context, GpuError,
    barriers::{self, Access},
    counts::record_numbers,
    error::Named,
    shader_table::{COUNT_COMP, CountCandidates},
};

const ATLAS: u32 = 0;
const ATTACK: u32 = 1;
const CANDIDATES: u32 = 2;
const GROUPS: u32 = 3;
const RESULTS: u32 = 4;
const BINDINGS: [u32; 5] = [ATLAS, ATTACK, CANDIDATES, GROUPS, RESULTS];
const _: () = assert!(COUNT_COMP.bindings.len() == BINDINGS.len());

/// Descriptor type of a binding.
fn kind(binding: u32) -> vk::DescriptorType {
    match binding {
        ATTACK => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
        _ => vk::DescriptorType::STORAGE_BUFFER,
    }
}

impl Parts {
    /// Creates the layout of the descriptor sets from the shader table.
    pub(super) fn make_layout(&mut self, context: &Context) -> Result<(), GpuError> {
        let bindings = BINDINGS.map(|at| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(at)
                .descriptor_type(kind(at))
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        });
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the context's device is valid.
        self.layout = unsafe { context.device().create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        Ok(())
    }

    /// Creates the descriptor sets of each slot, one for each page of the maps.
    pub(super) fn make_sets(
        &mut self,
        context: &Context,
        capacity: &Capacity,
        pages: &[Range<usize>],
    ) -> Result<(), GpuError> {
        let device = context.device();
        let sets = self.slots.len() * pages.len();
        if sets == 0 {
            return Ok(());
        }
        let count = sets as u32;
        let sizes = BINDINGS.map(|at| {
            vk::DescriptorPoolSize::default()
                .ty(kind(at))
                .descriptor_count(count)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(count)
            .pool_sizes(&sizes);
        // SAFETY: the context's device is valid.
        self.pool =
            unsafe { device.create_descriptor_pool(&info, None) }.call("vkCreateDescriptorPool")?;
        let layouts = vec![self.layout; sets];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layouts were just made, and the pool has room for all.
        let sets =
            unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")?;
        for (slot, sets) in self.slots.iter_mut().zip(sets.chunks_exact(pages.len())) {
            slot.sets = sets.to_vec();
        }
        let offsets = capacity.offsets();
        for slot in &self.slots {
            for (&set, page) in slot.sets.iter().zip(pages) {
                let atlas = vk::DescriptorBufferInfo::default()
                    .buffer(self.atlas.buffer.handle)
                    .offset(4 * page.start as u64)
                    .range(4 * page.len() as u64);
                write_set(context, set, slot.buffers(atlas, offsets));
            }
        }
        Ok(())
    }
}

impl Slot {
    /// The buffers of a descriptor set, in the order of the bindings. The chunk of the attack is chosen when the set is bound.
    fn buffers(
        &self,
        atlas: vk::DescriptorBufferInfo,
        offsets: Offsets,
    ) -> [vk::DescriptorBufferInfo; BINDINGS.len()] {
        let Offsets { groups, chunks, .. } = offsets;
        let input = |offset, range| {
            vk::DescriptorBufferInfo::default()
                .buffer(self.input.handle)
                .offset(offset)
                .range(range)
        };
        [
            atlas,
            input(chunks, (4 * CHUNK) as u64),
            input(0, groups),
            input(groups, chunks - groups),
            vk::DescriptorBufferInfo::default()
                .buffer(self.counts.buffer.handle)
                .range(vk::WHOLE_SIZE),
        ]
    }
}

/// Writes the buffers of all bindings to a descriptor set that no command uses yet.
fn write_set(
    context: &Context,
    set: vk::DescriptorSet,
    buffers: [vk::DescriptorBufferInfo; BINDINGS.len()],
) {
    let writes = BINDINGS.map(|at| {
        vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(at)
            .descriptor_type(kind(at))
            .buffer_info(std::slice::from_ref(&buffers[at as usize]))
    });
    // SAFETY: set and buffers are alive, and no command uses the set yet.
    unsafe { context.device().update_descriptor_sets(&writes, &[]) };
}

impl ComputePath {
    /// Records all inputs, then all dispatches, then all copies of counts, so that no cull of a batch waits for another one.
    ///
    /// # Safety
    /// As for [`Culler::record_batch`](crate::gpu::Culler::record_batch); the slots have the inputs of the batch.
    pub(super) unsafe fn record_commands(&self, cmd: vk::CommandBuffer, slots: &[usize]) {
        let context = &self.context;
        let culls = || {
            let culls = self.gathered.iter().zip(slots);
            let culls = culls.map(|(gathered, &slot)| (gathered, &self.parts.slots[slot]));
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
            let counts = slots.iter().map(|&slot| &self.parts.slots[slot].counts);
            record_numbers(context, cmd, Access::COMPUTE_WRITE, counts);
        }
    }

    /// # Safety
    /// As for [`ComputePath::record_commands`].
    unsafe fn record_dispatches(&self, cmd: vk::CommandBuffer, gathered: &Gathered, slot: &Slot) {
        let device = self.context.device();
        let pipeline = &self.parts.pipeline;
        let point = vk::PipelineBindPoint::COMPUTE;
        let constants = gathered.constants();
        let layout = pipeline.layout;
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, and no dispatch has more groups than the
        // device takes.
        unsafe {
            device.cmd_bind_pipeline(cmd, point, pipeline.handle);
            for dispatch in &gathered.dispatches {
                let chunk = [dispatch.chunk * (4 * CHUNK) as u32];
                device.cmd_bind_descriptor_sets(
                    cmd,
                    point,
                    layout,
                    0,
                    &[slot.sets[dispatch.page as usize]],
                    &chunk,
                );
                for first in (0..dispatch.groups).step_by(self.capacity.groups as usize) {
                    let constants = CountCandidates {
                        first: dispatch.first + first,
                        sums: dispatch.chunk * constants.parts,
                        ..constants
                    };
                    pipeline.push(&self.context, cmd, &constants);
                    let some = self.capacity.groups.min(dispatch.groups - first);
                    device.cmd_dispatch(cmd, some, constants.parts, 1);
                }
            }
        }
    }
}
