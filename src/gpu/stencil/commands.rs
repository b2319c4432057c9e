//! The commands of one cull, in order.

use std::ops::Range;

use ash::vk;

use super::{
    boxes::{BOXES, CORNERS, INDICES, UNITS},
    cells::Pass,
    drawing::{self, Rendering},
    gathered::{Gathered, Query},
    path::StencilPath,
    rules,
    slot::Slot,
};
use crate::gpu::{
    barriers::{self, Access, StencilBarrier},
    counts::{HEADER, record_numbers},
    passes::Passes,
    pipelines::StencilRule,
    shader_table::TargetSide,
};

const GRAPHICS: vk::PipelineBindPoint = vk::PipelineBindPoint::GRAPHICS;

/// Queries of one pass that fit the pool. They are rendered and copied together.
struct Turn<'a> {
    pass: &'a Pass,
    queries: &'a [Query],
    /// Index of the first query among the counts of the cull.
    first: u64,
    begins_pass: bool,
    ends_pass: bool,
}

/// One cull of a batch.
struct Cull<'a> {
    gathered: &'a Gathered,
    slot: &'a Slot,
}

impl StencilPath {
    /// # Safety
    /// As for [`Culler::record_batch`](crate::gpu::Culler::record_batch); the slots have the discs and boxes of the batch.
    pub(super) unsafe fn record_commands(&self, passes: &mut Passes<'_>, slots: &[usize]) {
        // SAFETY: the caller vouches for the command buffer and the slots.
        unsafe {
            for (gathered, &slot) in self.entries.iter().zip(slots) {
                let slot = &self.parts.slots[slot];
                self.record_cull(passes, &Cull { gathered, slot });
            }
            let counts = slots.iter().map(|&slot| &self.parts.slots[slot].counts);
            record_numbers(passes, Access::TRANSFER_WRITE, counts);
        }
    }

    /// Records one cull.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`].
    unsafe fn record_cull(&self, passes: &mut Passes<'_>, cull: &Cull<'_>) {
        let gathered = cull.gathered;
        let (mut first, size) = (0, self.capacity.queries as usize);
        for queries in gathered.queries.chunk_by(|a, b| a.pass == b.pass) {
            let pass = &gathered.cells.passes[queries[0].pass as usize];
            let turns = queries.len().div_ceil(size);
            for (turn, queries) in queries.chunks(size).enumerate() {
                let turn = Turn {
                    pass,
                    queries,
                    first,
                    begins_pass: turn == 0,
                    ends_pass: turn + 1 == turns,
                };
                // SAFETY: the caller vouches for the command buffer and the slot.
                unsafe { self.record_turn(passes, cull, &turn) };
                first += queries.len() as u64;
            }
        }
    }

