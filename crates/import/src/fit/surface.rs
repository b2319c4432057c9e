//! A mesh as points spread over its triangles, each with its joint and its outward normal.
//!
//! Two ways. A mesh of few triangles has its vertices, and on each triangle the points of a grid. A mesh of many or of long thin
//! triangles would have far more of them than its surface needs. Its triangles are cut into short pieces, and of the vertices and the
//! middles of the pieces so many are left out that no two close ones of a joint look the same way: dart throwing on given points
//! (Cook, "Stochastic Sampling in Computer Graphics", 1986), taken in the mesh's own order, so that the same mesh gives the same points.

use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;
use sabaki::anim::JointId;
use sabaki::math::in_parallel;

use super::Mesh;
use super::winding::{PointTree, Winding, cut};

/// Distance from the surface at which inside and outside are tested, in metres.
const BESIDE: f32 = 5e-4;

/// Points on a mesh.
pub(super) struct Surface {
    pub places: Vec<Vec3>,
    pub joints: Vec<JointId>,
    /// Outward unit normals. A normal is zero where the mesh does not separate inside from outside,
    /// on a sheet or an inner wall.
    pub normals: Vec<Vec3>,
    /// Whether both sides are inside, for example where an arm's tube extends into the trunk.
    pub is_inner: Vec<bool>,
    /// Tree of all points.
    pub tree: PointTree,
    /// Tree of the points with a normal.
    pub border: PointTree,
    pub winding: Winding,
    /// Maximum distance of any place on the mesh from the nearest point, in metres.
    pub spacing: f32,
}

impl Surface {
    /// Creates the points, at most `spacing` apart if the limits allow it. `joints` are those of the vertices.
    pub(super) fn new(mesh: &Mesh, joints: &[JointId], spacing: f32) -> Self {
        let (points, spacing) = points(mesh, joints, spacing);
        let places: Vec<Vec3> = points.iter().map(|point| point.place).collect();
        let winding = Winding::new(mesh, places.len());
        // This takes most of the time of a fit.
        let sides = in_parallel(0, points.len(), |index| side(&winding, &points[index]));
        let (normals, is_inner): (Vec<Vec3>, Vec<bool>) = sides.into_iter().unzip();
        let all: Vec<u32> = (0..places.len() as u32).collect();
        let on_border = |&point: &u32| normals[point as usize] != Vec3::ZERO;
        let border = PointTree::new(&places, all.iter().copied().filter(on_border).collect());
        let tree = PointTree::new(&places, all);
        Self {
            joints: points.iter().map(|point| point.joint).collect(),
            normals,
            is_inner,
            tree,
            border,
            winding,
            spacing,
            places,
        }
    }

    /// Distance of a place outside the mesh from the nearest point, 0 inside.
    pub(super) fn outside(&self, place: Vec3) -> f32 {
        if self.winding.is_inside(place) {
            return 0.0;
        }
        self.tree
            .nearest(&self.places, place)
            .map_or(0.0, |(_, squared)| squared.sqrt())
    }
}

/// Outward normal, or zero if both sides are inside or both outside; and whether both are inside.
fn side(winding: &Winding, &Point { place, normal, .. }: &Point) -> (Vec3, bool) {
    if normal == Vec3::ZERO {
        return (normal, false);
    }
    match winding.are_inside(place, BESIDE * normal) {
        [true, false] => (normal, false),
        [false, true] => (-normal, false),
        [behind, _] => (Vec3::ZERO, behind),
    }
}

/// Points of the first way. A mesh that needs more is sampled the second way.
const MOST_POINTS: usize = 60_000;
/// Maximum number of pieces that the second way makes. Their length is doubled until they are few enough.
const MOST_PIECES: usize = 1_000_000;
/// Maximum number of points of the second way. The distance between them is doubled until they are few enough.
const MOST_CHOSEN: usize = 100_000;
/// Two normals point the same way if the cosine of their angle is above this.
const ALIKE: f32 = 0.5;

/// A point on a mesh whose sides are not known yet.
#[derive(Clone, Copy)]
struct Point {
    place: Vec3,
    joint: JointId,
    /// Unit normal. For a point on a triangle, the triangle's normal by its orientation; for a vertex, the mean of its
    /// triangles' normals by area.
    normal: Vec3,
}

/// The points of a mesh whose vertices move with `joints`, no further apart than `spacing` where the limits allow; and the largest distance
/// of a place on the mesh from the nearest point, in metres.
fn points(mesh: &Mesh, joints: &[JointId], spacing: f32) -> (Vec<Point>, f32) {
    let vertex = |(vertex, normal): (usize, Vec3)| Point {
        place: mesh.positions()[vertex],
        joint: joints[vertex],
        normal,
    };
    let vertices: Vec<Point> = vertex_normals(mesh).map(vertex).collect();
    if vertices.len().max(grid_points(mesh, spacing)) <= MOST_POINTS {
        return (on_grids(mesh, joints, vertices, spacing), spacing);
    }
    let mut distance = spacing;
    loop {
        if let Some(points) = thinned(mesh, joints, &vertices, distance) {
            return points;
        }
        distance *= 2.0;
    }
}

