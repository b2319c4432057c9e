//! Tests whether a place lies inside a mesh, even if the mesh is open, doubled or has intersecting
//! parts.
//!
//! Source: Jacobson, Kavan & Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized
//! Winding Numbers" (2013): the sum of the triangles' solid angles, each computed as by van
//! Oosterom & Strackee (1983). Distant groups of triangles count as one dipole each, as in Barill
//! et al., "Fast Winding Numbers for Soups and Clouds" (2018), section 3, first order.
//!
//! Differs in three points.
//! - Long triangles are cut into pieces before the tree is built ([`short_pieces`]). A group with a long triangle has a large radius, so it
//!   counts as distant nowhere near it: the tube of a capsule, whose triangles are as long as the bone, would be summed triangle by
//!   triangle from half of the body.
//! - A query visits a limited number of nodes and pieces ([`most_work`]), the nearest first. The rest counts as dipoles, each bounded by what its
//!   group can cover at its own radius. This limit is for triangles that all cross one another, where no group is ever distant.
//! - A mesh that is turned inside out has the same inside.
//!
//! Long triangles are cut as in Rivara, "Algorithms for Refining Triangular Grids Suitable for Adaptive and Multigrid Techniques" (1984):
//! a triangle is halved at the middle of its longest edge, and each half again, until no edge is longer than wanted. Differs: neighbours
//! are not cut with it, since a sum over solid angles needs no shared corners.
//!
//! The tree is a k-d tree of bounding boxes, after Bentley, "Multidimensional Binary Search Trees Used for Associative Searching" (1975).
//! Each node is divided at the median of its longest axis. Of equally near points, the first one in the tree's order is found.

use std::f32::consts::PI;

use glam::Vec3;

