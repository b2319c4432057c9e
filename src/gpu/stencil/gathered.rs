//! Input of a cull in the layout of the device: the cells of the attack, and for each query the boxes in which candidates are drawn.
//!
//! Source: Masaoka & Oshita, section 5.3. Differs: a box covers only those texels of an attack's map that the candidate's map of the
//! same slab, clock and slice can reach. If there are none, there is no query.

use std::ops::Range;

use super::{
    balance::Balance,
    boxes::CORNERS,
    cells::{Cell, Cells, Room, Source},
    maps::{CandidateMap, MapBits, Maps, Part, Reach},
};
use crate::{
    gpu::{GpuError, device_path::CullRequest, error::within, shader_table::BoxCorner},
    maps::{FixedTransform2, MapRect},
    query::cull::{Counted, CullCandidate},
};

/// First bit of a box's number in `map.w` (`shaders/include/candidate.glsl`), above log2 of the bits of a texel.
const NUMBER_SHIFT: u32 = 5;
/// Maximum number of numbers in these bits.
pub(super) const MOST_BOXES: u32 = 1 << (32 - NUMBER_SHIFT);

/// Capacity of a culler.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capacity {
    pub(super) candidates: u32,
    pub(super) discs: u32,
    pub(super) boxes: u32,
    /// Number of queries in a pool.
    pub(super) queries: u32,
    /// Sides of the target, in texels.
    pub(super) target: [u32; 2],
}

/// Whether a part is counted.
fn has(counted: Counted, part: Part) -> bool {
    match part {
        Part::Body => counted.body,
        Part::Outer => counted.outer,
        Part::Evasion => counted.evasion,
    }
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
        let room = Room {
            target: capacity.target,
            discs: capacity.discs,
        };
        let parts = || Part::ALL.into_iter().filter(|&part| has(counted, part));
        let of = |part| Source::of(part, maps.slices());
        self.cells.fill(input.attack, room, |source| {
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

    /// Moves everything so that the work is divided between tiles, if the target has room.
    fn spread(&mut self, target: [u32; 2]) {
        // Several passes are as many tiles full.
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
                if !way
                    .around(&map.reaches[0])
                    .intersection(group.rect)
                    .is_empty()
                {
                    let placed = PlacedMap {
                        map,
                        way,
                        query: self.queries.len() as u32,
                    };
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

/// The part of the candidates that queries count in a pass.
#[derive(Clone, Copy)]
struct QueryKind {
    pass: u32,
    part: Part,
    /// Maps of the attack that the part is counted in.
    source: Source,
}

/// A candidate's map with its place in the attack's maps.
struct PlacedMap<'a> {
    map: CandidateMap<'a>,
    way: &'a WayBack,
    /// Number of the query that counts it.
    query: u32,
}

impl PlacedMap<'_> {
    /// Adds the boxes in which the map can overlap the attack's cells.
    fn push_boxes(&self, cells: &[Cell], corners: &mut Vec<BoxCorner>) {
        let Self { map, way, query } = *self;
        for cell in cells {
            let Some(reach) = map.reaches.get(1 + cell.slice as usize) else {
                continue;
            };
            let shared = way.around(reach).intersection(cell.rect);
            if shared.is_empty() {
                continue;
            }
            // In the target, where the first texel of the attack's rectangle may lie outside.
            let origin = [
                cell.place.x as i32 - cell.rect.u,
                cell.place.y as i32 - cell.rect.v,
            ];
            let low = [origin[0] + shared.u, origin[1] + shared.v];
            let high = [low[0] + shared.width as i32, low[1] + shared.height as i32];
            let turn = way.onto(map.bits, origin);
            let bits = [
                map.bits.width | map.bits.height << 16,
                map.bits.first_bit + cell.slice,
                map.bits.row_bits,
                map.bits.texel_bits_log2 | query << NUMBER_SHIFT,
            ];
            let places = [low, [high[0], low[1]], [low[0], high[1]], high];
            corners.extend(places.map(|place| BoxCorner {
                corner: place.map(|texel| texel as u16),
                turn,
                map: bits,
            }));
        }
    }
}

/// Transform from an evasion's frame to the attack's maps in single precision, for boxes that are slightly too large.
#[derive(Clone, Copy, Debug)]
struct WayBack {
    cos: f32,
    sin: f32,
    /// Translation in the evasion's frame, in texels.
    from: [f32; 2],
    /// The inverse transform, or `None` if the rotation is 0.
    exists: bool,
    turn: FixedTransform2,
}

impl WayBack {
    /// Margin around a map, in texels: half a texel from centre to border, and the error of single precision.
    const MARGIN: f32 = 1.0;

    fn new(turn: FixedTransform2) -> Self {
        let (a, b) = (turn.a as f32, turn.b as f32);
        let one = (1u32 << (FixedTransform2::SHIFT - 1)) as f32;
        let squared = a * a + b * b;
        let scale = one / squared.max(1.0);
        Self {
            cos: a * scale,
            sin: b * scale,
            from: [turn.tx, turn.tz].map(|place| place as f32 / (2.0 * one)),
            exists: squared > 0.25 * one * one,
            turn,
        }
    }

    /// `FixedTransform2::texel` with the positions of both maps in the translation: from texels of the target, in which the attack's first
    /// texel is at `origin`, to texels of the map. Intermediate sums may wrap; the result fits.
    fn onto(&self, map: &MapBits, [x, y]: [i32; 2]) -> [i32; 4] {
        let FixedTransform2 { a, b, tx, tz } = self.turn;
        let placed = |start: i32, along: i32, across: i32, texel: i32| {
            start
                .wrapping_sub(along.wrapping_mul(2 * x))
                .wrapping_sub(across.wrapping_mul(2 * y))
                .wrapping_sub(texel << FixedTransform2::SHIFT)
        };
        [a, b, placed(tx, a, b, map.u), placed(tz, -b, a, map.v)]
    }

    /// Bounding rectangle of all texel centres that the transform may move into a rectangle.
    fn around(&self, reach: &Reach) -> MapRect {
        if reach.is_empty() {
            return MapRect::default();
        }
        if !self.exists {
            return EVERYWHERE;
        }
        let [x, z] = [0, 1].map(|axis| reach.middle[axis] - self.from[axis]);
        let half = [
            self.cos.abs() * reach.half[0] + self.sin.abs() * reach.half[1] + Self::MARGIN,
            self.sin.abs() * reach.half[0] + self.cos.abs() * reach.half[1] + Self::MARGIN,
        ];
        let middle = [self.cos * x - self.sin * z, self.sin * x + self.cos * z];
        let low = [0, 1].map(|axis| (middle[axis] - half[axis]).floor() as i32);
        let high = [0, 1].map(|axis| (middle[axis] + half[axis]).ceil() as i32);
        MapRect {
            u: low[0],
            v: low[1],
            width: (high[0] - low[0]) as u32,
            height: (high[1] - low[1]) as u32,
        }
    }
}

/// Larger than the side of any attack's map.
const EVERYWHERE: MapRect = MapRect {
    u: -(1 << 20),
    v: -(1 << 20),
    width: 1 << 21,
    height: 1 << 21,
};
