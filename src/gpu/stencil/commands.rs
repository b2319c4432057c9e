//! The commands of one cull, in order.

use ash::vk;

use super::{
    cells::Pass,
    culler::Culler,
    drawing::{self, Rendering},
    gathered::Query,
    passes,
    slot::{HEADER, Slot},
};
use crate::gpu::{
    barriers::{self, Access},
    pipelines::StencilRule,
    shader_table::TargetSide,
};

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;

/// Queries of one pass that fit the pool: what is rendered and copied in one go.
struct Turn<'a> {
    pass: &'a Pass,
    queries: &'a [Query],
    /// Of the first one, among the counts of the cull.
    first: u64,
    begins_pass: bool,
    ends_pass: bool,
}

impl Culler {
    /// # Safety
    /// As for [`Culler::record`]; the slot has this cull's discs, turns and boxes.
    pub(super) unsafe fn record_commands(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        // SAFETY: the caller vouches for `cmd` and the slot.
        unsafe {
            self.record_uploads(cmd, slot);
            let (mut first, size) = (0, self.capacity.queries as usize);
            for queries in self.gathered.queries.chunk_by(|a, b| a.pass == b.pass) {
                let pass = &self.gathered.cells.passes[queries[0].pass as usize];
                let turns = queries.len().div_ceil(size);
                for (turn, queries) in queries.chunks(size).enumerate() {
                    self.record_turn(
                        cmd,
                        slot,
                        &Turn {
                            pass,
                            queries,
                            first,
                            begins_pass: turn == 0,
                            ends_pass: turn + 1 == turns,
                        },
                    );
                    first += queries.len() as u64;
                }
            }
            self.record_serial(cmd, slot);
        }
    }

    /// # Safety
    /// As for [`Culler::record_commands`].
    unsafe fn record_uploads(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let device = self.context.device();
        let turns = size_of_val(self.gathered.turns.as_slice()) as u64;
        let boxes = size_of_val(self.gathered.boxes.as_slice()) as u64;
        if boxes == 0 {
            return;
        }
        // SAFETY: the caller vouches for `cmd`; the buffers hold this many bytes.
        unsafe {
            let copy = |start, size| [vk::BufferCopy::default().src_offset(start).size(size)];
            let from = slot.upload.handle;
            device.cmd_copy_buffer(cmd, from, slot.turns.handle, &copy(0, turns));
            device.cmd_copy_buffer(cmd, from, slot.boxes.handle, &copy(turns, boxes));
            let (before, after) = (Access::TRANSFER_WRITE, Access::SHADER_READ);
            barriers::memory(&self.context, cmd, before, after);
        }
    }

    /// The attack, unless the target has it; then some queries, and the way of their counts.
    ///
    /// # Safety
    /// As for [`Culler::record_commands`].
    unsafe fn record_turn(&self, cmd: vk::CommandBuffer, slot: &Slot, turn: &Turn<'_>) {
        let (context, parts) = (&self.context, &self.parts);
        let (device, count) = (context.device(), turn.queries.len() as u32);
        let rendering = Rendering {
            used: turn.pass.used,
            clear: turn.begins_pass.then_some(0),
            stored: !turn.ends_pass,
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this culler's, the pool holds the
        // queries, and the results have a word for each.
        unsafe {
            device.cmd_reset_query_pool(cmd, slot.pool, 0, count);
            let (image, uses) = (parts.target.image, (Access::STENCIL, Access::STENCIL));
            barriers::stencil_image(context, cmd, image, uses, turn.begins_pass);
            drawing::begin(context, cmd, &parts.target, rendering);
            if turn.begins_pass {
                self.record_attack(cmd, slot, turn.pass);
            }
            self.record_queries(cmd, slot, turn.queries);
            device.cmd_end_rendering(cmd);
            device.cmd_copy_query_pool_results(
                cmd,
                slot.pool,
                0,
                count,
                slot.results.handle,
                HEADER + 4 * turn.first,
                4,
                vk::QueryResultFlags::WAIT,
            );
        }
    }

    /// The attack's maps, a plane after the other.
    ///
    /// # Safety
    /// As for [`Culler::record_commands`], within the rendering.
    unsafe fn record_attack(&self, cmd: vk::CommandBuffer, slot: &Slot, pass: &Pass) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let constants = TargetSide {
            side: parts.target.side,
        };
        let planes = pass.planes.start as usize..pass.planes.end as usize;
        // SAFETY: the caller vouches for `cmd`; all handles are this culler's.
        unsafe {
            device.cmd_bind_pipeline(cmd, GRAPHICS, parts.discs.handle);
            let vertex = vk::ShaderStageFlags::VERTEX;
            parts.discs.push(context, cmd, vertex, &constants);
            device.cmd_bind_vertex_buffers(cmd, 0, &[slot.discs.handle], &[0]);
            for plane in &self.gathered.cells.planes[planes] {
                into_plane(plane.bit).set(context, cmd);
                let discs = plane.discs.end - plane.discs.start;
                device.cmd_draw(cmd, 4, discs, 0, plane.discs.start);
            }
        }
    }

