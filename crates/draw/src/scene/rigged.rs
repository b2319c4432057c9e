//! Binds a mesh with joints of its own to a skeleton, in a pose in which the bones have its directions.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};

use super::mesh::{after, inverse};
use super::{Mesh, MeshBone};
use sabaki::anim::{
    Clip, Facing, JointId, JointKind, JointTransform, Limbs, Pose, Skeleton, forward_kinematics,
};

/// A joint of a [`RiggedMesh`].
#[derive(Clone, Debug, PartialEq)]
pub struct MeshJoint {
    /// Name.
    pub name: String,
    /// Index of its parent, which comes before it.
    pub parent: Option<usize>,
    /// Frame in the bind pose, in the mesh's space.
    pub bind: JointTransform,
}

/// A mesh with a skeleton of its own. Its vertices' bones are its joints.
#[derive(Clone, Debug, PartialEq)]
pub struct RiggedMesh {
    /// The mesh, in any unit.
    pub mesh: Mesh,
    /// Joints, parents before children.
    pub joints: Vec<MeshJoint>,
}

/// Names of a skeleton's joints, by names of a mesh's joints.
pub type JointNames = BTreeMap<String, String>;

/// A mesh that is bound to a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundMesh {
    /// The mesh, in metres.
    pub mesh: Mesh,
    /// A bone for each joint of the mesh.
    pub bones: Vec<MeshBone>,
    /// Names of the mesh's joints that are not bound to a joint of their own. They move with the nearest joint above them that is bound.
    pub unbound: Vec<String>,
    /// Whether the joints' frames are those of the skeleton, so that the mesh moves as its own file does. Otherwise the bones are bound by
    /// their directions.
    pub is_exact: bool,
}

/// Difference of a mesh's bone from the skeleton's up to which they are the same, as a share of the longest bone.
const SAME: f32 = 0.01;

impl RiggedMesh {
    /// Binds the mesh to a skeleton: joints by `names`, then those with the same name, then those whose names differ in case, digits,
    /// punctuation and prefixes alone. The mesh is scaled to the skeleton's size. `standing` has the frames of the joints in a pose in
    /// which the skeleton stands ([`standing_pose`](super::standing_pose)).
    ///
    /// # Errors
    /// Fewer than two joints of the mesh are bound.
    pub fn bind(
        &self,
        skeleton: &Skeleton,
        standing: &[JointTransform],
        names: &JointNames,
    ) -> Result<BoundMesh, NotBound> {
        let matches = self.matches(skeleton, names);
        let bound = matches.iter().flatten().count();
        if bound < 2 {
            return Err(NotBound { bound });
        }
        let binding = Binding {
            rigged: self,
            skeleton,
            standing,
            above: self.above(&matches),
            matches,
        };
        let scale = binding.scale();
        let frames = binding.frames(scale);
        let is_exact = frames.is_none();
        let bones = binding.bones(scale, frames.as_deref());
        let mut mesh = self.mesh.clone();
        for vertex in &mut mesh.vertices {
            vertex.position = vertex.position.map(|part| part * scale);
        }
        let unbound = self.joints.iter().zip(&binding.matches);
        let unbound = unbound.filter(|(_, found)| found.is_none());
        Ok(BoundMesh {
            mesh,
            bones,
            unbound: unbound.map(|(joint, _)| joint.name.clone()).collect(),
            is_exact,
        })
    }

    /// The skeleton's joint of each of the mesh's joints.
    fn matches(&self, skeleton: &Skeleton, names: &JointNames) -> Vec<Option<JointId>> {
        let mut taken = vec![false; skeleton.len()];
        let mut take = |found: Option<JointId>| {
            let found = found.filter(|id| !taken[id.index()])?;
            taken[found.index()] = true;
            Some(found)
        };
        let mut matches: Vec<Option<JointId>> = self
            .joints
            .iter()
            .map(|joint| take(names.get(&joint.name).and_then(|name| skeleton.find(name))))
            .collect();
        let mut fill = |alike: &dyn Fn(&str, &str) -> bool| {
            for (joint, found) in self.joints.iter().zip(&mut matches) {
                if found.is_none() && !names.contains_key(&joint.name) {
                    let mut ids = skeleton.ids();
                    *found = take(ids.find(|&id| alike(&joint.name, &skeleton.joint(id).name)));
                }
            }
        };
        fill(&|own, other| own == other);
        fill(&|own, other| plain(own) == plain(other));
        matches
    }

    /// The nearest bound joint at or above each joint or, for joints above all bound ones, the first bound joint.
    fn above(&self, matches: &[Option<JointId>]) -> Vec<usize> {
        let first = matches.iter().position(Option::is_some).unwrap_or_default();
        let mut above = Vec::with_capacity(self.joints.len());
        for (index, joint) in self.joints.iter().enumerate() {
            above.push(match (matches[index], joint.parent) {
                (Some(_), _) => index,
                (None, Some(parent)) => above[parent],
                (None, None) => first,
            });
        }
        above
    }
}

