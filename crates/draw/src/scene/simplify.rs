//! Coarser triangles for a mesh, by collapsing edges.
//!
//! Source: Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997. It differs in that an edge collapses
//! to one of its ends, so that all resolutions share the vertices; that the quadrics of all planes are weighted by area; that a collapse that
//! turns a triangle over is not made; and that seams of a texture stay seams: an edge collapses only if each vertex at its first end has a
//! vertex at the other end on its own side of the seams.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::hash::Hash;

use glam::{DMat4, DVec3, DVec4, Vec3};

use super::MeshVertex;

/// At most `count` triangles of the same surface, if it can be simplified that far.
pub(crate) fn simplified(
    vertices: &[MeshVertex],
    triangles: &[[u32; 3]],
    count: usize,
) -> Vec<[u32; 3]> {
    let mut mesh = Collapsing::new(vertices, triangles);
    while mesh.left > count {
        let Some(Reverse(candidate)) = mesh.candidates.pop() else {
            break;
        };
        mesh.try_collapse(&candidate);
    }
    let kept = mesh.triangles.iter().zip(mesh.drawn);
    kept.filter_map(|(corners, drawn)| corners.map(|_| drawn))
        .collect()
}

/// For each vertex the index of the first one with the same key.
fn firsts<K: Eq + Hash>(vertices: &[MeshVertex], key: impl Fn(&MeshVertex) -> K) -> Vec<u32> {
    let mut firsts = HashMap::new();
    let indices = (0..).zip(vertices);
    indices
        .map(|(index, vertex)| *firsts.entry(key(vertex)).or_insert(index))
        .collect()
}

/// An edge that may collapse.
#[derive(Clone, Copy, PartialEq)]
struct Candidate {
    cost: f64,
    from: u32,
    to: u32,
    /// Versions of both ends when the cost was computed.
    versions: [u32; 2],
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let ends = (self.from, self.to).cmp(&(other.from, other.to));
        self.cost.total_cmp(&other.cost).then(ends)
    }
}

struct Collapsing {
    positions: Vec<DVec3>,
    /// Corners of each triangle, by the first vertex at each place. `None` for a triangle that has collapsed.
    triangles: Vec<Option<[u32; 3]>>,
    /// Corners of each triangle, by the first vertex at each place with the same colour and place in the texture.
    drawn: Vec<[u32; 3]>,
    /// Triangles of each vertex. Some may have collapsed.
    around: Vec<Vec<u32>>,
    quadrics: Vec<DMat4>,
    versions: Vec<u32>,
    /// For each vertex a number of its colour, and whether it has a neighbour of another colour.
    colours: Vec<(u32, bool)>,
    candidates: BinaryHeap<Reverse<Candidate>>,
    left: usize,
}

impl Collapsing {
    fn new(vertices: &[MeshVertex], triangles: &[[u32; 3]]) -> Self {
        let at_place = firsts(vertices, |vertex| vertex.position.map(f32::to_bits));
        let alike = firsts(vertices, |vertex| {
            let uv = match vertex.colour[3] {
                0 => [0; 2],
                _ => vertex.uv.map(f32::to_bits),
            };
            (vertex.position.map(f32::to_bits), vertex.colour, uv)
        });
        let of = |firsts: &[u32], corners: [u32; 3]| corners.map(|at| firsts[at as usize]);
        let is_flat = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
        let whole = triangles.iter().copied();
        let whole = whole.filter(|&corners| !is_flat(of(&at_place, corners)));
        let (merged, drawn): (Vec<_>, Vec<_>) = whole
            .map(|corners| (Some(of(&at_place, corners)), of(&alike, corners)))
            .unzip();
        let place = |vertex: &MeshVertex| Vec3::from(vertex.position).as_dvec3();
        let mut mesh = Self {
            positions: vertices.iter().map(place).collect(),
            triangles: merged,
            drawn,
            around: vec![Vec::new(); vertices.len()],
            quadrics: vec![DMat4::ZERO; vertices.len()],
            versions: vec![0; vertices.len()],
            colours: vec![(0, false); vertices.len()],
            candidates: BinaryHeap::new(),
            left: 0,
        };
        mesh.left = mesh.triangles.len();
        mesh.mark_borders(vertices);
        for index in 0..mesh.triangles.len() {
            let Some(corners) = mesh.triangles[index] else {
                continue;
            };
            let [a, b, c] = corners.map(|at| mesh.positions[at as usize]);
            let area = (b - a).cross(c - a);
            let normal = area.normalize_or_zero();
            let plane: DVec4 = normal.extend(-normal.dot(a));
            let quadric = DMat4::from_cols(
                plane * plane.x,
                plane * plane.y,
                plane * plane.z,
                plane * plane.w,
            );
            for corner in corners {
                mesh.quadrics[corner as usize] += quadric * area.length();
                mesh.around[corner as usize].push(index as u32);
            }
        }
        for index in 0..mesh.triangles.len() {
            mesh.add_edges(index);
        }
        mesh
    }