use super::{Mesh, bounds};

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
        let pieces = short_pieces(mesh);
        let middles: Vec<Vec3> = pieces
            .iter()
            .map(|corners| corners.iter().sum::<Vec3>() / 3.0)
            .collect();
        let tree = PointTree::new(&middles, (0..pieces.len() as u32).collect());
        let dipole = |node: &Node| {
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

/// Maximum number of pieces beyond the mesh's triangles. The allowed length is doubled until they suffice.
const MOST_ADDED: usize = 150_000;
/// Minimum length of an edge that is halved, as a share of the mesh's size.
const SHORTEST: f32 = 1.0 / 256.0;

/// The corners of all pieces, with the orientation of their triangles.
fn short_pieces(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    let (low, high) = mesh.bounds();
    let triangles = || (0..mesh.triangles().len()).map(|triangle| mesh.corners(triangle));
    let most = mesh.triangles().len() + MOST_ADDED;
    let mut length = low.distance(high) * SHORTEST;
    loop {
        let mut pieces = Vec::with_capacity(mesh.triangles().len());
        let mut take = |piece| {
            pieces.push(piece);
            pieces.len() < most
        };
        if triangles().all(|corners| cut(corners, length, &mut take)) {
            return pieces;
        }
        length *= 2.0;
    }
}

/// Gives the pieces of a triangle to `take`, until that returns false. Returns whether it took all.
pub(super) fn cut(
    corners: [Vec3; 3],
    length: f32,
    take: &mut impl FnMut([Vec3; 3]) -> bool,
) -> bool {
    let mut open = vec![corners];
    while let Some([a, b, c]) = open.pop() {
        // Turned so that the longest edge is from a to b.
        let edges = [a.distance(b), b.distance(c), c.distance(a)];
        let [a, b, c] = if edges[0] >= edges[1] && edges[0] >= edges[2] {
            [a, b, c]
        } else if edges[1] >= edges[2] {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let middle = 0.5 * (a + b);
        // Far from the origin an edge may be too short to have a middle.
        if a.distance(b) <= length || middle == a || middle == b {
            if !take([a, b, c]) {
                return false;
            }
        } else {
            open.extend([[middle, b, c], [a, middle, c]]);
        }
    }
    true
}

/// Maximum number of points in a leaf.
const LEAF: usize = 4;

/// A node of the tree: a range of [`PointTree::order`].
#[derive(Clone, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Start and end of the range.
    start: u32,
    end: u32,
    /// Indices of the two children, or `None` for a leaf.
    children: Option<[u32; 2]>,
}

/// A tree of points, which it does not store.
#[derive(Clone, Debug, Default)]
pub(super) struct PointTree {
    /// Nodes, the root first. Empty if there are no points.
    nodes: Vec<Node>,
    /// Indices of the points. Those of a node are consecutive.
    pub order: Vec<u32>,
}

impl PointTree {
    /// Builds a tree over the points with the indices `order`.
    pub(super) fn new(points: &[Vec3], order: Vec<u32>) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order,
        };
        let end = tree.order.len();
        if end > 0 {
            tree.add(points, 0, end);
        }
        tree
    }

    fn add(&mut self, points: &[Vec3], start: usize, end: usize) -> u32 {
        let inside = &mut self.order[start..end];
        let (low, high) = bounds(inside.iter().map(|&index| points[index as usize]));
        let id = self.nodes.len();
        self.nodes.push(Node {
            low,
            high,
            start: start as u32,
            end: end as u32,
            children: None,
        });
        if end - start > LEAF {
            let axis = (high - low).max_position();
            let half = (end - start) / 2;
            inside.select_nth_unstable_by(half, |&a, &b| {
                let (x, y) = (points[a as usize][axis], points[b as usize][axis]);
                x.total_cmp(&y).then(a.cmp(&b))
            });
            let first = self.add(points, start, start + half);
            let second = self.add(points, start + half, end);
            self.nodes[id].children = Some([first, second]);
        }
        id as u32
    }

    /// Index of the point that is nearest to `place`, and its squared distance.
    pub(super) fn nearest(&self, points: &[Vec3], place: Vec3) -> Option<(u32, f32)> {
        let mut best: Option<(u32, f32)> = None;
        // The depth is the logarithm of the number of points, and each level leaves one node on the
        // stack.
        let mut open = Vec::with_capacity(64);
        open.extend(
            self.nodes
                .first()
                .map(|root| (0, root.distance_squared(place))),
        );
        while let Some((id, least)) = open.pop() {
            if best.is_some_and(|(_, found)| least > found) {
                continue;
            }
            let node: &Node = &self.nodes[id as usize];
            let Some(children) = node.children else {
                for &index in &self.order[node.start as usize..node.end as usize] {
                    let distance = points[index as usize].distance_squared(place);
                    let is_better = |(at, found): (u32, f32)| (distance, index) < (found, at);
                    if best.is_none_or(is_better) {
                        best = Some((index, distance));
                    }
                }
                continue;
            };
            let mut children =
                children.map(|child| (child, self.nodes[child as usize].distance_squared(place)));
            if children[0].1 <= children[1].1 {
                children.swap(0, 1);
            }
            open.extend(children);
        }
        best
    }
}

impl Node {
    fn distance_squared(&self, place: Vec3) -> f32 {
        place.clamp(self.low, self.high).distance_squared(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area([a, b, c]: [Vec3; 3]) -> Vec3 {
        0.5 * (b - a).cross(c - a)
    }

    #[test]
    fn pieces_are_short_and_make_up_their_triangle() {
        let triangle = [
            Vec3::ZERO,
            Vec3::new(0.4, 0.1, 0.0),
            Vec3::new(0.39, 0.1, 0.004),
        ];
        let mut found = Vec::new();
        assert!(cut(triangle, 0.02, &mut |piece| {
            found.push(piece);
            true
        }));
        assert!(found.len() > 20 && found.len() <= 256, "{}", found.len());
        for &[a, b, c] in &found {
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            assert!(longest <= 0.02);
            assert!(area([a, b, c]).dot(area(triangle)) > 0.0);
        }
        let sum: Vec3 = found.iter().map(|&piece| area(piece)).sum();
        assert!(sum.distance(area(triangle)) < 1e-6);
    }

    #[test]
    fn a_mesh_of_long_triangles_has_a_bounded_number_of_pieces() {
        let places: Vec<Vec3> = (0..3000)
            .map(|index| Vec3::new((index % 3) as f32, (index % 7) as f32, (index % 11) as f32))
            .collect();
        let triangles: Vec<[u32; 3]> = (0..1000).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = Mesh::new(places, triangles, Vec::new()).unwrap();
        let found = short_pieces(&mesh);
        assert!(found.len() > 1000 && found.len() <= 1000 + MOST_ADDED);
    }
}
