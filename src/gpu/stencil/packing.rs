//! Distributes maps to batches, and packs the maps of a batch into one target.
//!
//! Source: next-fit decreasing height (Coffman, Garey, Johnson & Tarjan, "Performance bounds for level-oriented two-dimensional packing
//! algorithms", 1980). Differs: the height is bounded too. A map that no longer fits starts an empty target, and so does one that would
//! exceed the maximum number of instances.

use super::{batch::Batch, rules, shelves::Shelves};
use crate::{
    gpu::{GpuError, error::within},
    maps::Drawing,
};

/// Capacity of a target and its buffers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BatchLimits {
    /// Side of the target, in texels.
    pub(crate) side: u32,
    /// Maximum number of instances: discs and whole maps.
    pub(crate) instances: u32,
}

/// Assigns drawings to batches. Drawings without texels or without frames are in no batch; their maps are empty.
pub(crate) fn plan(drawings: &[Drawing], limits: BatchLimits) -> Result<Vec<Batch>, GpuError> {
    let mut order = Vec::with_capacity(drawings.len());
    for (index, drawing) in drawings.iter().enumerate() {
        if !is_sound(drawing) {
            return Err(GpuError::FrameEnds { drawing: index });
        }
        if drawing.rect.is_empty() || drawing.frames() == 0 {
            continue;
        }
        let longest = drawing.rect.width.max(drawing.rect.height);
        within("side of a map", longest.into(), limits.side.into())?;
        within(
            "RasterizerDesc::max_discs",
            instances(drawing).into(),
            limits.instances.into(),
        )?;
        order.push(index);
    }
    order.sort_by_key(|&index| std::cmp::Reverse(drawings[index].rect.height));

    let mut batches: Vec<Batch> = Vec::new();
    let mut shelves = Shelves::default();
    for index in order {
        let rect = drawings[index].rect;
        let needed = instances(&drawings[index]);
        let batch = match batches.last_mut() {
            Some(batch) if batch.instances + needed <= limits.instances => batch,
            _ => next(&mut batches, &mut shelves),
        };
        let (batch, cell) = match shelves.place([rect.width, rect.height], [limits.side; 2]) {
            Some(cell) => (batch, cell),
            None => (
                next(&mut batches, &mut shelves),
                shelves.first([rect.width, rect.height]),
            ),
        };
        batch.members.push((index, cell));
        batch.instances += needed;
        batch.used[0] = batch.used[0].max(cell.x + rect.width);
        batch.used[1] = batch.used[1].max(cell.y + rect.height);
    }
    Ok(batches)
}

fn next<'a>(batches: &'a mut Vec<Batch>, shelves: &mut Shelves) -> &'a mut Batch {
    *shelves = Shelves::default();
    batches.push(Batch::default());
    let last = batches.len() - 1;
    &mut batches[last]
}

/// Number of instances of a drawing: its discs, those of the first frame again, and the whole map at the end and at each restart of the
/// count.
fn instances(drawing: &Drawing) -> u32 {
    let restarts = drawing.frames().saturating_sub(1) / rules::FRAMES_BETWEEN_RESTARTS;
    (drawing.discs.len() + drawing.frame(0).len() + 1 + restarts) as u32
}

fn is_sound(drawing: &Drawing) -> bool {
    let ends = &drawing.frame_ends;
    ends.is_sorted() && ends.last().copied().unwrap_or(0) as usize == drawing.discs.len()
}
