//! A human body made by code for a skeleton: rounded shapes around its bones, joined smoothly, as a skinned mesh.
//!
//! The body is made in a pose with spread arms and legs, so that only neighbouring parts join.

mod anatomy;
mod human;
mod shapes;

use fast_surface_nets::ndshape::{RuntimeShape, Shape as _};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::{UVec3, Vec3};

use crate::scene::{
    BoundMesh, Look, Mesh, MeshBone, MeshVertex, Outfit, inverse, simplified, standing_pose, whole,
};
use anatomy::Anatomy;
use sabaki::anim::{Clip, JointTransform, Skeleton};
use shapes::Shapes;

/// Triangles of the finest resolution.
const TRIANGLES: usize = 7000;
/// Side of a cell of the grid that the surface is sampled on, as a share of the height.
const CELL: f32 = 0.0068;

/// Width and depth up to which a body is made, as multiples of its height. A grid around wider ones would take seconds to fill.
const WIDEST: f32 = 4.0;

/// Creates a clothed human body for a skeleton, or `None` if its joints' names do not tell two legs and two arms, or if with spread arms it is
/// more than four times as wide as high.
///
/// The mesh's resolutions have about 7,000, 800, 260 and 80 triangles. Each joint of the skeleton is a bone.
#[must_use]
pub fn human_body(
    skeleton: &Skeleton,
    standing: &[JointTransform],
    look: &Look,
) -> Option<BoundMesh> {
    let anatomy = Anatomy::of(skeleton, standing)?;
    let human = human::shapes(&anatomy, look);
    let (low, high) = anatomy.bounds();
    // Nor is one made whose size is not a number.
    let fits = ((high - low) / anatomy.height).max_element() <= WIDEST;
    if !fits {
        return None;
    }
    let cell = CELL * anatomy.height;
    let net = surface(&human, low, high, cell);
    let vertex = |&position: &[f32; 3]| {
        let place = low + Vec3::from(position) * cell;
        let [red, green, blue] = whole(human.nearest(place).0.colour);
        let (bones, weights) = human.weights(place);
        MeshVertex {
            position: place.to_array(),
            normal: human.normal(place, 0.5 * cell).to_array(),
            uv: [0.0; 2],
            colour: [red, green, blue, 0],
            bones,
            weights,
        }
    };
    let vertices: Vec<MeshVertex> = net.positions.iter().map(vertex).collect();
    let (triangles, _) = net.indices.as_chunks();
    let mut triangles = simplified(&vertices, triangles, TRIANGLES);
    let vertices = meshopt::optimize_vertex_fetch(triangles.as_flattened_mut(), &vertices);
    let bones = skeleton.ids().map(|joint| MeshBone {
        joint,
        bind: inverse(&anatomy.frames[joint.index()]),
    });
    Some(BoundMesh {
        mesh: Mesh::new(vertices, triangles, None),
        bones: bones.collect(),
        unbound: Vec::new(),
        is_exact: true,
    })
}

/// The surface of shapes in a box, sampled in cells of side `cell`. Positions are in cells from `low`.
fn surface(human: &Shapes, low: Vec3, high: Vec3, cell: f32) -> SurfaceNetsBuffer {
    /// Cells on a side of a block that is sampled once if it is far from the surface.
    const BLOCK: u32 = 8;
    let size = ((high - low) / cell).ceil().as_uvec3() + 2;
    let place = |at: Vec3| low + at * cell;
    // Distances of joined shapes are not exact: twice the block's radius is safe.
    let far = 3f32.sqrt() * BLOCK as f32 * cell;
    let blocks = RuntimeShape::<u32, 3>::new(((size + BLOCK - 1) / BLOCK).to_array());
    let middle = |block| (UVec3::from(blocks.delinearize(block)).as_vec3() + 0.5) * BLOCK as f32;
    let middles = (0..blocks.size()).map(|block| human.distance(place(middle(block))));
    let middles: Vec<f32> = middles.collect();
    let shape = RuntimeShape::<u32, 3>::new(size.to_array());
    let distance = |index| {
        let at = UVec3::from(shape.delinearize(index));
        let about = middles[blocks.linearize((at / BLOCK).to_array()) as usize];
        match about.abs() > far {
            true => about,
            false => human.distance(place(at.as_vec3())),
        }
    };
    let distances: Vec<f32> = (0..shape.size()).map(distance).collect();
    let mut net = SurfaceNetsBuffer::default();
    surface_nets(&distances, &shape, [0; 3], (size - 1).to_array(), &mut net);
    net
}

impl Outfit {
    /// Bodies made by code for a skeleton and its clips, in the colours of the two fighters of a duel. `None` as for [`human_body`].
    #[must_use]
    pub fn human(skeleton: &Skeleton, clips: &[Clip]) -> Option<Self> {
        let [white, blue] = Look::fighters();
        let body = human_body(skeleton, &standing_pose(skeleton, clips), &white)?;
        let other = body.mesh.clone().recoloured(white.clothes, blue.clothes);
        Some(Self::new([body.mesh, other], body.bones))
    }
}
