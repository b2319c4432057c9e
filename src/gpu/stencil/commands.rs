//! The commands of one cull, in order.

use ash::vk;

use super::{
    culler::Culler,
    drawing, passes,
    slot::{HEADER, Slot},
};
use crate::gpu::{
    barriers::{self, Access},
    pipelines::StencilRule,
    shader_table::{CandidateSettings, TargetSide},
};

/// In the attack's target: a texel that the attack touches.
const ATTACK: u32 = 1;
/// Which maps a query counts: as in `shaders/include/candidate.glsl`.
const MAPS: [u32; 2] = [0, 1];

impl Culler {
    /// # Safety
    /// As for [`Culler::record`]; the slot has this cull's discs and candidates.
    pub(super) unsafe fn record_commands(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let context = &self.context;
        // SAFETY: the caller vouches for `cmd` and the slot.
        unsafe {
            self.record_uploads(cmd, slot);
            if self.gathered.has_attack() {
                let image = self.parts.target.image;
                let uses = (Access::STENCIL, Access::STENCIL);
                barriers::stencil_image(context, cmd, image, uses, true);
                self.record_rendering(cmd, slot);
            }
            self.record_results(cmd, slot);
        }
    }

    /// # Safety
    /// As for [`Culler::record_commands`].
    unsafe fn record_uploads(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let device = self.context.device();
        let queries = 2 * self.gathered.ranges.len() as u32;
        let placed = size_of_val(self.gathered.placed.as_slice()) as u64;
        // SAFETY: the caller vouches for `cmd`; both buffers hold this many bytes, and the pool this many queries.
        unsafe {
            if queries > 0 {
                device.cmd_reset_query_pool(cmd, slot.queries, 0, queries);
            }
            if placed > 0 {
                let copy = [vk::BufferCopy::default().size(placed)];
                device.cmd_copy_buffer(cmd, slot.upload.handle, slot.placed.handle, &copy);
                let (before, after) = (Access::TRANSFER_WRITE, Access::SHADER_READ);
                barriers::memory(&self.context, cmd, before, after);
            }
        }
    }

    /// The attack once, then a query for each candidate's body map and evasion map.
    ///
    /// # Safety
    /// As for [`Culler::record_commands`], and the target is in the layout of a stencil attachment.
    unsafe fn record_rendering(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let (graphics, vertex) = (
            vk::PipelineBindPoint::GRAPHICS,
            vk::ShaderStageFlags::VERTEX,
        );
        let side = parts.target.side;
        let discs = self.gathered.discs.len() as u32;
        // SAFETY: the caller vouches for `cmd`; all handles are this culler's.
        unsafe {
            let store = vk::AttachmentStoreOp::DONT_CARE;
            drawing::begin(context, cmd, &parts.target, self.gathered.used, 0, store);
            if discs > 0 {
                device.cmd_bind_pipeline(cmd, graphics, parts.discs.handle);
                let constants = TargetSide { side };
                parts.discs.push(context, cmd, vertex, &constants);
                device.cmd_bind_vertex_buffers(cmd, 0, &[slot.discs.handle], &[0]);
                passes::draw(ATTACK).set(context, cmd);
                device.cmd_draw(cmd, 4, discs, 0, 0);
            }
            device.cmd_bind_pipeline(cmd, graphics, parts.candidates.handle);
            let layout = parts.candidates.layout;
            device.cmd_bind_descriptor_sets(cmd, graphics, layout, 0, &[slot.set], &[]);
            over_attack().set(context, cmd);
            for evasion in MAPS {
                self.record_queries(cmd, slot, evasion);
            }
            device.cmd_end_rendering(cmd);
        }
    }

    /// # Safety
    /// As for [`Culler::record_commands`], within the rendering, with the candidates' pipeline bound.
    unsafe fn record_queries(&self, cmd: vk::CommandBuffer, slot: &Slot, evasion: u32) {
        let device = self.context.device();
        let constants = CandidateSettings {
            side: self.parts.target.side,
            attack: self.gathered.attack,
            evasion,
            padding: 0,
        };
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let precision = if self.context.precise_queries() {
            vk::QueryControlFlags::PRECISE
        } else {
            vk::QueryControlFlags::empty()
        };
        let first = evasion * self.gathered.ranges.len() as u32;
        // SAFETY: the caller vouches for `cmd`; the queries were reset, and precise ones are enabled.
        unsafe {
            let pipeline = &self.parts.candidates;
            pipeline.push(&self.context, cmd, stages, &constants);
            for (range, query) in self.gathered.ranges.iter().zip(first..) {
                device.cmd_begin_query(cmd, slot.queries, query, precision);
                if !range.is_empty() {
                    device.cmd_draw(cmd, 4, range.end - range.start, 0, range.start);
                }
                device.cmd_end_query(cmd, slot.queries, query);
            }
        }
    }

    /// Counts first, then the number that says that they are there.
    ///
    /// # Safety
    /// As for [`Culler::record_commands`].
    unsafe fn record_results(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let (context, device) = (&self.context, self.context.device());
        let queries = 2 * self.gathered.ranges.len() as u32;
        let results = slot.results.handle;
        // SAFETY: the caller vouches for `cmd`; the buffer holds a header and a word for each query.
        unsafe {
            if queries > 0 && self.gathered.has_attack() {
                let flags = vk::QueryResultFlags::WAIT;
                device.cmd_copy_query_pool_results(
                    cmd,
                    slot.queries,
                    0,
                    queries,
                    results,
                    HEADER,
                    4,
                    flags,
                );
            } else if queries > 0 {
                let size = u64::from(queries) * 4;
                device.cmd_fill_buffer(cmd, results, HEADER, size, 0);
            }
            let written = Access::TRANSFER_WRITE;
            barriers::memory(context, cmd, written, written);
            device.cmd_fill_buffer(cmd, results, 0, 4, slot.serial);
            barriers::memory(context, cmd, written, Access::HOST_READ);
        }
    }
}

/// Counts where the attack is, and changes nothing.
fn over_attack() -> StencilRule {
    StencilRule {
        compare: vk::CompareOp::EQUAL,
        pass: vk::StencilOp::KEEP,
        fail: vk::StencilOp::KEEP,
        mask: ATTACK,
        reference: ATTACK,
        write: 0,
    }
}
