//! Layout of the attack's maps in the target. Each slab, clock and slice has a cell, which is the bounding rectangle of its discs.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is drawn once into the stencil of each slab.
//! Differs: each slice of time has a stencil, too. A target has eight planes, one for each stencil bit. Cells are packed into the first
//! plane while they fit, then into the next one. If all eight are full, another pass starts with an empty target. A cell that is
//! larger than the target is divided. Where the discs of a cell form a band across its rectangle, candidates are drawn along the band
//! (`slant.rs`).

use std::ops::Range;

use super::{
    maps::Part,
    shelves::{Place, Shelves},
    slant::Slant,
};
use crate::{
    gpu::{GpuError, error::within, shader_table::PlacedDisc},
    maps::{MapRect, Slab},
    query::cull::{AttackDrawing, TimedDisc},
};

/// Number of planes of a target: the bits of a stencil value.
pub(super) const PLANES: u32 = 8;

/// Kind of a map of the attack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Source {
    /// Inner discs of one slice.
    Inner,
    /// Outer discs of one slice.
    Outer,
    /// Inner discs of all slices.
    Any,
}

/// One map of the attack, or a part of it.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Index of the plane, counted from the first plane of the first pass.
    plane: u32,
    source: Source,
    /// Index in [`AttackDrawing::layers`].
    layer: u32,
    pub(super) slice: u32,
    /// Rectangle relative to that of the attack.
    pub(super) rect: MapRect,
    /// Rectangle that boxes may cover. It contains `rect` and overlaps no other cell of the plane.
    free_rect: MapRect,
    /// Rectangle around the discs, rotated if that makes it smaller.
    pub(super) slant: Slant,
    /// Position of the rectangle in the target.
    pub(super) place: Place,
    /// Range in [`AttackDrawing::discs`]. Some discs may lie outside the cell.
    discs: Range<u32>,
}

/// Discs of one kind of a layer of the attack.
struct Layer {
    /// Index in [`AttackDrawing::layers`].
    index: u32,
    source: Source,
    /// Range in [`AttackDrawing::discs`].
    discs: Range<u32>,
}

impl Layer {
    /// Cell of one slice with all discs, without rectangle and position.
    fn cell(&self, slice: u32) -> Cell {
        Cell {
            plane: 0,
            source: self.source,
            layer: self.index,
            slice,
            rect: MapRect::default(),
            free_rect: MapRect::default(),
            slant: Slant::default(),
            place: Place::default(),
            discs: self.discs.clone(),
        }
    }
}

/// Cells of one layer and plane, over which a candidate is drawn together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) plane: u32,
    pub(super) slab: Slab,
    pub(super) clock: u32,
    /// Bounding rectangle of the cells.
    pub(super) rect: MapRect,
    pub(super) cells: Range<u32>,
}

/// Discs that are drawn into one plane.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub(super) bit: u32,
    pub(super) discs: Range<u32>,
}

/// Cells between two clears of the target.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    pub(super) planes: Range<u32>,
    /// Groups by [`Source`].
    pub(super) groups: [Range<u32>; 3],
    /// Number of used columns and rows of the target.
    pub(super) used: [u32; 2],
}

/// Limits of the layout.
#[derive(Clone, Copy, Debug)]
pub(super) struct TargetLimits {
    /// Number of columns and rows of the target, in texels.
    pub(super) target: [u32; 2],
    pub(super) discs: u32,
}

/// Layout of the attack of one cull. The memory is reused.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) cells: Vec<Cell>,
    pub(super) groups: Vec<Group>,
    pub(super) planes: Vec<Plane>,
    pub(super) passes: Vec<Pass>,
    pub(super) discs: Vec<PlacedDisc>,
}

impl Source {
    /// Maps of the attack that a part of a candidate is compared with.
    pub(super) fn of(part: Part, slices: u32) -> Self {
        match part {
            Part::Body => Self::Inner,
            Part::Outer => Self::Outer,
            Part::Evasion if slices > 1 => Self::Any,
            Part::Evasion => Self::Inner,
        }
    }
}