/// Too few joints of a mesh are bound to a skeleton.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{bound} of the mesh's joints have names of the skeleton's joints; at least 2 must")]
pub struct NotBound {
    /// Number of joints that are bound.
    pub bound: usize,
}

/// A name without case, digits, punctuation and the prefixes of some programs.
fn plain(name: &str) -> String {
    let name = name.rsplit(':').next().unwrap_or(name).to_ascii_lowercase();
    let name = name.strip_prefix("b_").unwrap_or(&name);
    let name = name.strip_prefix("mixamorig").unwrap_or(name);
    name.chars().filter(char::is_ascii_alphabetic).collect()
}

struct Binding<'a> {
    rigged: &'a RiggedMesh,
    skeleton: &'a Skeleton,
    standing: &'a [JointTransform],
    matches: Vec<Option<JointId>>,
    above: Vec<usize>,
}

impl Binding<'_> {
    /// Pairs of bound joints, the second below the first with no bound joint between: both joints in the bind pose, and on the skeleton.
    fn bones_between(&self) -> impl Iterator<Item = ([&JointTransform; 2], [JointId; 2])> + '_ {
        let joints = self.rigged.joints.iter().enumerate();
        joints.filter_map(|(child, joint)| {
            let parent = self.above[joint.parent?];
            let found = [self.matches[parent]?, self.matches[child]?];
            Some(([self.bind(parent), self.bind(child)], found))
        })
    }

    fn bind(&self, joint: usize) -> &JointTransform {
        &self.rigged.joints[joint].bind
    }

    /// Length of the mesh's unit, in metres: the ratio of the lengths of all bones.
    fn scale(&self) -> f32 {
        let (mut own, mut wanted) = (0.0, 0.0);
        for ([parent, child], found) in self.bones_between() {
            let [a, b] = found.map(|id| self.standing[id.index()].translation);
            own += parent.translation.distance(child.translation);
            wanted += a.distance(b);
        }
        if own > 0.0 && wanted > 0.0 {
            wanted / own
        } else {
            1.0
        }
    }

    /// The skeleton's frames in the mesh's bind pose, or `None` if the mesh's frames are the same.
    fn frames(&self, scale: f32) -> Option<Vec<JointTransform>> {
        let skeleton = self.skeleton;
        let offsets = skeleton.joints().iter().skip(1).map(|joint| joint.offset);
        let longest = offsets.map(Vec3::length).fold(0.0, f32::max);
        let mut wanted = vec![None; skeleton.len()];
        let mut is_exact = true;
        for ([parent, child], [above, below]) in self.bones_between() {
            let away = (child.translation - parent.translation) * scale;
            let own = parent.rotation.conjugate() * away;
            let joint = skeleton.joint(below);
            is_exact &= joint.parent == Some(above) && own.distance(joint.offset) < SAME * longest;
            // All bones on the way to a joint point to it.
            for id in skeleton.ancestry(below).take_while(|&id| id != above) {
                wanted[id.index()] = away.try_normalize();
            }
        }
        if is_exact {
            return None;
        }
        self.extend_ends(&mut wanted);
        Some(straightened(skeleton, self.standing, &wanted))
    }

    /// The tips of hands and head go on in the direction of the bone before them.
    fn extend_ends(&self, wanted: &mut [Option<Vec3>]) {
        let skeleton = self.skeleton;
        let feet = Limbs::of(skeleton).feet;
        for id in skeleton.ids().filter(|&id| is_last(skeleton, id)) {
            if feet.iter().any(|&foot| skeleton.carries(foot, id)) {
                continue;
            }
            let direction = wanted[id.index()];
            for child in skeleton.children(id) {
                wanted[child.index()] = wanted[child.index()].or(direction);
            }
        }
    }

    fn bones(&self, scale: f32, frames: Option<&[JointTransform]>) -> Vec<MeshBone> {
        let scaled = |joint: usize| JointTransform {
            translation: self.bind(joint).translation * scale,
            ..*self.bind(joint)
        };
        let joints = 0..self.rigged.joints.len();
        joints
            .map(|joint| {
                let carrier = self.above[joint];
                let id = self.matches[carrier].unwrap_or(JointId::ROOT);
                let own = scaled(carrier);
                let bind = match frames {
                    None => inverse(&own),
                    Some(frames) => {
                        // The mesh is moved, but not turned, so that the joint is at the skeleton's.
                        let frame = frames[id.index()];
                        let here = JointTransform {
                            rotation: Quat::IDENTITY,
                            translation: frame.translation - own.translation,
                        };
                        after(&inverse(&frame), &here)
                    }
                };
                MeshBone { joint: id, bind }
            })
            .collect()
    }
}

/// Frames of a clip that are looked at, at most.
const FRAMES: usize = 64;

