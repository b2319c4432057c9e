//! Assigns each vertex of a mesh to the joint that it moves with.
//!
//! The rule is our own. A part of the mesh with the name of a joint is assigned to that joint. Any
//! other vertex is assigned to the nearest bone: the line segment from a joint to one of its
//! children, or a point if a joint has no child. Distances *from* the bone's line are relative to
//! the bone's thickness, as [`Body::from_bones`] estimates it; distances *beyond* its ends count
//! three times as much. A thick trunk therefore keeps its sides from the arms and does not take
//! over the neck. Of equally near bones, the one farthest from the root wins.

use glam::Vec3;

use super::{FitError, Mesh};
use sabaki::anim::{Clip, JointId, JointKind, JointTransform, Pose, Skeleton, forward_kinematics};
use sabaki::maps::Body;

/// Factor for distances beyond the ends of a bone, tuned visually on wrists, necks and heels.
const BEYOND_ENDS: f32 = 3.0;

/// The pose in which a mesh fits a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct BindPose<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) joints: Vec<JointTransform>,
}

impl<'a> BindPose<'a> {
    /// The rest pose of the skeleton: no rotations, the root at its own offset. In many files this
    /// is a T-pose, but some captures have a zero pose that is not a natural posture.
    #[must_use]
    pub fn rest(skeleton: &'a Skeleton) -> Self {
        let root = skeleton.joint(JointId::ROOT).offset;
        Self::of(skeleton, &Pose::at_rest(skeleton, root))
    }

    /// A frame of a clip, counted from 0, in the space of the clip.
    ///
    /// # Errors
    /// The clip has no such frame.
    pub fn of_frame(skeleton: &'a Skeleton, clip: &Clip, frame: usize) -> Result<Self, FitError> {
        if frame >= clip.frames() || clip.joints() != skeleton.len() {
            let (clip, frames) = (clip.name().to_owned(), clip.frames());
            return Err(FitError::NoFrame {
                clip,
                frame,
                frames,
            });
        }
        let mut pose = Pose::default();
        clip.pose(frame, &mut pose);
        Ok(Self::of(skeleton, &pose))
    }

    /// A pose of the skeleton.
    #[must_use]
    pub fn of(skeleton: &'a Skeleton, pose: &Pose) -> Self {
        let mut joints = Vec::new();
        forward_kinematics(skeleton, pose, &mut joints);
        Self { skeleton, joints }
    }

    /// Frames of the joints in the space of the pose, which the mesh must match: see
    /// [`Mesh::placed`] and [`Mesh::to_stand_at`].
    pub fn joints(&self) -> &[JointTransform] {
        &self.joints
    }
}

struct Bone {
    joint: JointId,
    from: Vec3,
    /// Vector from `from` to the bone's end, or zero if the joint has no child.
    to: Vec3,
    thickness: f32,
    /// Number of ancestors of the joint.
    depth: usize,
}

impl Bone {
    /// Squared distance, in units of thickness and in metres.
    fn distances(&self, place: Vec3) -> (f32, f32) {
        let (place, length) = (place - self.from, self.to.length());
        if length == 0.0 {
            let metres = place.length_squared();
            return (metres / self.thickness.powi(2), metres);
        }
        let along = place.dot(self.to) / length;
        let lateral = (place.length_squared() - along * along).max(0.0);
        let beyond = along - along.clamp(0.0, length);
        let scaled = lateral + (BEYOND_ENDS * beyond).powi(2);
        (scaled / self.thickness.powi(2), lateral + beyond * beyond)
    }
}