    /// Adds the edges of a triangle as candidates.
    fn add_edges(&mut self, triangle: usize) {
        let Some([a, b, c]) = self.triangles[triangle] else {
            return;
        };
        for (from, to) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
            let both = self.quadrics[from as usize] + self.quadrics[to as usize];
            let place = self.positions[to as usize].extend(1.0);
            // Flat surfaces cost nothing; among them short edges go first.
            let length = self.positions[from as usize].distance(self.positions[to as usize]);
            let cost =
                place.dot(both * place).max(0.0) + 1e-9 * length + self.border_cost(from, to);
            self.candidates.push(Reverse(Candidate {
                cost,
                from,
                to,
                versions: [from, to].map(|end| self.versions[end as usize]),
            }));
        }
    }

    fn mark_borders(&mut self, vertices: &[MeshVertex]) {
        let mut numbers = HashMap::new();
        for (vertex, colour) in vertices.iter().zip(&mut self.colours) {
            let next = numbers.len() as u32;
            colour.0 = *numbers.entry(vertex.colour).or_insert(next);
        }
        for corners in self.triangles.iter().flatten() {
            let [a, b, c] = corners.map(|corner| self.colours[corner as usize].0);
            for corner in *corners {
                self.colours[corner as usize].1 |= a != b || b != c;
            }
        }
    }

    /// Cost of moving a border between colours: the area that would change its colour, times a height.
    fn border_cost(&self, from: u32, to: u32) -> f64 {
        let [a, b] = [from, to].map(|end| self.colours[end as usize]);
        let length = self.positions[from as usize].distance(self.positions[to as usize]);
        match a.1 && (a.0 != b.0 || !b.1) {
            true => 0.05 * length.powi(3),
            false => 0.0,
        }
    }

    fn try_collapse(&mut self, candidate: &Candidate) {
        let Candidate { from, to, .. } = *candidate;
        let current = [from, to].map(|end| self.versions[end as usize]);
        if current != candidate.versions || self.turns_over(from, to) {
            return;
        }
        let Some(partners) = self.partners(from, to) else {
            return;
        };
        let moved = std::mem::take(&mut self.around[from as usize]);
        for index in moved {
            let Some(corners) = &mut self.triangles[index as usize] else {
                continue;
            };
            if corners.contains(&to) {
                self.triangles[index as usize] = None;
                self.left -= 1;
                continue;
            }
            *corners = corners.map(|corner| if corner == from { to } else { corner });
            for corner in &mut self.drawn[index as usize] {
                let partner = partners.iter().find(|(own, _)| own == corner);
                *corner = partner.map_or(*corner, |(_, other)| *other);
            }
            self.around[to as usize].push(index);
        }
        let quadric = self.quadrics[from as usize];
        self.quadrics[to as usize] += quadric;
        self.versions[from as usize] += 1;
        self.versions[to as usize] += 1;
        let triangles = &self.triangles;
        self.around[to as usize].retain(|&index| triangles[index as usize].is_some());
        for index in self.around[to as usize].clone() {
            self.add_edges(index as usize);
        }
    }

    /// For each drawn vertex at `from` the one at `to` that takes its place: the one that shares a triangle with it. `None` if there is none,
    /// or more than one.
    fn partners(&self, from: u32, to: u32) -> Option<Vec<(u32, u32)>> {
        let mut around = self.around[from as usize].iter().filter_map(|&index| {
            let corners = self.triangles[index as usize]?;
            let drawn = self.drawn[index as usize];
            let at = |place: u32| (0..3).find(|&corner| corners[corner] == place);
            Some((drawn[at(from)?], at(to).map(|corner| drawn[corner])))
        });
        let mut partners: Vec<(u32, u32)> = Vec::new();
        for (own, other) in around.clone() {
            match (other, partners.iter().find(|pair| pair.0 == own)) {
                (Some(other), Some(pair)) if pair.1 != other => return None,
                (Some(other), None) => partners.push((own, other)),
                _ => {}
            }
        }
        let has_partner = |(own, _)| partners.iter().any(|pair| pair.0 == own);
        around.all(has_partner).then_some(partners)
    }

    /// Whether a triangle would face another way after a collapse.
    fn turns_over(&self, from: u32, to: u32) -> bool {
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        self.around[from as usize].iter().any(|&index| {
            let Some(corners) = self.triangles[index as usize] else {
                return false;
            };
            if corners.contains(&to) {
                return false;
            }
            let place = |corner: u32| self.positions[corner as usize];
            let moved = |corner: u32| place(if corner == from { to } else { corner });
            let (before, after) = (area(corners.map(place)), area(corners.map(moved)));
            before.dot(after) < 0.2 * before.length() * after.length()
        })
    }
}