    /// # Safety
    /// As for [`Culler::record_commands`], within the rendering.
    unsafe fn record_queries(&self, cmd: vk::CommandBuffer, slot: &Slot, queries: &[Query]) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let constants = TargetSide {
            side: parts.target.side,
        };
        let precision = if context.precise_queries() {
            vk::QueryControlFlags::PRECISE
        } else {
            vk::QueryControlFlags::empty()
        };
        let pipeline = &parts.candidates;
        let mut plane = None;
        // SAFETY: the caller vouches for `cmd`; the queries were reset, and precise ones are
        // enabled.
        unsafe {
            device.cmd_bind_pipeline(cmd, GRAPHICS, pipeline.handle);
            device.cmd_bind_descriptor_sets(cmd, GRAPHICS, pipeline.layout, 0, &[slot.set], &[]);
            pipeline.push(context, cmd, vk::ShaderStageFlags::VERTEX, &constants);
            for (query, number) in queries.iter().zip(0..) {
                device.cmd_begin_query(cmd, slot.pool, number, precision);
                let draws = query.draws.start as usize..query.draws.end as usize;
                for draw in &self.gathered.draws[draws] {
                    if plane != Some(draw.plane) {
                        plane = Some(draw.plane);
                        let bit = self.gathered.cells.planes[draw.plane as usize].bit;
                        over_plane(bit).set(context, cmd);
                    }
                    let boxes = draw.boxes.end - draw.boxes.start;
                    let (count, first) = (VERTICES * boxes, VERTICES * draw.boxes.start);
                    device.cmd_draw(cmd, count, 1, first, query.candidate);
                }
                device.cmd_end_query(cmd, slot.pool, number);
            }
        }
    }

    /// The number that says that the counts are there.
    ///
    /// # Safety
    /// As for [`Culler::record_commands`].
    unsafe fn record_serial(&self, cmd: vk::CommandBuffer, slot: &Slot) {
        let (context, written) = (&self.context, Access::TRANSFER_WRITE);
        // SAFETY: the caller vouches for `cmd`; the buffer begins with a header.
        unsafe {
            barriers::memory(context, cmd, written, written);
            let device = context.device();
            device.cmd_fill_buffer(cmd, slot.results.handle, 0, 4, slot.serial);
            barriers::memory(context, cmd, written, Access::HOST_READ);
        }
    }
}

/// Of a box: two triangles.
const VERTICES: u32 = 6;

/// Marks what the attack touches in one plane, and leaves the others.
fn into_plane(bit: u32) -> StencilRule {
    StencilRule {
        write: bit,
        ..passes::draw(bit)
    }
}

/// Counts where the attack is in one plane, and changes nothing.
fn over_plane(bit: u32) -> StencilRule {
    StencilRule {
        compare: vk::CompareOp::EQUAL,
        pass: vk::StencilOp::KEEP,
        fail: vk::StencilOp::KEEP,
        mask: bit,
        reference: bit,
        write: 0,
    }
}
