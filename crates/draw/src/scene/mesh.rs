//! Meshes, and their bodies in a pose.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Quat, Vec3, Vec4};
use meshopt::{SimplifyOptions, simplify_with_attributes_and_locks_decoder};

use sabaki::anim::{JointId, JointTransform};
use sabaki::lod::Level;

/// A vertex of a skinned mesh, in the bind pose.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MeshVertex {
    /// Position in the mesh's space, in metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Texture coordinates. Textures repeat.
    pub uv: [f32; 2],
    /// Linear red, green and blue, and the weight of the texture: 0 for none, 1 for colour times texture. 65,535 is 1.
    pub colour: [u16; 4],
    /// Indices of the bones that move the vertex.
    pub bones: [u16; 4],
    /// Weights of the bones. 65,535 is 1.
    pub weights: [u16; 4],
}

/// Base colours of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshTexture {
    /// Width, in texels.
    pub width: u32,
    /// Height, in texels.
    pub height: u32,
    /// Red, green, blue (sRGB) and alpha, row by row from the top left.
    pub texels: Vec<[u8; 4]>,
}

/// Vertices and triangles of a skinned mesh, for a [`Stage`](crate::Stage).
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<MeshVertex>,
    /// Triangles for each [`Detail`](super::Detail), as indices of vertices, counter-clockwise seen from outside.
    pub details: [Vec<[u32; 3]>; Self::DETAILS],
    /// Texture, if there is one.
    pub texture: Option<MeshTexture>,
}

impl Mesh {
    /// Number of resolutions.
    pub const DETAILS: usize = 4;
    /// Triangles of the resolutions after the first.
    const TRIANGLES: [usize; Self::DETAILS - 1] = [800, 260, 80];

    /// Creates a mesh and its coarser resolutions.
    ///
    /// # Panics
    /// If a triangle names a vertex that is not there.
    #[must_use]
    pub fn new(
        vertices: Vec<MeshVertex>,
        triangles: Vec<[u32; 3]>,
        texture: Option<MeshTexture>,
    ) -> Self {
        let mut details = [triangles, Vec::new(), Vec::new(), Vec::new()];
        for (detail, count) in (1..).zip(Self::TRIANGLES) {
            details[detail] = simplified(&vertices, &details[detail - 1], count);
        }
        Self {
            vertices,
            details,
            texture,
        }
    }

    /// Returns the mesh with one linear colour in place of another.
    #[must_use]
    pub fn recoloured(mut self, from: Vec3, to: Vec3) -> Self {
        let (from, to) = (whole(from), whole(to));
        for vertex in &mut self.vertices {
            if vertex.colour[..3] == from {
                vertex.colour[..3].copy_from_slice(&to);
            }
        }
        self
    }

    /// Returns the mesh with all colours multiplied by a linear colour.
    #[must_use]
    pub fn tinted(mut self, tint: Vec3) -> Self {
        for vertex in &mut self.vertices {
            for (channel, share) in vertex.colour.iter_mut().zip(tint.to_array()) {
                *channel = (f32::from(*channel) * share) as u16;
            }
        }
        self
    }
}

/// At most `count` triangles of the same surface, if it can be simplified that far, by meshoptimizer. Vertices do not move; borders of colours and
/// seams of the texture stay about where they are.
///
/// # Panics
/// If a triangle names a vertex that is not there.
pub(crate) fn simplified(
    vertices: &[MeshVertex],
    triangles: &[[u32; 3]],
    count: usize,
) -> Vec<[u32; 3]> {
    /// Cost of a wrong colour, relative to the size of the mesh.
    const COLOUR: f32 = 0.12;
    // Vertices that differ in their normals alone are one.
    let mut firsts = HashMap::new();
    let indices = (0u32..).zip(vertices);
    let alike = indices.map(|(index, vertex)| {
        let uv = match vertex.colour[3] {
            0 => [0; 2],
            _ => vertex.uv.map(f32::to_bits),
        };
        let key = (vertex.position.map(f32::to_bits), vertex.colour, uv);
        *firsts.entry(key).or_insert(index)
    });
    let alike: Vec<u32> = alike.collect();
    let corners = triangles.as_flattened().iter();
    let corners: Vec<u32> = corners.map(|&corner| alike[corner as usize]).collect();
    // Vertices at borders of colours stay, if the triangles suffice for that.
    let mut locked = vec![false; vertices.len()];
    for corners in corners.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|corner| vertices[corner as usize].colour);
        for &corner in corners.iter().filter(|_| a != b || b != c) {
            locked[corner as usize] = true;
        }
    }
    if 4 * locked.iter().filter(|&&is_locked| is_locked).count() > count {
        locked.fill(false);
    }
    let positions: Vec<[f32; 3]> = vertices.iter().map(|vertex| vertex.position).collect();
    let colours = vertices.iter().flat_map(|vertex| vertex.colour);
    let colours: Vec<f32> = colours.map(|part| f32::from(part) / 65_535.0).collect();
    let kept = simplify_with_attributes_and_locks_decoder(
        &corners,
        &positions,
        &colours,
        &[COLOUR; 3],
        size_of::<[f32; 4]>(),
        &locked,
        3 * count,
        f32::MAX,
        SimplifyOptions::None,
        None,
    );
    kept.as_chunks().0.to_vec()
}

