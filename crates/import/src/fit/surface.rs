//! A mesh as points distributed over its triangles, each with its joint and its outward normal.

use glam::Vec3;

use super::Mesh;
use super::sampling::Points;
use super::tree::PointTree;
use super::winding::Winding;
use sabaki::anim::JointId;
use sabaki::math::in_parallel;

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
        let Points {
            places,
            joints,
            normals,
            spacing,
        } = Points::new(mesh, joints, spacing);
        let winding = Winding::new(mesh, places.len());
        let (normals, is_inner) = sides(&winding, &places, &normals);
        let all: Vec<u32> = (0..places.len() as u32).collect();
        let on_border = |&point: &u32| normals[point as usize] != Vec3::ZERO;
        let border = PointTree::new(&places, all.iter().copied().filter(on_border).collect());
        let tree = PointTree::new(&places, all);
        Self {
            joints,
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
fn sides(winding: &Winding, places: &[Vec3], normals: &[Vec3]) -> (Vec<Vec3>, Vec<bool>) {
    let of = |index: usize| side(winding, places[index], normals[index]);
    in_parallel(0, places.len(), of).into_iter().unzip()
}

/// Outward normal, or zero if both sides are inside or both outside; and whether both are inside.
fn side(winding: &Winding, place: Vec3, normal: Vec3) -> (Vec3, bool) {
    if normal == Vec3::ZERO {
        return (normal, false);
    }
    match winding.are_inside(place, BESIDE * normal) {
        [true, false] => (normal, false),
        [false, true] => (-normal, false),
        [behind, _] => (Vec3::ZERO, behind),
    }
}
