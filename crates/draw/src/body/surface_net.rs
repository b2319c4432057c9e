//! Triangles of a surface that is given by distances.
//!
//! Source: Gibson, "Constrained Elastic Surface Nets", MICCAI 1998, without the relaxation: a vertex for each cell that the surface passes
//! through, at the mean of the crossings of its edges. Cells far from the surface are not sampled.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

/// Box that a surface is sampled in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    /// Side of a cell.
    pub(super) cell: f32,
}

/// A closed surface.
pub(super) struct Net {
    pub(super) places: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Cells on a side of a block that is skipped as a whole.
const BLOCK: i32 = 8;

/// Triangles around where `distance` is negative, counter-clockwise seen from outside.
pub(super) fn surface_net(grid: Grid, distance: &impl Fn(Vec3) -> f32) -> Net {
    let samples = Samples::new(grid, distance);
    let mut net = Net {
        places: Vec::new(),
        triangles: Vec::new(),
    };
    let mut numbers = HashMap::new();
    for z in 0..samples.size.z - 1 {
        for y in 0..samples.size.y - 1 {
            for x in 0..samples.size.x - 1 {
                let cell = IVec3::new(x, y, z);
                if let Some(place) = samples.vertex(cell) {
                    numbers.insert(cell, net.places.len() as u32);
                    net.places.push(place);
                }
            }
        }
    }
    for z in 1..samples.size.z - 1 {
        for y in 1..samples.size.y - 1 {
            for x in 1..samples.size.x - 1 {
                samples.faces(IVec3::new(x, y, z), &numbers, &mut net.triangles);
            }
        }
    }
    net
}

struct Samples {
    grid: Grid,
    size: IVec3,
    values: Vec<f32>,
}

impl Samples {
    fn new(grid: Grid, distance: &impl Fn(Vec3) -> f32) -> Self {
        let size = ((grid.high - grid.low) / grid.cell).ceil().as_ivec3() + 2;
        let mut samples = Self {
            grid,
            size,
            values: vec![0.0; (size.x * size.y * size.z) as usize],
        };
        // Distances of joined shapes are not exact: twice the block's radius is safe.
        let far = 2.0 * 0.5 * 3f32.sqrt() * BLOCK as f32 * grid.cell;
        let blocks = (size + BLOCK - 1) / BLOCK;
        for index in 0..blocks.x * blocks.y * blocks.z {
            let block = IVec3::new(
                index % blocks.x,
                index / blocks.x % blocks.y,
                index / blocks.x / blocks.y,
            ) * BLOCK;
            let middle = samples.place(block) + 0.5 * BLOCK as f32 * grid.cell;
            let about = distance(middle);
            for inside in 0..BLOCK * BLOCK * BLOCK {
                let at = block
                    + IVec3::new(
                        inside % BLOCK,
                        inside / BLOCK % BLOCK,
                        inside / BLOCK / BLOCK,
                    );
                if at.cmplt(size).all() {
                    let value = match about.abs() > far {
                        true => about,
                        false => distance(samples.place(at)),
                    };
                    let index = samples.index(at);
                    samples.values[index] = value;
                }
            }
        }
        samples
    }

    fn place(&self, at: IVec3) -> Vec3 {
        self.grid.low + at.as_vec3() * self.grid.cell
    }

    fn index(&self, at: IVec3) -> usize {
        (at.x + self.size.x * (at.y + self.size.y * at.z)) as usize
    }

    fn value(&self, at: IVec3) -> f32 {
        self.values[self.index(at)]
    }

    /// Place of the vertex of a cell, if the surface passes through it.
    fn vertex(&self, cell: IVec3) -> Option<Vec3> {
        let corner = |index: i32| cell + IVec3::new(index & 1, index >> 1 & 1, index >> 2);
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for from in 0..8 {
            for bit in [1, 2, 4] {
                let to = from | bit;
                if to == from {
                    continue;
                }
                let (a, b) = (self.value(corner(from)), self.value(corner(to)));
                if (a < 0.0) != (b < 0.0) {
                    let share = a / (a - b);
                    sum += self.place(corner(from)).lerp(self.place(corner(to)), share);
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// Two triangles for each edge from a sample up an axis that the surface crosses.
    fn faces(&self, at: IVec3, numbers: &HashMap<IVec3, u32>, out: &mut Vec<[u32; 3]>) {
        for (axis, u, v) in [
            (IVec3::X, IVec3::Y, IVec3::Z),
            (IVec3::Y, IVec3::Z, IVec3::X),
            (IVec3::Z, IVec3::X, IVec3::Y),
        ] {
            let is_inside = self.value(at) < 0.0;
            if is_inside == (self.value(at + axis) < 0.0) {
                continue;
            }
            let corners = [at - u - v, at - v, at, at - u];
            let found = corners.map(|cell| numbers.get(&cell).copied());
            let [Some(a), Some(b), Some(c), Some(d)] = found else {
                continue;
            };
            match is_inside {
                true => out.extend([[a, b, c], [a, c, d]]),
                false => out.extend([[a, c, b], [a, d, c]]),
            }
        }
    }
}
