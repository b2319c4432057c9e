//! The commands of one cull, in order.

use std::ops::Range;

use ash::vk;

use super::{
    boxes::CORNERS,
    boxes::{BOXES, INDICES},
    cells::Pass,
    drawing::{self, Rendering},
    gathered::Query,
    path::StencilPath,
    rules,
    slot::Slot,
};
use crate::gpu::{
    Counting,
    barriers::{self, Access},
    counts::HEADER,
    passes::Passes,
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

impl StencilPath {
    /// # Safety
    /// As for [`Culler::record`](crate::gpu::Culler::record); the slot has this cull's discs and boxes.
    pub(super) unsafe fn record_commands(&self, passes: &mut Passes<'_>, slot: &Slot) {
        if self.counting == Counting::Atomics {
            // SAFETY: as the caller says.
            return unsafe { self.record_tally(passes, slot) };
        }
        // SAFETY: the caller vouches for `cmd` and the slot.
        unsafe {
            let (mut first, size) = (0, self.capacity.queries as usize);
            for queries in self.gathered.queries.chunk_by(|a, b| a.pass == b.pass) {
                let pass = &self.gathered.cells.passes[queries[0].pass as usize];
                let turns = queries.len().div_ceil(size);
                for (turn, queries) in queries.chunks(size).enumerate() {
                    self.record_turn(
                        passes,
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
            self.record_number(passes, slot);
        }
    }

    /// The number that says that the counts are there.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`].
    unsafe fn record_number(&self, passes: &mut Passes<'_>, slot: &Slot) {
        // SAFETY: the caller vouches for the command buffer.
        unsafe {
            passes.begin(c"sabaki: counts to the host");
            slot.counts
                .record_number(&self.context, passes.cmd, Access::TRANSFER_WRITE);
            passes.end();
        }
    }

    /// The attack, and over it all boxes, pass by pass; then the way of their sums.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`].
    unsafe fn record_tally(&self, passes: &mut Passes<'_>, slot: &Slot) {
        let (context, parts, gathered) = (&self.context, &self.parts, &self.gathered);
        let cmd = passes.cmd;
        let queries = &gathered.queries;
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, and there is a sum for each query.
        unsafe {
            if !queries.is_empty() {
                slot.sums.record_start(context, cmd, queries);
                for queries in queries.chunk_by(|a, b| a.pass == b.pass) {
                    let pass = &gathered.cells.passes[queries[0].pass as usize];
                    let rendering = Rendering {
                        used: pass.used,
                        clear: Some(0),
                        stored: false,
                    };
                    let (image, uses) = (parts.target.image, (Access::STENCIL, Access::STENCIL));
                    barriers::stencil_image(context, cmd, image, uses, true);
                    drawing::begin(context, cmd, &parts.target, rendering);
                    passes.begin(c"sabaki: attack");
                    self.record_attack(cmd, slot, pass);
                    passes.end();
                    passes.begin(c"sabaki: candidates");
                    self.record_planes(cmd, slot, pass);
                    passes.end();
                    context.device().cmd_end_rendering(cmd);
                }
                slot.sums.record_end(context, cmd, (&slot.counts, queries));
            }
            self.record_number(passes, slot);
        }
    }

    /// The boxes of all candidates, a plane after the other.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn record_planes(&self, cmd: vk::CommandBuffer, slot: &Slot, pass: &Pass) {
        // SAFETY: the caller vouches for `cmd`; all handles are this path's.
        unsafe {
            self.bind_candidates(cmd, slot, slot.sums.set);
            for plane in pass.planes.clone() {
                let boxes = &self.by_plane.boxes[plane as usize];
                if !boxes.is_empty() {
                    let bit = self.gathered.cells.planes[plane as usize].bit;
                    over_plane(bit).set(&self.context, cmd);
                    self.draw_boxes(cmd, boxes.clone());
                }
            }
        }
    }

    /// The attack, unless the target has it; then some queries, and the way of their counts.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`].
    unsafe fn record_turn(&self, passes: &mut Passes<'_>, slot: &Slot, turn: &Turn<'_>) {
        let (context, parts, cmd) = (&self.context, &self.parts, passes.cmd);
        let (device, count) = (context.device(), turn.queries.len() as u32);
        let rendering = Rendering {
            used: turn.pass.used,
            clear: turn.begins_pass.then_some(0),
            stored: !turn.ends_pass,
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this path's, the pool holds the
        // queries, and the results have a word for each.
        unsafe {
            device.cmd_reset_query_pool(cmd, slot.pool, 0, count);
            let (image, uses) = (parts.target.image, (Access::STENCIL, Access::STENCIL));
            barriers::stencil_image(context, cmd, image, uses, turn.begins_pass);
            drawing::begin(context, cmd, &parts.target, rendering);
            if turn.begins_pass {
                passes.begin(c"sabaki: attack");
                self.record_attack(cmd, slot, turn.pass);
                passes.end();
            }
            passes.begin(c"sabaki: candidates");
            self.record_queries(cmd, slot, turn.queries);
            passes.end();
            device.cmd_end_rendering(cmd);
            device.cmd_copy_query_pool_results(
                cmd,
                slot.pool,
                0,
                count,
                slot.counts.buffer.handle,
                HEADER + 4 * turn.first,
                4,
                vk::QueryResultFlags::WAIT,
            );
        }
    }

    /// The attack's maps, a plane after the other.
    ///
    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn record_attack(&self, cmd: vk::CommandBuffer, slot: &Slot, pass: &Pass) {
        let (context, parts) = (&self.context, &self.parts);
        let device = context.device();
        let constants = TargetSide {
            side: parts.target.side,
        };
        let planes = pass.planes.start as usize..pass.planes.end as usize;
        // SAFETY: the caller vouches for `cmd`; all handles are this path's.
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
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn record_queries(&self, cmd: vk::CommandBuffer, slot: &Slot, queries: &[Query]) {
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
            self.bind_candidates(cmd, slot, parts.atlas.set);
            for (query, number) in queries.iter().zip(0..) {
                device.cmd_begin_query(cmd, slot.pool, number, precision);
                let draws = query.draws.start as usize..query.draws.end as usize;
                for draw in &self.gathered.draws[draws] {
                    if plane != Some(draw.plane) {
                        plane = Some(draw.plane);
                        let bit = self.gathered.cells.planes[draw.plane as usize].bit;
                        over_plane(bit).set(context, cmd);
                    }
                    self.draw_boxes(cmd, draw.boxes.clone());
                }
                device.cmd_end_query(cmd, slot.pool, number);
            }
        }
    }

    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering.
    unsafe fn bind_candidates(&self, cmd: vk::CommandBuffer, slot: &Slot, set: vk::DescriptorSet) {
        let (context, parts) = (&self.context, &self.parts);
        let (device, pipeline) = (context.device(), &parts.candidates);
        let constants = TargetSide {
            side: parts.target.side,
        };
        // SAFETY: the caller vouches for `cmd`; all handles are this path's.
        unsafe {
            device.cmd_bind_pipeline(cmd, GRAPHICS, pipeline.handle);
            device.cmd_bind_descriptor_sets(cmd, GRAPHICS, pipeline.layout, 0, &[set], &[]);
            device.cmd_bind_vertex_buffers(cmd, 0, &[slot.corners.handle], &[0]);
            let indices = parts.indices.handle;
            device.cmd_bind_index_buffer(cmd, indices, 0, vk::IndexType::UINT16);
            pipeline.push(context, cmd, vk::ShaderStageFlags::VERTEX, &constants);
        }
    }

    /// # Safety
    /// As for [`StencilPath::record_commands`], within the rendering; candidates are bound.
    unsafe fn draw_boxes(&self, cmd: vk::CommandBuffer, boxes: Range<u32>) {
        for first in boxes.clone().step_by(BOXES as usize) {
            let count = BOXES.min(boxes.end - first) * INDICES;
            let corner = (first as usize * CORNERS) as i32;
            // SAFETY: the caller vouches for `cmd`; the slot has corners of so many boxes, and there are indices for a draw's.
            unsafe {
                let device = self.context.device();
                device.cmd_draw_indexed(cmd, count, 1, 0, corner, 0);
            }
        }
    }
}

/// Marks what the attack touches in one plane, and leaves the others.
fn into_plane(bit: u32) -> StencilRule {
    StencilRule {
        write: bit,
        ..rules::draw(bit)
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