/// The pose of the clips in which the head is highest and the feet are lowest above the lowest joint, at the origin, facing +Z: the joints'
/// frames. With no clips, the rest pose.
#[must_use]
pub fn standing_pose(skeleton: &Skeleton, clips: &[Clip]) -> Vec<JointTransform> {
    let head = skeleton.ids().find(|&id| {
        skeleton
            .joint(id)
            .name
            .to_ascii_lowercase()
            .contains("head")
    });
    let feet = Limbs::of(skeleton).feet;
    let height = |joints: &[JointTransform]| {
        let heights = joints.iter().map(|joint| joint.translation.y);
        let top = match head {
            Some(head) => joints[head.index()].translation.y,
            None => heights.clone().fold(f32::MIN, f32::max),
        };
        let lowest = heights.fold(f32::MAX, f32::min);
        let lifted = feet
            .iter()
            .map(|&foot| joints[foot.index()].translation.y - lowest);
        top - lowest - lifted.sum::<f32>()
    };
    let mut joints = Vec::new();
    let mut pose = Pose::at_rest(skeleton, Vec3::ZERO);
    let mut best = (f32::MIN, Vec::new());
    for clip in clips {
        for frame in (0..clip.frames()).step_by(clip.frames().div_ceil(FRAMES).max(1)) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let height = height(&joints);
            if height > best.0 {
                best = (height, joints.clone());
            }
        }
    }
    if best.1.is_empty() {
        forward_kinematics(skeleton, &pose, &mut best.1);
    }
    let back = Facing::of(skeleton).placement(&best.1).inverse();
    let upright = JointTransform {
        rotation: back.rotation(),
        translation: back.point(Vec3::ZERO),
    };
    best.1.iter().map(|joint| after(&upright, joint)).collect()
}

/// Turns the bones of a pose to wanted directions, joint after joint, and keeps what directions leave open.
///
/// `wanted` has the direction from a joint's parent to the joint. The root stays where it is. Joints that no direction turns keep their
/// rotation relative to their parents; feet keep theirs relative to the ground, pointing ahead.
pub(crate) fn straightened(
    skeleton: &Skeleton,
    pose: &[JointTransform],
    wanted: &[Option<Vec3>],
) -> Vec<JointTransform> {
    let feet = Limbs::of(skeleton).feet;
    let mut out: Vec<JointTransform> = Vec::with_capacity(pose.len());
    for id in skeleton.ids() {
        let old = &pose[id.index()];
        let parent = skeleton.joint(id).parent;
        let mut joint = match parent {
            Some(parent) => {
                let local = after(&inverse(&pose[parent.index()]), old);
                after(&out[parent.index()], &local)
            }
            None => *old,
        };
        let pairs: Vec<(Vec3, Vec3)> = skeleton
            .children(id)
            .filter_map(|child| {
                let away =
                    old.rotation.conjugate() * (pose[child.index()].translation - old.translation);
                Some((away.try_normalize()?, wanted[child.index()]?))
            })
            .collect();
        if !pairs.is_empty() {
            joint.rotation = turned(joint.rotation, &pairs, parent.is_none());
        } else if feet.contains(&id) {
            joint.rotation = ahead(skeleton, id, old);
        }
        out.push(joint);
    }
    out
}

/// The rotation near `start` that turns the first of each pair closest to the second. If `anew`, starts a quarter turn about the vertical apart
/// are tried too.
fn turned(start: Quat, pairs: &[(Vec3, Vec3)], anew: bool) -> Quat {
    let miss = |rotation: Quat| -> f32 {
        let pairs = pairs.iter();
        pairs
            .map(|&(own, wanted)| (rotation * own).distance_squared(wanted))
            .sum()
    };
    if let [(own, wanted)] = *pairs
        && !anew
    {
        return Quat::from_rotation_arc((start * own).normalize(), wanted) * start;
    }
    let mut best = start;
    for quarter in 0..if anew { 4 } else { 1 } {
        let mut rotation =
            Quat::from_rotation_y(quarter as f32 * std::f32::consts::FRAC_PI_2) * start;
        for _ in 0..200 {
            let torque: Vec3 = pairs
                .iter()
                .map(|&(own, wanted)| (rotation * own).cross(wanted))
                .sum();
            let step = torque / pairs.len() as f32;
            rotation = (Quat::from_scaled_axis(step) * rotation).normalize();
        }
        if quarter == 0 || miss(rotation) < miss(best) {
            best = rotation;
        }
    }
    best
}

/// A foot's rotation with the toes turned towards +Z about the vertical.
fn ahead(skeleton: &Skeleton, foot: JointId, old: &JointTransform) -> Quat {
    let toes = skeleton
        .children(foot)
        .map(|child| old.rotation * skeleton.joint(child).offset)
        .find(|offset| offset.length() > 1e-3);
    let Some(toes) = toes else {
        return old.rotation;
    };
    Quat::from_rotation_y(-toes.x.atan2(toes.z)) * old.rotation
}

/// Whether a joint has no child but end sites.
fn is_last(skeleton: &Skeleton, id: JointId) -> bool {
    let moving = |child: JointId| skeleton.joint(child).kind == JointKind::Moving;
    !skeleton.children(id).any(moving)
}
