//! Positions of a skinned mesh's vertices, computed as `view_skin.vert` does.
//!
//! Source: Kavan, Collins, Zara and O'Sullivan, "Skinning with Dual Quaternions", I3D 2007, section 3.

use glam::{Quat, Vec3, Vec4};

use super::mesh::after;
use super::{Mesh, Skin};
use sabaki::anim::JointTransform;

/// Positions of a mesh's vertices in a pose, in the world. Rotations are blended as dual quaternions, as for single bodies and near members of
/// a crowd.
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
    let position = |vertex: &super::MeshVertex| {
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
