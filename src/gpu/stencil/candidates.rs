//! A cull's input, laid out for the device: discs of the attack, and candidates slab by slab.

use std::ops::Range;

use super::{bits::PackedBits, drawing::Cell};
use crate::{
    avoid::cull::{CullCandidate, CullInput},
    gpu::{
        GpuError,
        error::{Mismatch, within},
        shader_table::{Placed, PlacedDisc},
    },
    region::Slab,
};

/// The most that a culler takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capacity {
    pub(super) candidates: u32,
    pub(super) slabs: u32,
    pub(super) discs: u32,
    /// Sides of the attack's target, texels.
    pub(super) target: [u32; 2],
    pub(super) regions: usize,
}

impl Capacity {
    pub(super) fn placed(&self) -> u32 {
        self.candidates.saturating_mul(self.slabs)
    }
}

/// One cull on its way to the device. Used again and again, so that it allocates nothing after it was made.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) discs: Vec<PlacedDisc>,
    pub(super) placed: Vec<Placed>,
    /// For each candidate, which of `placed` are its.
    pub(super) ranges: Vec<Range<u32>>,
    /// Size of the attack's map in each slab.
    pub(super) attack: [u32; 2],
    /// Texels of the target that are in use.
    pub(super) used: [u32; 2],
    slabs: Vec<(Slab, Cell)>,
}

impl Gathered {
    pub(super) fn with_capacity(capacity: &Capacity) -> Self {
        Self {
            discs: Vec::with_capacity(capacity.discs as usize),
            placed: Vec::with_capacity(capacity.placed() as usize),
            ranges: Vec::with_capacity(capacity.candidates as usize),
            slabs: Vec::with_capacity(capacity.slabs as usize),
            ..Self::default()
        }
    }

    /// Lays an input out.
    pub(super) fn fill(
        &mut self,
        input: &CullInput<'_>,
        packed: &PackedBits,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        let candidates = input.candidates.len() as u64;
        within(
            "CullerDesc::max_candidates",
            candidates,
            capacity.candidates.into(),
        )?;
        self.attack(input, capacity)?;
        self.candidates(input.candidates, packed, capacity)
    }

    /// Whether the attack has a texel at all.
    pub(super) fn has_attack(&self) -> bool {
        self.used[0] > 0 && self.used[1] > 0
    }

    /// Puts the slabs' maps side by side, in rows.
    fn attack(&mut self, input: &CullInput<'_>, capacity: &Capacity) -> Result<(), GpuError> {
        self.discs.clear();
        self.slabs.clear();
        (self.attack, self.used) = ([0; 2], [0; 2]);
        let layers = &input.attack.layers;
        let slabs = layers.len() as u64;
        within("CullerDesc::max_slabs", slabs, capacity.slabs.into())?;
        let discs = layers.iter().map(|layer| layer.inner.len() as u64).sum();
        within("CullerDesc::max_discs", discs, capacity.discs.into())?;

        let rect = input.attack.rect;
        let [width, height] = [rect.width, rect.height];
        if rect.is_empty() {
            return Ok(());
        }
        let limit = "CullerDesc::max_attack_texels";
        within(limit, width.into(), capacity.target[0].into())?;
        let columns = capacity.target[0] / width;
        let rows = (layers.len() as u32).div_ceil(columns);
        within(
            limit,
            u64::from(rows) * u64::from(height),
            capacity.target[1].into(),
        )?;
        self.attack = [width, height];
        self.used = [columns.min(layers.len() as u32) * width, rows * height];
        for (layer, index) in layers.iter().zip(0..) {
            let cell = Cell {
                x: index % columns * width,
                y: index / columns * height,
            };
            let [inner, _] = input.attack.discs_of(layer);
            let placed = inner.iter().map(|timed| cell.place(timed.disc, rect));
            self.discs.extend(placed);
            self.slabs.push((layer.slab, cell));
        }
        Ok(())
    }

    fn candidates(
        &mut self,
        candidates: &[CullCandidate],
        packed: &PackedBits,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        self.placed.clear();
        self.ranges.clear();
        for (index, candidate) in candidates.iter().enumerate() {
            if candidate.region.index() >= capacity.regions {
                return Err(Mismatch::Region {
                    candidate: index,
                    region: candidate.region.0,
                    regions: capacity.regions,
                }
                .into());
            }
            let first = self.placed.len() as u32;
            let turn = candidate.turn;
            for &(slab, cell) in &self.slabs {
                if let Some(maps) = packed.find(candidate.region, slab) {
                    self.placed.push(Placed {
                        turn: [turn.a, turn.b, turn.tx, turn.tz],
                        cell: [cell.x, cell.y],
                        maps,
                        padding: 0,
                    });
                }
            }
            self.ranges.push(first..self.placed.len() as u32);
        }
        Ok(())
    }
}
