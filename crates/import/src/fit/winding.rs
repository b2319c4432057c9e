//! Tests whether a place lies inside a mesh, even if the mesh is open, doubled or has intersecting
//! parts.
//!
//! Source: Jacobson, Kavan & Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized
//! Winding Numbers" (2013): the sum of the triangles' solid angles, each computed as by van
//! Oosterom & Strackee (1983). Distant groups of triangles count as one dipole each, as in Barill
//! et al., "Fast Winding Numbers for Soups and Clouds" (2018), section 3, first order.
//!
//! Differs in three points.
//! - Long triangles are cut into pieces before the tree is built ([`pieces`]). A group with a long triangle has a large radius, so it
//!   counts as distant nowhere near it: the tube of a capsule, whose triangles are as long as the bone, would be summed triangle by
//!   triangle from half of the body.
//! - A query visits a limited number of nodes and pieces ([`most_work`]), the nearest first. The rest counts as dipoles, each bounded by what its
//!   group can cover at its own radius. This limit is for triangles that all cross one another, where no group is ever distant.
//! - A mesh that is turned inside out has the same inside.

use std::f32::consts::PI;

use glam::Vec3;

use super::Mesh;
use super::pieces::pieces;
use super::tree::PointTree;

/// Distance of a group, in multiples of its radius, from which it counts as a dipole. The source
/// uses 2.
const FAR: f32 = 2.5;
/// Nodes and pieces that a query visits. A closed skin needs some hundred, ten shells that reach into one another ten times as many.
const WORK: [usize; 2] = [1024, 8192];
/// Nodes and pieces that all queries visit together, as far as the least of [`WORK`] allows.
const TOTAL_WORK: usize = 1_000_000_000;

/// Number of nodes and pieces that a query visits.
fn most_work(queries: usize) -> usize {
    (TOTAL_WORK / queries.max(1)).clamp(WORK[0], WORK[1])
}

/// The winding numbers of a mesh.
pub(super) struct Winding {
    /// The corners of the mesh's triangles, or of the pieces of long ones.
    pieces: Vec<[Vec3; 3]>,
    /// Tree of the middles of the pieces.
    tree: PointTree,
    /// One dipole for each node of the tree.
    dipoles: Vec<Dipole>,
    /// Nodes and pieces that a query visits.
    most_work: usize,
}

/// A group of pieces as seen from afar.
#[derive(Clone, Copy)]
struct Dipole {
    centre: Vec3,
    /// Sum of the pieces' normals, weighted by area.
    area: Vec3,
    /// Maximum distance of a corner from the centre.
    radius: f32,
}

impl Winding {
    /// Builds the tree. `queries` is the approximate number of queries, which determines the work of each.
    pub(super) fn new(mesh: &Mesh, queries: usize) -> Self {
        let pieces = pieces(mesh);
        let middles: Vec<Vec3> = pieces
            .iter()
            .map(|corners| corners.iter().sum::<Vec3>() / 3.0)
            .collect();
        let tree = PointTree::new(&middles, (0..pieces.len() as u32).collect());
        let dipole = |node: &super::tree::Node| {
            let inside = &tree.order[node.start as usize..node.end as usize];
            Dipole::of(&pieces, inside)
        };
        let dipoles = tree.nodes.iter().map(dipole).collect();
        Self {
            pieces,
            tree,
            dipoles,
            most_work: most_work(queries),
        }
    }

    /// Whether the winding number of a place is more than one half.
    pub(super) fn is_inside(&self, place: Vec3) -> bool {
        let [number] = self.numbers(place, [place]);
        number.abs() > 0.5
    }

    /// Whether the places one step before and one step after `place` are inside.
    pub(super) fn are_inside(&self, place: Vec3, step: Vec3) -> [bool; 2] {
        let numbers = self.numbers(place, [place - step, place + step]);
        numbers.map(|number| number.abs() > 0.5)
    }

    /// Winding numbers of several places close to `place`. For a closed mesh they are 0 outside and
    /// 1 or -1 inside, and more where closed parts overlap; for an open mesh they lie between.
    fn numbers<const N: usize>(&self, place: Vec3, places: [Vec3; N]) -> [f32; N] {
        let (mut near, mut far, mut work) = ([0.0; N], 0.0, 0);
        let mut open = Vec::with_capacity(64);
        open.push(0_u32);
        while let Some(id) = open.pop() {
            let (node, dipole) = (&self.tree.nodes[id as usize], &self.dipoles[id as usize]);
            let distance = dipole.centre.distance(place);
            work += 1;
            if distance > FAR * dipole.radius || work > self.most_work {
                far += dipole.turns(place, distance);
            } else if let Some([a, b]) = node.children {
                let from = |child: u32| self.dipoles[child as usize].centre.distance_squared(place);
                open.extend(if from(a) <= from(b) { [b, a] } else { [a, b] });
            } else {
                let inside = &self.tree.order[node.start as usize..node.end as usize];
                work += inside.len();
                for &piece in inside {
                    let corners = self.pieces[piece as usize];
                    for (sum, &place) in near.iter_mut().zip(&places) {
                        *sum += turns(corners.map(|corner| corner - place));
                    }
                }
            }
        }
        near.map(|near| near + far)
    }
}

impl Dipole {
    fn of(pieces: &[[Vec3; 3]], indices: &[u32]) -> Self {
        let (mut area, mut weighted, mut weights, mut plain) =
            (Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO);
        for &piece in indices {
            let [a, b, c] = pieces[piece as usize];
            let normal = 0.5 * (b - a).cross(c - a);
            let middle = (a + b + c) / 3.0;
            area += normal;
            weighted += middle * normal.length();
            weights += normal.length();
            plain += middle;
        }
        let centre = if weights > 0.0 {
            weighted / weights
        } else {
            plain / indices.len() as f32
        };
        let corners = indices.iter().flat_map(|&piece| pieces[piece as usize]);
        let radius = corners
            .map(|corner| corner.distance_squared(centre))
            .fold(0.0, f32::max)
            .sqrt();
        Self {
            centre,
            area,
            radius,
        }
    }

    /// The solid angle of the group, as a share of the whole sphere. Within the radius the formula has a pole, so the
    /// distance counts as the radius there.
    fn turns(&self, place: Vec3, distance: f32) -> f32 {
        let distance = distance.max(self.radius);
        if distance > 0.0 {
            self.area.dot(self.centre - place) / (4.0 * PI * distance.powi(3))
        } else {
            0.0
        }
    }
}

/// Solid angle of a triangle seen from the origin, as a share of the whole sphere.
fn turns([a, b, c]: [Vec3; 3]) -> f32 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c));
    let base = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    if volume == 0.0 {
        // The origin lies in the triangle's plane, or the triangle is degenerate.
        return 0.0;
    }
    2.0 * volume.atan2(base) / (4.0 * PI)
}