    /// Records the attack, unless it is already in the target, then queries and the copy of their counts.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`].
    unsafe fn record_turn(&self, passes: &mut Passes<'_>, cull: &Cull<'_>, turn: &Turn<'_>) {
        let (context, parts, cmd) = (&self.context, &self.parts, passes.cmd);
        let (device, count) = (context.device(), turn.queries.len() as u32);
        let rendering = Rendering {
            target: &parts.target,
            used: turn.pass.used,
            clear: turn.begins_pass.then_some(0),
            stored: !turn.ends_pass,
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, the pool holds the
        // queries, and the results have a word for each.
        unsafe {
            device.cmd_reset_query_pool(cmd, parts.pool, 0, count);
            let barrier = StencilBarrier::before_drawing(parts.target.image, turn.begins_pass);
            barriers::stencil_image(context, cmd, barrier);
            drawing::begin(context, cmd, rendering);
            if turn.begins_pass {
                passes.begin(c"sabaki: attack");
                self.record_attack(cmd, cull, turn.pass);
                passes.end();
            }
            passes.begin(c"sabaki: candidates");
            self.record_queries(cmd, cull, turn.queries);
            passes.end();
            device.cmd_end_rendering(cmd);
            device.cmd_copy_query_pool_results(
                cmd,
                parts.pool,
                0,
                count,
                cull.slot.counts.buffer.handle,
                HEADER + 4 * turn.first,
                4,
                vk::QueryResultFlags::WAIT,
            );
        }
    }

    /// Records the attack's maps, plane by plane.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn record_attack(&self, cmd: vk::CommandBuffer, cull: &Cull<'_>, pass: &Pass) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let constants = TargetSide {
            side: parts.target.side,
        };
        let planes = pass.planes.start as usize..pass.planes.end as usize;
        // SAFETY: the caller vouches for `cmd`; all handles are this path's.
        unsafe {
            device.cmd_bind_pipeline(cmd, GRAPHICS, parts.discs.handle);
            parts.discs.push(context, cmd, &constants);
            device.cmd_bind_vertex_buffers(cmd, 0, &[cull.slot.discs.handle], &[0]);
            for plane in &cull.gathered.cells.planes[planes] {
                into_plane(plane.bit).set(context, cmd);
                let discs = plane.discs.end - plane.discs.start;
                device.cmd_draw(cmd, 4, discs, 0, plane.discs.start);
            }
        }
    }

    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn record_queries(&self, cmd: vk::CommandBuffer, cull: &Cull<'_>, queries: &[Query]) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let precision = if context.features().precise_queries {
            vk::QueryControlFlags::PRECISE
        } else {
            vk::QueryControlFlags::empty()
        };
        let mut plane = None;
        // SAFETY: the caller vouches for `cmd`; the queries were reset, and precise ones are
        // enabled.
        unsafe {
            self.bind_candidates(cmd, cull);
            for (query, number) in queries.iter().zip(0..) {
                device.cmd_begin_query(cmd, parts.pool, number, precision);
                let draws = query.draws.start as usize..query.draws.end as usize;
                for draw in &cull.gathered.draws[draws] {
                    if plane != Some(draw.plane) {
                        plane = Some(draw.plane);
                        let bit = cull.gathered.cells.planes[draw.plane as usize].bit;
                        over_plane(bit).set(context, cmd);
                    }
                    self.draw_boxes(cmd, draw.boxes.clone());
                }
                device.cmd_end_query(cmd, parts.pool, number);
            }
        }
    }

    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn bind_candidates(&self, cmd: vk::CommandBuffer, cull: &Cull<'_>) {
        let (context, parts) = (&self.context, &self.parts);
        let (device, pipeline) = (context.device(), &parts.candidates);
        let constants = TargetSide {
            side: parts.target.side.map(|side| side * UNITS),
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this path's.
        unsafe {
            device.cmd_bind_pipeline(cmd, GRAPHICS, pipeline.handle);
            let sets = [parts.atlas.set];
            device.cmd_bind_descriptor_sets(cmd, GRAPHICS, pipeline.layout, 0, &sets, &[]);
            device.cmd_bind_vertex_buffers(cmd, 0, &[cull.slot.corners.handle], &[0]);
            let indices = parts.indices.handle;
            device.cmd_bind_index_buffer(cmd, indices, 0, vk::IndexType::UINT16);
            pipeline.push(context, cmd, &constants);
        }
    }

    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering; candidates are bound.
    unsafe fn draw_boxes(&self, cmd: vk::CommandBuffer, boxes: Range<u32>) {
        for first in boxes.clone().step_by(BOXES as usize) {
            let count = BOXES.min(boxes.end - first) * INDICES;
            let corner = (first as usize * CORNERS) as i32;
            // SAFETY: the caller vouches for `cmd`. The slot has the corners of these boxes, and there are indices for all boxes of a draw.
            unsafe {
                let device = self.context.device();
                device.cmd_draw_indexed(cmd, count, 1, 0, corner, 0);
            }
        }
    }
}

/// Stencil state that sets the bit of one plane where the attack is drawn.
fn into_plane(bit: u32) -> StencilRule {
    StencilRule {
        write: bit,
        ..rules::draw(bit)
    }
}

/// Stencil state that passes where the bit of one plane is set, and writes nothing.
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