impl Cells {
    /// Computes the layout of the maps that are counted.
    pub(super) fn fill(
        &mut self,
        attack: &AttackDrawing,
        limits: TargetLimits,
        wanted: impl Fn(Source) -> bool,
    ) -> Result<(), GpuError> {
        self.cells.clear();
        self.groups.clear();
        self.planes.clear();
        self.passes.clear();
        self.discs.clear();
        for (layer, index) in attack.layers.iter().zip(0..) {
            if wanted(Source::Inner) {
                let layer = Layer {
                    index,
                    source: Source::Inner,
                    discs: layer.inner.clone(),
                };
                self.slices(attack, layer, limits);
            }
            if wanted(Source::Outer) {
                let layer = Layer {
                    index,
                    source: Source::Outer,
                    discs: layer.outer.clone(),
                };
                self.slices(attack, layer, limits);
            }
            if wanted(Source::Any) {
                let layer = Layer {
                    index,
                    source: Source::Any,
                    discs: layer.inner.clone(),
                };
                self.cut(attack, layer.cell(0), limits);
            }
        }
        self.place(limits);
        self.draw(attack);
        self.group(attack);
        within(
            "StencilSettings::max_discs",
            self.discs.len() as u64,
            limits.discs.into(),
        )
    }

    /// Adds a cell for each slice of a layer. Its discs are sorted by slice.
    fn slices(&mut self, attack: &AttackDrawing, layer: Layer, limits: TargetLimits) {
        let mut start = layer.discs.start;
        while start < layer.discs.end {
            let rest = &attack.discs[start as usize..layer.discs.end as usize];
            let slice = rest[0].slice;
            let end = start + rest.partition_point(|one| one.slice <= slice) as u32;
            let cell = Cell {
                discs: start..end,
                ..layer.cell(slice)
            };
            self.cut(attack, cell, limits);
            start = end;
        }
    }

    /// Adds a cell with the bounding rectangle of its discs. It is divided if it is larger than the target.
    fn cut(&mut self, attack: &AttackDrawing, cell: Cell, limits: TargetLimits) {
        let all = &attack.discs[cell.discs.start as usize..cell.discs.end as usize];
        let rects = all.iter().map(|one| around(one, attack));
        let whole = rects.fold(MapRect::default(), MapRect::union);
        let [columns, rows] = limits.target;
        let slant = Slant::around(all.iter().map(|one| one.disc), whole);
        let slant = slant.map(|slant| (slant, slant.bounds().union(whole)));
        if let Some((slant, around)) = slant
            && around.width <= columns
            && around.height <= rows
        {
            self.cells.push(Cell {
                rect: whole,
                free_rect: around,
                slant,
                ..cell
            });
            return;
        }
        for v in (0..whole.height).step_by(rows as usize) {
            for u in (0..whole.width).step_by(columns as usize) {
                let rect = MapRect {
                    u: whole.u + u as i32,
                    v: whole.v + v as i32,
                    width: columns.min(whole.width - u),
                    height: rows.min(whole.height - v),
                };
                let near = |one| !around(one, attack).intersection(rect).is_empty();
                if !all.iter().any(near) {
                    continue;
                }
                self.cells.push(Cell {
                    rect,
                    free_rect: rect,
                    slant: Slant::straight(rect),
                    ..cell.clone()
                });
            }
        }
    }

