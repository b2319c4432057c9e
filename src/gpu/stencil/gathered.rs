//! Input of a cull in the layout of the device: the cells of the attack, and for each query the boxes in which candidates are drawn.
//!
//! Source: Masaoka & Oshita, section 5.3. Differs: a box covers only those texels of an attack's map that the candidate's map of the
//! same slab, clock and slice can reach, and lies along the attack. If there are none, there is no query.

use std::ops::Range;

use super::{
    balance::Balance,
    boxes::CORNERS,
    cells::{Cell, Cells, Source, TargetLimits},
    maps::{CandidateMap, Maps, Part},
    way_back::WayBack,
};
use crate::{
    gpu::{GpuError, device_path::CullRequest, error::within, shader_table::BoxCorner},
    query::cull::CullCandidate,
};

/// Capacity of a culler.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capacity {
    pub(super) candidates: u32,
    pub(super) discs: u32,
    pub(super) boxes: u32,
    /// Number of queries in a pool.
    pub(super) queries: u32,
    /// Number of columns and rows of the target, in texels.
    pub(super) target: [u32; 2],
}

/// Boxes of one plane, which are drawn together.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    pub(super) plane: u32,
    pub(super) boxes: Range<u32>,
}

/// One count, or a part of it if there are several passes.
#[derive(Clone, Debug)]
pub(super) struct Query {
    pub(super) pass: u32,
    pub(super) candidate: u32,
    pub(super) part: Part,
    pub(super) draws: Range<u32>,
}

/// Input of one cull for the device. The memory is reused; after inputs of similar size nothing is allocated.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) cells: Cells,
    /// Four corners of each box.
    pub(super) corners: Vec<BoxCorner>,
    pub(super) draws: Vec<Draw>,
    /// Queries of each pass.
    pub(super) queries: Vec<Query>,
    ways: Vec<WayBack>,
    balance: Balance,
}

impl Gathered {
    /// Computes the layout of an input.
    pub(super) fn fill(
        &mut self,
        CullRequest { input, counted }: CullRequest<'_>,
        maps: &Maps,
        capacity: &Capacity,
    ) -> Result<(), GpuError> {
        let candidates = input.candidates.len() as u64;
        within(
            "CullerDesc::max_candidates",
            candidates,
            capacity.candidates.into(),
        )?;
        maps.check(input.candidates)?;
        let limits = TargetLimits {
            target: capacity.target,
            discs: capacity.discs,
        };
        let parts = || Maps::parts(counted);
        let of = |part| Source::of(part, maps.slices());
        self.cells.fill(input.attack, limits, |source| {
            parts().any(|part| of(part) == source)
        })?;
        self.clear();
        let turns = input.candidates.iter().map(|one| one.transform);
        self.ways.extend(turns.map(WayBack::new));
        for pass in 0..self.cells.passes.len() as u32 {
            for part in parts() {
                let source = of(part);
                let kind = QueryKind { pass, part, source };
                self.queries(kind, input.candidates, maps);
                let boxes = self.boxes() as u64;
                within("StencilSettings::max_boxes", boxes, capacity.boxes.into())?;
            }
        }
        self.spread(capacity.target);
        Ok(())
    }

    /// Moves everything down so that the work is divided between tiles, if the target is large enough.
    fn spread(&mut self, target: [u32; 2]) {
        // If there are several passes, their targets are full, and all tiles have work.
        let [pass] = &mut *self.cells.passes else {
            return;
        };
        let rows = self.balance.shift(&self.corners, pass.used);
        if rows > 0 && pass.used[1] + rows <= target[1] {
            pass.used[1] += rows;
            self.corners.iter_mut().for_each(|one| one.move_down(rows));
            self.cells.move_down(rows);
        }
    }

    fn boxes(&self) -> usize {
        self.corners.len() / CORNERS
    }

    fn clear(&mut self) {
        self.corners.clear();
        self.draws.clear();
        self.queries.clear();
        self.ways.clear();
    }

    /// Adds a query for each candidate with boxes in a pass.
    fn queries(&mut self, kind: QueryKind, candidates: &[CullCandidate], maps: &Maps) {
        let QueryKind { pass, part, source } = kind;
        let groups = self.cells.passes[pass as usize].groups[source as usize].clone();
        for (candidate, index) in candidates.iter().zip(0..) {
            let first = self.draws.len();
            for group in &self.cells.groups[groups.start as usize..groups.end as usize] {
                if group.clock != candidate.clock {
                    continue;
                }
                let Some(map) = maps.find(candidate, group.slab, part) else {
                    continue;
                };
                let start = self.boxes() as u32;
                let way = &self.ways[index as usize];
                if way.may_meet(&map.whole, group.rect) {
                    let placed = PlacedMap { map, way };
                    let cells = group.cells.start as usize..group.cells.end as usize;
                    placed.push_boxes(&self.cells.cells[cells], &mut self.corners);
                }
                let end = self.boxes() as u32;
                match self.draws[first..].last_mut() {
                    _ if start == end => {}
                    Some(draw) if draw.plane == group.plane => draw.boxes.end = end,
                    _ => self.draws.push(Draw {
                        plane: group.plane,
                        boxes: start..end,
                    }),
                }
            }
            if self.draws.len() > first {
                self.queries.push(Query {
                    pass,
                    candidate: index,
                    part,
                    draws: first as u32..self.draws.len() as u32,
                });
            }
        }
    }
}

/// Kind of the queries of a pass.
#[derive(Clone, Copy)]
struct QueryKind {
    pass: u32,
    part: Part,
    /// Maps of the attack that the part is compared with.
    source: Source,
}

/// A candidate's map with its place in the attack's maps.
struct PlacedMap<'a> {
    map: CandidateMap<'a>,
    way: &'a WayBack,
}

impl PlacedMap<'_> {
    /// Adds the boxes in which the map can overlap the attack's cells.
    fn push_boxes(&self, cells: &[Cell], corners: &mut Vec<BoxCorner>) {
        let Self { map, way } = *self;
        for cell in cells {
            let Some(reach) = map.reach(cell.slice as usize) else {
                continue;
            };
            // Position of the attack's first texel in the target, which may lie outside.
            let origin = [
                cell.place.x as i32 - cell.rect.u,
                cell.place.y as i32 - cell.rect.v,
            ];
            let Some(places) = way.shared(reach, cell, origin) else {
                continue;
            };
            let turn = way.onto(map.bits, origin);
            let bits = [
                map.bits.width | map.bits.height << 16,
                map.bits.first_bit + cell.slice,
                map.bits.row_bits,
                map.bits.texel_bits_log2,
            ];
            corners.extend(places.map(|corner| BoxCorner {
                corner,
                turn,
                map: bits,
            }));
        }
    }
}
