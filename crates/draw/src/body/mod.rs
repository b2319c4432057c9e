//! A human body made by code for a skeleton: rounded shapes around its bones, joined smoothly, as a skinned mesh.
//!
//! The body is made in a pose with spread arms and legs, so that only neighbouring parts join.

mod anatomy;
mod human;
mod shapes;
mod surface_net;

use crate::scene::{
    BoundMesh, DuelPlaybackSettings, Look, Mesh, MeshBone, MeshVertex, Outfit, inverse, simplified,
    standing_pose, whole,
};
use anatomy::Anatomy;
use sabaki::anim::{Clip, JointTransform, Skeleton};
use surface_net::{Grid, surface_net};

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
    let cell = CELL * anatomy.height;
    let (low, high) = human.bounds();
    // Nor is one made whose size is not a number.
    let fits = ((high - low) / anatomy.height).max_element() <= WIDEST;
    if !fits {
        return None;
    }
    let distance = |place| human.distance(place);
    let net = surface_net(Grid { low, high, cell }, &distance);
    let weights = net.weights(&anatomy, &human, cell);
    let vertices: Vec<MeshVertex> = net
        .places
        .iter()
        .zip(weights)
        .map(|(&place, (bones, weights))| {
            let [red, green, blue] = whole(human.colour(place));
            MeshVertex {
                position: place.to_array(),
                normal: human.normal(place, 0.5 * cell).to_array(),
                uv: [0.0; 2],
                colour: [red, green, blue, 0],
                bones,
                weights,
            }
        })
        .collect();
    let triangles = simplified(&vertices, &net.triangles, TRIANGLES);
    let (vertices, triangles) = used(&vertices, triangles);
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

impl Outfit {
    /// Bodies made by code for a skeleton and its clips, in the colours of the two fighters of a duel. `None` as for [`human_body`].
    #[must_use]
    pub fn human(skeleton: &Skeleton, clips: &[Clip]) -> Option<Self> {
        let [white, blue] = DuelPlaybackSettings::default().looks;
        let body = human_body(skeleton, &standing_pose(skeleton, clips), &white)?;
        let other = body.mesh.clone().recoloured(white.clothes, blue.clothes);
        Some(Self::new([body.mesh, other], body.bones))
    }
}

/// Removes the vertices that no triangle uses.
fn used(vertices: &[MeshVertex], mut triangles: Vec<[u32; 3]>) -> (Vec<MeshVertex>, Vec<[u32; 3]>) {
    let mut numbers = vec![u32::MAX; vertices.len()];
    let mut kept = Vec::new();
    for corner in triangles.as_flattened_mut() {
        let number = &mut numbers[*corner as usize];
        if *number == u32::MAX {
            *number = kept.len() as u32;
            kept.push(vertices[*corner as usize]);
        }
        *corner = *number;
    }
    (kept, triangles)
}