    /// Assigns a plane and a position to each cell.
    fn place(&mut self, limits: TargetLimits) {
        self.cells
            .sort_unstable_by_key(|cell| std::cmp::Reverse(cell.free_rect.height));
        let texels =
            |cell: &Cell| u64::from(cell.free_rect.width) * u64::from(cell.free_rect.height);
        let area: u64 = self.cells.iter().map(texels).sum();
        let widest = self.cells.iter().map(|cell| cell.free_rect.width).max();
        // The used part is nearly square and consists of whole tiles, so that it covers as few tiles of a device as possible.
        let columns = ((area as f64).sqrt() as u32)
            .max(widest.unwrap_or(0))
            .next_multiple_of(64)
            .min(limits.target[0]);
        let sides = [columns, limits.target[1]];
        let (mut shelves, mut plane) = (Shelves::default(), 0);
        for cell in &mut self.cells {
            let size = [cell.free_rect.width, cell.free_rect.height];
            let place = shelves.place(size, sides).unwrap_or_else(|| {
                plane += 1;
                shelves.first(size)
            });
            cell.place = Place {
                x: place.x + (cell.rect.u - cell.free_rect.u) as u32,
                y: place.y + (cell.rect.v - cell.free_rect.v) as u32,
            };
            cell.plane = plane;
        }
        let key = |cell: &Cell| {
            let pass = cell.plane / PLANES;
            (pass, cell.source, cell.plane, cell.layer, cell.slice)
        };
        self.cells.sort_unstable_by_key(key);
    }

    /// Lists the discs by plane.
    fn draw(&mut self, attack: &AttackDrawing) {
        let planes = self.cells.iter().map(|cell| cell.plane + 1).max();
        for plane in 0..planes.unwrap_or(0) {
            if plane % PLANES == 0 {
                self.passes.push(Pass {
                    planes: plane..plane,
                    groups: [const { 0..0 }; 3],
                    used: [0; 2],
                });
            }
            let start = self.discs.len() as u32;
            let index = self.passes.len() - 1;
            let pass = &mut self.passes[index];
            pass.planes.end = plane + 1;
            for cell in self.cells.iter().filter(|cell| cell.plane == plane) {
                let Cell { rect, place, .. } = *cell;
                pass.used[0] = pass.used[0].max(place.x + rect.width);
                pass.used[1] = pass.used[1].max(place.y + rect.height);
                let discs = &attack.discs[cell.discs.start as usize..cell.discs.end as usize];
                let near = |one: &&TimedDisc| !around(one, attack).intersection(rect).is_empty();
                let placed = discs.iter().filter(near).map(|one| {
                    let disc = one.disc.relative_to(rect.u, rect.v);
                    place.place(disc, rect)
                });
                self.discs.extend(placed);
            }
            self.planes.push(Plane {
                bit: 1 << (plane % PLANES),
                discs: start..self.discs.len() as u32,
            });
        }
    }

    /// Moves all cells and their discs down by a number of rows.
    pub(super) fn move_down(&mut self, rows: u32) {
        self.cells.iter_mut().for_each(|cell| cell.place.y += rows);
        self.discs.iter_mut().for_each(|disc| disc.move_down(rows));
    }

    /// Groups the cells over which a candidate is drawn together.
    fn group(&mut self, attack: &AttackDrawing) {
        let mut before = None;
        for (cell, index) in self.cells.iter().zip(0..) {
            let key = (cell.plane, cell.source, cell.layer);
            if before != Some(key) {
                before = Some(key);
                let layer = &attack.layers[cell.layer as usize];
                let groups = self.groups.len() as u32;
                self.groups.push(Group {
                    plane: cell.plane,
                    slab: layer.slab,
                    clock: layer.clock,
                    rect: MapRect::default(),
                    cells: index..index,
                });
                let pass = &mut self.passes[(cell.plane / PLANES) as usize];
                let range = &mut pass.groups[cell.source as usize];
                if range.start == range.end {
                    *range = groups..groups;
                }
                range.end = groups + 1;
            }
            if let Some(group) = self.groups.last_mut() {
                group.rect = group.rect.union(cell.rect);
                group.cells.end = index + 1;
            }
        }
    }
}

/// Part of the attack's rectangle that a disc can cover.
fn around(one: &TimedDisc, attack: &AttackDrawing) -> MapRect {
    let whole = MapRect {
        u: 0,
        v: 0,
        ..attack.rect
    };
    MapRect::around(&[one.disc]).intersection(whole)
}
