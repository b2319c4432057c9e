//! Tests whether a place lies inside a mesh, even if the mesh is open, doubled or has intersecting
//! parts.
//!
//! Source: Jacobson, Kavan & Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized
//! Winding Numbers" (2013): the sum of the triangles' solid angles, each computed as by van
//! Oosterom & Strackee (1983). Distant groups of triangles count as one dipole each, as in Barill
//! et al., "Fast Winding Numbers for Soups and Clouds" (2018), section 3, first order.
//!
//! Differs: a query looks at no more than [`MOST_WORK`] nodes and triangles, the near ones first; what is left counts as dipoles. So
//! triangles that all reach across one another take no longer than others. A mesh turned inside out has the same inside.

use std::f32::consts::PI;

use glam::Vec3;

use super::Mesh;
use super::tree::PointTree;

/// Distance of a group, in multiples of its radius, from which it counts as a dipole. The source
/// uses 2.
const FAR: f32 = 2.5;
/// Nodes and triangles that a query looks at. A body's mesh needs some hundred.
const MOST_WORK: usize = 1024;

/// Winding numbers of a mesh.
pub(super) struct Winding<'a> {
    mesh: &'a Mesh,
    tree: PointTree,
    /// Dipole of each node of the tree.
    dipoles: Vec<Dipole>,
}

#[derive(Clone, Copy)]
struct Dipole {
    centre: Vec3,
    /// Sum of the triangles' normals, weighted by area.
    area: Vec3,
    /// Maximum distance of a corner from the centre.
    radius: f32,
}

impl<'a> Winding<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        let count = mesh.triangles().len();
        let middle = |triangle| mesh.corners(triangle).iter().sum::<Vec3>() / 3.0;
        let middles: Vec<Vec3> = (0..count).map(middle).collect();
        let tree = PointTree::new(&middles, (0..count as u32).collect());
        let dipole = |node: &super::tree::Node| {
            let inside = &tree.order[node.start as usize..node.end as usize];
            dipole(mesh, &middles, inside)
        };
        let dipoles = tree.nodes.iter().map(dipole).collect();
        Self {
            mesh,
            tree,
            dipoles,
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
    /// 1 or -1 inside; for an open mesh they lie between.
    fn numbers<const N: usize>(&self, place: Vec3, places: [Vec3; N]) -> [f32; N] {
        let (mut near, mut far, mut work) = ([0.0; N], 0.0, 0);
        let mut open = Vec::with_capacity(64);
        open.push(0_u32);
        while let Some(id) = open.pop() {
            let (node, dipole) = (&self.tree.nodes[id as usize], &self.dipoles[id as usize]);
            let distance = dipole.centre.distance(place);
            work += 1;
            if distance > FAR * dipole.radius || work > MOST_WORK {
                far += dipole.turns(place, distance);
            } else if let Some([a, b]) = node.children {
                let from = |child: u32| self.dipoles[child as usize].centre.distance_squared(place);
                open.extend(if from(a) <= from(b) { [b, a] } else { [a, b] });
            } else {
                let inside = &self.tree.order[node.start as usize..node.end as usize];
                work += inside.len();
                for &triangle in inside {
                    let corners = self.mesh.corners(triangle as usize);
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
    fn turns(&self, place: Vec3, distance: f32) -> f32 {
        if distance > 0.0 {
            self.area.dot(self.centre - place) / (4.0 * PI * distance.powi(3))
        } else {
            0.0
        }
    }
}

fn dipole(mesh: &Mesh, middles: &[Vec3], triangles: &[u32]) -> Dipole {
    let (mut area, mut weighted, mut weights, mut plain) =
        (Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO);
    for &triangle in triangles {
        let [a, b, c] = mesh.corners(triangle as usize);
        let normal = 0.5 * (b - a).cross(c - a);
        let middle = middles[triangle as usize];
        area += normal;
        weighted += middle * normal.length();
        weights += normal.length();
        plain += middle;
    }
    let centre = if weights > 0.0 {
        weighted / weights
    } else {
        plain / triangles.len() as f32
    };
    let corners = triangles
        .iter()
        .flat_map(|&triangle| mesh.corners(triangle as usize));
    let radius = corners
        .map(|corner| corner.distance_squared(centre))
        .fold(0.0, f32::max)
        .sqrt();
    Dipole {
        centre,
        area,
        radius,
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
