//! Triangles of a surface that is given by distances, and the weights of its joints.
//!
//! Source of the triangles: Gibson, "Constrained Elastic Surface Nets", MICCAI 1998, without the relaxation: a vertex for each cell that the surface passes
//! through, at the mean of the crossings of its edges. Cells far from the surface are not sampled.
//!
//! Source of the weights: the diffusion of Baran and Popovic, "Automatic Rigging and Animation of 3D Characters", SIGGRAPH 2007, section 4, in
//! explicit steps on the surface's edges. Each vertex starts with the joint of its nearest shape.

use std::collections::{BTreeMap, HashMap};

use glam::{IVec3, Vec3};
use sabaki::math::smooth_step;

use super::anatomy::Anatomy;
use super::shapes::{Carrier, Shapes};

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

/// Distance over which weights spread, as a share of the height; then the distance at the hips and shoulders, which rotate
/// furthest.
const SPREAD: f32 = 0.022;
const WIDE: f32 = 0.042;
/// Distance from the joint of a hip or shoulder at which weights spread as far as elsewhere, as a share of the height.
const REACH: f32 = 0.12;

impl Net {
    /// Four bones and their weights for each vertex. `cell` is the side of the grid's cells, in metres.
    pub(super) fn weights(
        &self,
        anatomy: &Anatomy,
        human: &Shapes,
        cell: f32,
    ) -> Vec<([u16; 4], [u16; 4])> {
        let mut neighbours = vec![Vec::new(); self.places.len()];
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                neighbours[from as usize].push(to as usize);
                neighbours[to as usize].push(from as usize);
            }
        }
        let start = |place| match human.nearest(place).carrier {
            Carrier::Joint(joint) => joint,
            Carrier::Trunk => anatomy.of_trunk(place),
        };
        let mut all: Vec<BTreeMap<u16, f32>> = self
            .places
            .iter()
            .map(|&place| BTreeMap::from([(start(place).0, 1.0)]))
            .collect();
        // Each step spreads by about 0.8 cells.
        let steps_of = |spread: f32| (spread * anatomy.height / (0.8 * cell)).powi(2).ceil();
        let joints = anatomy.legs.iter().chain(&anatomy.arms);
        let joints: Vec<Vec3> = joints.map(|limb| anatomy.at(limb.hip)).collect();
        let steps_at = |place: &Vec3| {
            let apart = joints.iter().map(|joint| joint.distance(*place));
            let apart = apart.fold(f32::MAX, f32::min) / (REACH * anatomy.height);
            let near = smooth_step(2.0 * (1.0 - apart));
            steps_of(SPREAD + (WIDE - SPREAD) * near) as usize
        };
        let steps: Vec<usize> = self.places.iter().map(steps_at).collect();
        for step in 0..steps.iter().copied().max().unwrap_or(0) {
            let next = neighbours.iter().enumerate().map(|(vertex, around)| {
                if step >= steps[vertex] {
                    return all[vertex].clone();
                }
                let share = 0.75 / around.len().max(1) as f32;
                let mut mixed: BTreeMap<u16, f32> = BTreeMap::new();
                for (&joint, &weight) in &all[vertex] {
                    *mixed.entry(joint).or_default() += 0.25 * weight;
                }
                for &other in around {
                    for (&joint, &weight) in &all[other] {
                        *mixed.entry(joint).or_default() += share * weight;
                    }
                }
                mixed.retain(|_, weight| *weight > 1e-3);
                mixed
            });
            all = next.collect();
        }
        all.iter().map(four).collect()
    }
}

/// The four largest weights with a sum of 65,535.
fn four(weights: &BTreeMap<u16, f32>) -> ([u16; 4], [u16; 4]) {
    let mut sorted: Vec<(u16, f32)> = weights
        .iter()
        .map(|(&joint, &weight)| (joint, weight))
        .collect();
    sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
    sorted.truncate(4);
    let sum: f32 = sorted.iter().map(|(_, weight)| weight).sum();
    let (mut joints, mut whole) = ([0; 4], [0u16; 4]);
    for (slot, (joint, weight)) in sorted.into_iter().enumerate() {
        joints[slot] = joint;
        whole[slot] = (weight / sum * 65_535.0) as u16;
    }
    let rest = u32::from(u16::MAX) - whole.iter().map(|&part| u32::from(part)).sum::<u32>();
    whole[0] += rest as u16;
    (joints, whole)
}
