//! Counts without occlusion queries: fragments that pass the stencil test are counted by atomic additions.
//!
//! Source: Masaoka & Oshita, section 5.3, for what is counted. Differs: an atomic addition in the fragment shader replaces the occlusion
//! query. All boxes of a plane are one draw, for all candidates.

use std::ops::Range;

use ash::vk;

use super::{
    atlas::{Atlas, ReadAs},
    boxes::CORNERS,
    cells::Plane,
    gathered::Draw,
};
use crate::gpu::{
    Context, GpuError, Memory, MemoryUse,
    counts::{Counts, HEADER},
    error::Named,
    passes::Passes,
    resources::{Buffer, BufferDesc, DeviceMemory},
    shader_table::{BoxCorner, TALLY_FRAG},
};

const WORDS: u32 = 0;
const COUNTS: u32 = 1;
const _: () = assert!(TALLY_FRAG.bindings.len() == 2);

/// Boxes in the order of drawing, plane by plane. The memory is reused.
#[derive(Debug, Default)]
pub(super) struct ByPlane {
    /// Boxes of each plane.
    pub(super) boxes: Vec<Range<u32>>,
    /// First box of each plane that has not been written.
    next: Vec<u32>,
}

impl ByPlane {
    /// Computes the range of each plane's boxes.
    pub(super) fn fill(&mut self, planes: &[Plane], draws: &[Draw]) {
        self.boxes.clear();
        self.boxes.resize(planes.len(), 0..0);
        for draw in draws {
            self.boxes[draw.plane as usize].end += draw.boxes.end - draw.boxes.start;
        }
        let mut first = 0;
        for boxes in &mut self.boxes {
            *boxes = first..first + boxes.end;
            first = boxes.end;
        }
    }

    /// Writes the corners of the boxes of all queries in the order of drawing.
    pub(super) fn write(&mut self, draws: &[Draw], corners: &[BoxCorner], out: &mut [BoxCorner]) {
        self.next.clear();
        self.next.extend(self.boxes.iter().map(|boxes| boxes.start));
        for draw in draws {
            let from = draw.boxes.start as usize * CORNERS..draw.boxes.end as usize * CORNERS;
            let next = &mut self.next[draw.plane as usize];
            out[*next as usize * CORNERS..][..from.len()].copy_from_slice(&corners[from]);
            *next += draw.boxes.end - draw.boxes.start;
        }
    }
}

/// Descriptor layout and pool of all slots. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
}

impl Layout {
    /// Fills a default layout for a number of slots.
    pub(super) fn fill(
        &mut self,
        context: &Context,
        words: ReadAs,
        slots: u32,
    ) -> Result<(), GpuError> {
        let types = [
            (WORDS, words.descriptor()),
            (COUNTS, vk::DescriptorType::STORAGE_BUFFER),
        ];
        let bindings = types.map(|(at, ty)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(at)
                .descriptor_type(ty)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        });
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let device = context.device();
        // SAFETY: the context's device is valid.
        self.layout = unsafe { device.create_descriptor_set_layout(&info, None) }
            .call("vkCreateDescriptorSetLayout")?;
        let sizes = types.map(|(_, ty)| {
            vk::DescriptorPoolSize::default()
                .ty(ty)
                .descriptor_count(slots)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(slots)
            .pool_sizes(&sizes);
        // SAFETY: as above.
        self.pool =
            unsafe { device.create_descriptor_pool(&info, None) }.call("vkCreateDescriptorPool")?;
        Ok(())
    }

    /// Frees both. The device must no longer use them.
    pub(super) fn destroy(&mut self, context: &Context) {
        // SAFETY: the handles are null or were made from this device, which the caller says is done with them.
        unsafe {
            let device = context.device();
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
        }
        *self = Self::default();
    }
}

/// Sums of one cull in flight, one for each query. Default: null handles.
#[derive(Debug, Default)]
pub(super) struct Sums {
    buffer: Buffer,
    pub(super) set: vk::DescriptorSet,
}

impl Sums {
    /// Fills default sums for a number of queries.
    pub(super) fn fill(
        &mut self,
        device: &mut DeviceMemory<'_>,
        name: &str,
        count: u32,
    ) -> Result<(), GpuError> {
        use vk::BufferUsageFlags as Usage;
        let desc = BufferDesc {
            name,
            size: 4 * u64::from(count),
            usage: Usage::STORAGE_BUFFER | Usage::TRANSFER_DST | Usage::TRANSFER_SRC,
            memory: MemoryUse::Device,
        };
        self.buffer = device.buffer(desc)?;
        Ok(())
    }

    /// Creates the descriptor set of the maps and these sums. It is freed with its pool.
    pub(super) fn make_set(
        &mut self,
        context: &Context,
        layout: &Layout,
        atlas: &Atlas,
    ) -> Result<(), GpuError> {
        let device = context.device();
        let layouts = [layout.layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(layout.pool)
            .set_layouts(&layouts);
        // SAFETY: pool and layout were just made, and the pool has room for every slot.
        let sets =
            unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")?;
        self.set = sets[0];
        let counts = [vk::DescriptorBufferInfo::default()
            .buffer(self.buffer.handle)
            .range(vk::WHOLE_SIZE)];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(COUNTS)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&counts)];
        // SAFETY: the set is new and of this layout, and the buffers are alive.
        unsafe {
            atlas.write_words(context, self.set);
            device.update_descriptor_sets(&write, &[]);
        }
        Ok(())
    }

    /// Records the reset of the sums to 0, without barriers.
    ///
    /// # Safety
    /// The passes are being recorded outside of rendering; no cull that is in flight has these sums; there is a sum for each query.
    pub(super) unsafe fn record_start(&self, passes: &Passes<'_>, queries: usize) {
        let (device, bytes) = (passes.context.device(), 4 * queries as u64);
        // SAFETY: the caller vouches for the command buffer and the sums.
        unsafe { device.cmd_fill_buffer(passes.cmd, self.buffer.handle, 0, bytes, 0) };
    }

    /// Records the copy of the sums to the counts, without barriers.
    ///
    /// # Safety
    /// As for [`Sums::record_start`]; the counts have a word for each query.
    pub(super) unsafe fn record_end(&self, passes: &Passes<'_>, counts: &Counts, queries: usize) {
        let copy = [vk::BufferCopy::default()
            .dst_offset(HEADER)
            .size(4 * queries as u64)];
        let (from, to) = (self.buffer.handle, counts.buffer.handle);
        let device = passes.context.device();
        // SAFETY: the caller vouches for the command buffer, the sums and the counts.
        unsafe { device.cmd_copy_buffer(passes.cmd, from, to, &copy) };
    }

    /// Frees the buffer. The device must no longer use it.
    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        self.buffer.destroy(context, memory);
    }
}