/// A linear colour as vertices have it.
pub(crate) fn whole(colour: Vec3) -> [u16; 3] {
    let part = |part: f32| (part.clamp(0.0, 1.0) * 65_535.0) as u16;
    colour.to_array().map(part)
}

/// A bone of a mesh on a skeleton: a rigid transform from the mesh's space to the frame of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshBone {
    /// Joint that moves the bone.
    pub joint: JointId,
    /// Transform from the mesh's space in the bind pose to the joint's frame.
    pub bind: JointTransform,
}

/// A mesh that is bound to a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Index in [`StageDesc::meshes`](crate::StageDesc::meshes).
    pub mesh: usize,
    /// Bones of the mesh.
    pub bones: Vec<MeshBone>,
}

impl Skin {
    /// Returns the skin for poses of a level of detail: bones of removed joints are attached to kept ones.
    pub fn attached(&self, level: &Level) -> Self {
        let bones = self.bones.iter().map(|bone| {
            let attachment = &level.attachments[bone.joint.index()];
            MeshBone {
                joint: JointId(attachment.carrier),
                bind: after(&attachment.offset, &bone.bind),
            }
        });
        Self {
            mesh: self.mesh,
            bones: bones.collect(),
        }
    }
}

/// Meshes of one or two characters of a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Outfit {
    /// Meshes for [`StageDesc::meshes`](crate::StageDesc::meshes).
    pub meshes: Vec<Mesh>,
    /// The meshes on the skeleton: of the first character, and of the others.
    pub skins: [Arc<Skin>; 2],
}

impl Outfit {
    /// Two characters with the same bones and meshes of different colours.
    #[must_use]
    pub fn new(meshes: [Mesh; 2], bones: Vec<MeshBone>) -> Self {
        let skin = |mesh| {
            Arc::new(Skin {
                mesh,
                bones: bones.clone(),
            })
        };
        Self {
            skins: [skin(0), skin(1)],
            meshes: meshes.into(),
        }
    }
}

/// A skinned mesh in a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinnedBody {
    /// Mesh, bound to the skeleton of the pose.
    pub skin: Arc<Skin>,
    /// Frames of the joints, in the world.
    pub joints: Vec<JointTransform>,
    /// Tint colour, and its weight from 0 to 1.
    pub tint: [f32; 4],
    /// Weight of the tint for each joint, from 0 to 1. Empty for 1 everywhere.
    pub tinted: Vec<f32>,
    /// Opacity. Below 1 the body is a ghost, of which only the front surface is visible.
    pub alpha: f32,
}

impl SkinnedBody {
    /// An opaque body in the mesh's own colours.
    #[must_use]
    pub fn new(skin: &Arc<Skin>, joints: &[JointTransform]) -> Self {
        Self {
            skin: Arc::clone(skin),
            joints: joints.to_vec(),
            tint: [0.0; 4],
            tinted: Vec::new(),
            alpha: 1.0,
        }
    }
}

pub(crate) fn inverse(of: &JointTransform) -> JointTransform {
    let rotation = of.rotation.conjugate();
    JointTransform {
        rotation,
        translation: rotation * -of.translation,
    }
}

/// `a` after `b`.
pub(crate) fn after(a: &JointTransform, b: &JointTransform) -> JointTransform {
    JointTransform {
        rotation: (a.rotation * b.rotation).normalize(),
        translation: a.point(b.translation),
    }
}

/// Positions of a mesh's vertices in a pose, in the world. Rotations are blended as dual quaternions, as for single bodies and near members of
/// a crowd: as `view_skin.vert` does.
///
/// Source: Kavan, Collins, Zara and O'Sullivan, "Skinning with Dual Quaternions", I3D 2007, section 3.
///
/// # Panics
/// If the skin lacks a bone that a vertex names, or `joints` is shorter than the skin's skeleton.
#[must_use]
pub fn skinned_positions(mesh: &Mesh, skin: &Skin, joints: &[JointTransform]) -> Vec<Vec3> {
    let bones: Vec<JointTransform> = skin
        .bones
        .iter()
        .map(|bone| after(&joints[bone.joint.index()], &bone.bind))
        .collect();
    let position = |vertex: &MeshVertex| {
        let (mut real, mut moved, mut first) = (Vec4::ZERO, Vec4::ZERO, None);
        for (bone, weight) in vertex.bones.iter().zip(vertex.weights) {
            if weight == 0 {
                continue;
            }
            let bone = &bones[usize::from(*bone)];
            let rotation = Vec4::from(bone.rotation);
            let first = *first.get_or_insert(rotation);
            let sign = if first.dot(rotation) < 0.0 { -1.0 } else { 1.0 };
            let weight = sign * f32::from(weight) / 65_535.0;
            let translation = Quat::from_vec4(bone.translation.extend(0.0));
            real += weight * rotation;
            moved += weight * 0.5 * Vec4::from(translation * bone.rotation);
        }
        let size = 1.0 / real.length();
        let (real, moved) = (real * size, moved * size);
        let (r, m) = (real.truncate(), moved.truncate());
        let by = 2.0 * (real.w * m - moved.w * r + r.cross(m));
        Quat::from_vec4(real) * Vec3::from(vertex.position) + by
    };
    mesh.vertices.iter().map(position).collect()
}
