//! A mesh as points distributed over its triangles, each with its joint and its outward normal.

use glam::Vec3;

use super::Mesh;
use super::tree::PointTree;
use super::winding::Winding;
use sabaki::anim::JointId;
use sabaki::math::in_parallel;

/// Maximum number of points in addition to the vertices. The spacing is doubled until they suffice.
const MOST_POINTS: usize = 60_000;
/// Distance from the surface at which inside and outside are tested, in metres.
const BESIDE: f32 = 5e-4;

/// Points on a mesh.
pub(super) struct Surface<'a> {
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
    pub winding: Winding<'a>,
    /// Maximum distance of any place on the mesh from the nearest point, in metres.
    pub spacing: f32,
}

impl<'a> Surface<'a> {
    /// Creates the points: the vertices that triangles use, and points on the triangles at most
    /// `spacing` apart if the limit allows it. A point belongs to the joint of the nearest corner,
    /// measured along the edges.
    pub(super) fn new(mesh: &'a Mesh, joints: &[JointId], spacing: f32) -> Self {
        let spacing = affordable(mesh, spacing);
        let (mut places, mut owners, mut raw) = (Vec::new(), Vec::new(), Vec::new());
        for (vertex, normal) in vertex_normals(mesh) {
            places.push(mesh.positions()[vertex]);
            owners.push(joints[vertex]);
            raw.push(normal);
        }
        for (triangle, vertices) in mesh.triangles().iter().enumerate() {
            let corners = mesh.corners(triangle);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            for_each_inner(corners, spacing, |weights, place| {
                let nearest = (0..3)
                    .rev()
                    .max_by_key(|&corner| weights[corner])
                    .unwrap_or(0);
                places.push(place);
                owners.push(joints[vertices[nearest] as usize]);
                raw.push(normal.normalize_or_zero());
            });
        }
        let winding = Winding::new(mesh);
        let (normals, is_inner) = sides(&winding, &places, &raw);
        let all: Vec<u32> = (0..places.len() as u32).collect();
        let on_border = |&point: &u32| normals[point as usize] != Vec3::ZERO;
        let border = PointTree::new(&places, all.iter().copied().filter(on_border).collect());
        let tree = PointTree::new(&places, all);
        Self {
            joints: owners,
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

/// Computes [`side`] of all points on all CPU cores. It takes most of the time of a fit.
fn sides(winding: &Winding<'_>, places: &[Vec3], normals: &[Vec3]) -> (Vec<Vec3>, Vec<bool>) {
    let of = |index: usize| side(winding, places[index], normals[index]);
    in_parallel(0, places.len(), of).into_iter().unzip()
}

/// Outward normal, or zero if both sides are inside or both outside; and whether both are inside.
fn side(winding: &Winding<'_>, place: Vec3, normal: Vec3) -> (Vec3, bool) {
    if normal == Vec3::ZERO {
        return (normal, false);
    }
    match winding.are_inside(place, BESIDE * normal) {
        [true, false] => (normal, false),
        [false, true] => (-normal, false),
        [behind, _] => (Vec3::ZERO, behind),
    }
}

/// Vertices that triangles use, with the area-weighted mean of their triangles' normals.
fn vertex_normals(mesh: &Mesh) -> impl Iterator<Item = (usize, Vec3)> {
    let mut normals = vec![None; mesh.positions().len()];
    for (triangle, vertices) in mesh.triangles().iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        for &vertex in vertices {
            *normals[vertex as usize].get_or_insert(Vec3::ZERO) += (b - a).cross(c - a);
        }
    }
    let used = normals.into_iter().enumerate();
    used.filter_map(|(vertex, normal)| Some((vertex, normal?.normalize_or_zero())))
}

/// Number of segments into which each edge of a triangle is divided.
fn pieces([a, b, c]: [Vec3; 3], spacing: f32) -> usize {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (longest / spacing).ceil().clamp(1.0, 1e5) as usize
}

/// `spacing`, doubled until the number of points is within the limit.
fn affordable(mesh: &Mesh, mut spacing: f32) -> f32 {
    let count = |spacing| -> usize {
        let inner = |triangle| {
            let n = pieces(mesh.corners(triangle), spacing);
            (n + 1) * (n + 2) / 2 - 3
        };
        (0..mesh.triangles().len()).map(inner).sum()
    };
    while count(spacing) > MOST_POINTS {
        spacing *= 2.0;
    }
    spacing
}

/// Points of a triangle's grid except its corners. The weight of a corner is the number of steps
/// from the opposite edge.
fn for_each_inner(corners: [Vec3; 3], spacing: f32, mut take: impl FnMut([usize; 3], Vec3)) {
    let n = pieces(corners, spacing);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_place_on_a_triangle_is_far_from_all_points() {
        let corners = [
            Vec3::ZERO,
            Vec3::new(0.31, 0.02, 0.0),
            Vec3::new(0.05, 0.0, 0.2),
        ];
        let mut points = corners.to_vec();
        for_each_inner(corners, 0.02, |_, place| points.push(place));
        for step in 0..400 {
            let (u, v) = ((step % 20) as f32 / 20.0, (step / 20) as f32 / 20.0);
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let place = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
            let nearest = points.iter().map(|p| p.distance(place)).fold(1.0, f32::min);
            assert!(nearest <= 0.02, "{nearest} m at {place}");
        }
    }
}
