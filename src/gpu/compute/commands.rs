//! Descriptors, and the commands of one cull in order.

use std::ops::Range;

use ash::vk;

use super::{
    blocks::CHUNK,
    gathered::{Capacity, Offsets},
    path::{ComputePath, Parts},
    slot::Slot,
};
use crate::gpu::{
    Context, GpuError,
    barriers::Access,
    error::Named,
    passes::Passes,
    shader_table::{COUNT_COMP, CountSettings},
};

const ATLAS: u32 = 0;
const ATTACK: u32 = 1;
const CANDIDATES: u32 = 2;
const GROUPS: u32 = 3;
const RESULTS: u32 = 4;
const BINDINGS: [u32; 5] = [ATLAS, ATTACK, CANDIDATES, GROUPS, RESULTS];
const _: () = assert!(COUNT_COMP.bindings.len() == BINDINGS.len());

/// What a binding is.
fn kind(binding: u32) -> vk::DescriptorType {
    match binding {
        ATTACK => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
        _ => vk::DescriptorType::STORAGE_BUFFER,
    }
}

impl Parts {
    /// Makes the layout of the descriptor sets, as the shader table has it.
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

    /// Gives each slot its descriptor sets, one for each page of the maps.
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
        for slot in &self.slots {
            for (&set, page) in slot.sets.iter().zip(pages) {
                self.write_set(context, (slot, set), (capacity, page));
            }
        }
        Ok(())
    }

    fn write_set(
        &self,
        context: &Context,
        (slot, set): (&Slot, vk::DescriptorSet),
        (capacity, page): (&Capacity, &Range<usize>),
    ) {
        let range = |buffer, offset, range| {
            [vk::DescriptorBufferInfo::default()
                .buffer(buffer)
                .offset(offset)
                .range(range)]
        };
        let Offsets { groups, chunks, .. } = capacity.offsets();
        // In the order of the bindings; which chunk, is said when it is bound.
        let infos = [
            range(
                self.atlas.buffer.handle,
                4 * page.start as u64,
                4 * page.len() as u64,
            ),
            range(slot.input(), chunks, (4 * CHUNK) as u64),
            range(slot.input(), 0, groups),
            range(slot.input(), groups, chunks - groups),
            range(slot.counts.buffer.handle, 0, vk::WHOLE_SIZE),
        ];
        let writes = BINDINGS.map(|at| {
            vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(at)
                .descriptor_type(kind(at))
                .buffer_info(&infos[at as usize])
        });
        // SAFETY: set and buffers are alive, and no command uses the set yet.
        unsafe { context.device().update_descriptor_sets(&writes, &[]) };
    }
}

impl ComputePath {
    /// # Safety
    /// As for [`Culler::record`](crate::gpu::Culler::record); the slot has this cull's input.
    pub(super) unsafe fn record_commands(&self, passes: &mut Passes<'_>, slot: &Slot) {
        let (context, cmd) = (&self.context, passes.cmd);
        // SAFETY: the caller vouches for `cmd` and the slot.
        unsafe {
            if self.gathered.sums() > 0 && !self.gathered.candidates.is_empty() {
                passes.begin(c"sabaki: input");
                slot.record_copy(context, cmd, (&self.gathered, &self.capacity));
                passes.end();
                passes.begin(c"sabaki: count");
                self.record_dispatches(cmd, slot);
                passes.end();
            }
            passes.begin(c"sabaki: counts to the host");
            slot.counts
                .record_number(context, cmd, Access::COMPUTE_WRITE);
            passes.end();
        }
    }

    /// # Safety
    /// As for [`ComputePath::record_commands`].
    unsafe fn record_dispatches(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let device = self.context.device();
        let pipeline = self.parts.pipelines[usize::from(self.gathered.is_large)];
        let point = vk::PipelineBindPoint::COMPUTE;
        let constants = self.gathered.constants();
        let layout = pipeline.layout;
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, and no dispatch has more groups than the
        // device takes.
        unsafe {
            device.cmd_bind_pipeline(cmd, point, pipeline.handle);
            for dispatch in &self.gathered.dispatches {
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
                    let constants = CountSettings {
                        first: dispatch.first + first,
                        sums: dispatch.chunk * constants.parts,
                        ..constants
                    };
                    let stage = vk::ShaderStageFlags::COMPUTE;
                    pipeline.push(&self.context, cmd, stage, &constants);
                    let some = self.capacity.groups.min(dispatch.groups - first);
                    device.cmd_dispatch(cmd, some, constants.parts, 1);
                }
            }
        }
    }
}