/// The vertices, and on each triangle the points of a grid. A point goes to the joint of the nearest corner, counted along the
/// edges.
fn on_grids(mesh: &Mesh, joints: &[JointId], vertices: Vec<Point>, spacing: f32) -> Vec<Point> {
    let mut points = vertices;
    for (triangle, of_triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(triangle);
        let normal = normal_of(corners).normalize_or_zero();
        for_each_inner(corners, spacing, |weights, place| {
            let nearest = (0..3)
                .rev()
                .max_by_key(|&corner| weights[corner])
                .unwrap_or(0);
            points.push(Point {
                place,
                joint: joints[of_triangle[nearest] as usize],
                normal,
            });
        });
    }
    points
}

/// The vertices and the middles of short pieces that are no closer than `spacing` to one of the same joint and side; `None` if they are too many.
fn thinned(
    mesh: &Mesh,
    joints: &[JointId],
    vertices: &[Point],
    spacing: f32,
) -> Option<(Vec<Point>, f32)> {
    let mut length = spacing;
    while piece_count(mesh, length) > MOST_PIECES {
        length *= 2.0;
    }
    let mut chosen = Chosen {
        points: Vec::new(),
        distance: spacing,
        cells: FxHashMap::default(),
    };
    if !vertices.iter().all(|&vertex| chosen.offer(vertex)) {
        return None;
    }
    for (triangle, of_triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(triangle);
        if parts(corners, length) == 1 {
            // Its corners are near enough.
            continue;
        }
        let normal = normal_of(corners).normalize_or_zero();
        let mut offer = |piece: [Vec3; 3]| {
            let place = piece.iter().sum::<Vec3>() / 3.0;
            let far = |&corner: &usize| corners[corner].distance_squared(place);
            let nearest = (0..3).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
            chosen.offer(Point {
                place,
                joint: joints[of_triangle[nearest] as usize],
                normal,
            })
        };
        if !cut(corners, length, &mut offer) {
            return None;
        }
    }
    // A place is within two thirds of the longest edge of its piece's middle.
    Some((chosen.points, spacing + length * 2.0 / 3.0))
}

/// The points that are taken so far, in cells as wide as their distance.
struct Chosen {
    points: Vec<Point>,
    distance: f32,
    cells: FxHashMap<IVec3, Vec<u32>>,
}

impl Chosen {
    /// Takes a point unless a taken one of its joint and side is near. Returns false if there are too many.
    fn offer(&mut self, point: Point) -> bool {
        let cell = (point.place / self.distance).floor().as_ivec3();
        let is_near = |&other: &u32| {
            let other = &self.points[other as usize];
            let is_alike = other.normal == point.normal || other.normal.dot(point.normal) > ALIKE;
            is_alike
                && other.joint == point.joint
                && other.place.distance_squared(point.place) < self.distance * self.distance
        };
        let around = (0..27).map(|at| cell + IVec3::new(at % 3, at / 3 % 3, at / 9) - IVec3::ONE);
        let mut near = around.filter_map(|cell| self.cells.get(&cell));
        if near.any(|taken| taken.iter().any(is_near)) {
            return true;
        }
        let index = self.points.len() as u32;
        self.cells.entry(cell).or_default().push(index);
        self.points.push(point);
        self.points.len() <= MOST_CHOSEN
    }
}

/// The normal of a triangle, as long as twice its area.
fn normal_of([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// The vertices that triangles use, with the mean of their triangles' normals by area.
fn vertex_normals(mesh: &Mesh) -> impl Iterator<Item = (usize, Vec3)> {
    let mut normals = vec![None; mesh.positions().len()];
    for (triangle, vertices) in mesh.triangles().iter().enumerate() {
        for &vertex in vertices {
            *normals[vertex as usize].get_or_insert(Vec3::ZERO) +=
                normal_of(mesh.corners(triangle));
        }
    }
    let used = normals.into_iter().enumerate();
    used.filter_map(|(vertex, normal)| Some((vertex, normal?.normalize_or_zero())))
}

/// Number of parts that each edge of a triangle is cut into.
fn parts([a, b, c]: [Vec3; 3], spacing: f32) -> usize {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (longest / spacing).ceil().clamp(1.0, 1e5) as usize
}

/// Points of all triangles' grids without the corners.
fn grid_points(mesh: &Mesh, spacing: f32) -> usize {
    let inner = |triangle| {
        let n = parts(mesh.corners(triangle), spacing);
        (n + 1) * (n + 2) / 2 - 3
    };
    (0..mesh.triangles().len()).map(inner).sum()
}

/// Approximate number of pieces that the triangles are cut into: by area, and along long edges.
fn piece_count(mesh: &Mesh, length: f32) -> usize {
    let pieces = |triangle| {
        let corners = mesh.corners(triangle);
        let by_area = 2.0 * normal_of(corners).length() / (length * length);
        match parts(corners, length) {
            1 => 0,
            along => 2 * along + by_area.min(1e9) as usize,
        }
    };
    (0..mesh.triangles().len()).map(pieces).sum()
}

/// The points of a triangle's grid but its corners; a corner's weight is the number of steps from the edge across.
fn for_each_inner(corners: [Vec3; 3], spacing: f32, mut take: impl FnMut([usize; 3], Vec3)) {
    let n = parts(corners, spacing);
    for i in 0..=n {
        for j in 0..=n - i {
            let weights = [i, j, n - i - j];
            if weights.contains(&n) {
                continue;
            }
            let share = |corner: usize| weights[corner] as f32 / n as f32;
            take(
                weights,
                corners[0] * share(0) + corners[1] * share(1) + corners[2] * share(2),
            );
        }
    }
}