/// Joint of each vertex.
///
/// # Errors
/// A vertex is farther than `furthest` metres from all bones.
pub(super) fn bind(
    pose: &BindPose<'_>,
    mesh: &Mesh,
    furthest: f32,
) -> Result<Vec<JointId>, FitError> {
    let bones = bones(pose);
    let mut named = vec![None; mesh.positions().len()];
    for part in mesh.parts() {
        let Some(joint) = pose.skeleton.find(&part.name) else {
            continue;
        };
        let joint = moving(pose.skeleton, joint);
        let triangles = part.triangles.start as usize..part.triangles.end as usize;
        for &vertex in mesh.triangles()[triangles].iter().flatten() {
            named[vertex as usize].get_or_insert(joint);
        }
    }
    let mut used = vec![false; mesh.positions().len()];
    for &vertex in mesh.triangles().iter().flatten() {
        used[vertex as usize] = true;
    }
    let vertices = mesh.positions().iter().zip(named).zip(used).enumerate();
    let joint = |(vertex, ((&place, named), used)): (usize, ((&Vec3, Option<JointId>), bool))| {
        let (joint, (metres, closest)) = nearest(&bones, place);
        if used && metres > furthest {
            let joint = pose.skeleton.joint(closest).name.clone();
            return Err(FitError::Far {
                vertex,
                metres,
                joint,
                furthest,
            });
        }
        Ok(named.unwrap_or(joint))
    };
    vertices.map(joint).collect()
}

/// Joint of the bone that is nearest relative to its thickness, and distance and joint of the
/// nearest bone in metres.
fn nearest(bones: &[Bone], place: Vec3) -> (JointId, (f32, JointId)) {
    /// Relative difference of distances below which two bones are equally near.
    const ALIKE: f32 = 1e-4;
    let (mut best, mut joint, mut depth) = (f32::INFINITY, JointId::ROOT, 0);
    let mut closest = (f32::INFINITY, JointId::ROOT);
    for bone in bones {
        let (scaled, metres) = bone.distances(place);
        if metres < closest.0 {
            closest = (metres, bone.joint);
        }
        let is_alike = (scaled - best).abs() <= ALIKE * best;
        if (is_alike && bone.depth > depth) || (!is_alike && scaled < best) {
            (best, joint, depth) = (scaled, bone.joint, bone.depth);
        }
    }
    (joint, (closest.0.sqrt(), closest.1))
}

/// The joint itself or, for an end site, its parent.
fn moving(skeleton: &Skeleton, joint: JointId) -> JointId {
    let found = skeleton.joint(joint);
    match (found.kind, found.parent) {
        (JointKind::EndSite, Some(parent)) => parent,
        _ => joint,
    }
}

fn bones(pose: &BindPose<'_>) -> Vec<Bone> {
    /// Minimum length of a bone, in metres. A shorter bone is a point.
    const SHORTEST: f32 = 1e-4;
    let skeleton = pose.skeleton;
    let guess = Body::from_bones(skeleton);
    let place = |joint: JointId| pose.joints[joint.index()].translation;
    let mut has_bone = vec![false; skeleton.len()];
    let mut bones = Vec::new();
    let mut add = |joint: JointId, to: Vec3| {
        let mut bone = Bone {
            joint,
            from: place(joint),
            to,
            thickness: 0.0,
            depth: skeleton.ancestry(joint).count(),
        };
        bone.thickness = thickness(pose, &guess, &bone);
        bones.push(bone);
    };
    for child in skeleton.ids() {
        let Some(parent) = skeleton.joint(child).parent else {
            continue;
        };
        let to = place(child) - place(parent);
        if to.length() > SHORTEST {
            has_bone[parent.index()] = true;
            add(parent, to);
        }
    }
    for joint in skeleton.ids().filter(|joint| !has_bone[joint.index()]) {
        if skeleton.joint(joint).kind == JointKind::Moving {
            add(joint, Vec3::ZERO);
        }
    }
    bones
}

/// Radius of the default body's sphere that is nearest to a bone's middle, among the spheres of the
/// bone's joint or, if it has none, of the next ancestor.
fn thickness(pose: &BindPose<'_>, guess: &Body, bone: &Bone) -> f32 {
    let middle = bone.from + 0.5 * bone.to;
    let on = |joint: JointId| {
        let here = guess
            .spheres
            .iter()
            .filter(move |sphere| sphere.joint == joint);
        let far = |sphere: &&sabaki::maps::BodySphere| {
            sphere.centre(&pose.joints).distance_squared(middle)
        };
        here.min_by(|a, b| far(a).total_cmp(&far(b)))
    };
    let found = pose.skeleton.ancestry(bone.joint).find_map(on);
    found.map_or(0.1, |sphere| sphere.radius)
}
