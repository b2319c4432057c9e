use std::collections::HashSet;
use std::path::Path;

use glam::{DMat3, Quat, Vec3};
use serde::Deserialize;

use super::animation::{Frames, Tracks, moved_nodes, targets};
use super::buffers::Container;
use super::nodes::{Local, Nodes, World, is_end_name, node_name};
use crate::bvh::UsedNames;
use crate::figure::{clip_of, mapped};
use crate::rotation::{nearest_rotation, outer};
use crate::{EventEntry, FileError, LONGEST_CLIP, MOST_ENTRIES};
use sabaki::anim::{Clip, ClipDesc, ClipError, Joint, JointId, JointKind, Pose, Skeleton};

/// Skeleton and animations of a glTF file, in the file's unit.
///
/// The skeleton consists of the joints of the largest skin and the nodes between them. In a file
/// without skins, it consists of the animated nodes and all their descendants. Nodes above the
/// root, such as a rotation from Z up to Y up, become part of the root's motion.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfFile {
    /// Skeleton, in the file's unit.
    pub skeleton: Skeleton,
    /// Rotation of each joint without animation. The root's is in the file's space.
    pub rest: Vec<Quat>,
    /// The names that several joints have in the file; all but the first of each were renamed.
    pub repeated_names: Vec<String>,
    /// Animations in the order of the file, at least one.
    pub animations: Vec<GltfAnimation>,
    /// What was left out of the file, one line each.
    pub notes: Vec<String>,
}

/// One animation of a [`GltfFile`].
#[derive(Clone, Debug, PartialEq)]
pub struct GltfAnimation {
    /// Name, unique in the file.
    pub name: String,
    /// Motion, in the file's unit.
    pub clip: Clip,
    /// Events in the animation's `extras`, as [`write`](super::write()) writes
    /// them: `{"sabaki": {"events": [...]}}`, each as in an events file. Empty for files from other
    /// programs.
    pub events: Vec<EventEntry>,
}

impl GltfFile {
    /// Parses a GLB or JSON file. `load` reads an external buffer, by its path relative to the
    /// file's folder.
    ///
    /// Keys are converted to frames: one for each key if all keys lie on a common grid, otherwise
    /// 60 per second. Frames begin at time 0, with the value of the first key if that is later. Animations that do not move the skeleton
    /// are left out, as are leaf bones below joints that are ends by their names.
    ///
    /// # Errors
    /// The first error, with its position.
    pub fn parse(
        bytes: &[u8],
        mut load: impl FnMut(&Path) -> Result<Vec<u8>, String>,
    ) -> Result<Self, FileError> {
        let container = Container::parse(bytes, &mut load)?;
        let mut nodes = Nodes::of(&container.root)?;
        let beyond = nodes.leave_out_ends_of_ends(&container.root);
        let mut notes: Vec<String> =
            Container::note_of_extensions(&container.root.extensions_required)
                .into_iter()
                .collect();
        if let Some(&first) = beyond.first() {
            let (name, count) = (node_name(&container, first), beyond.len());
            notes.push(format!(
                "leaf bones below ends are left out: {count}, the first is \"{name}\""
            ));
        }
        let rig = Rig::new(&container, &nodes);
        let of_rig: HashSet<usize> = rig.chain.iter().map(|link| link.node).collect();
        let is_moving = |node: usize| of_rig.contains(&node);
        let moved = moved_nodes(&container, is_moving)?;
        if moved.is_empty() {
            return Err(FileError::invalid(
                "the file has no animation of its skeleton",
            ));
        }
        let (skeleton, repeated_names) = rig.skeleton(&container, &moved)?;
        let (mut animations, mut entries) = (Vec::new(), 0);
        let mut taken = UsedNames::default();
        for (index, animation) in container.root.animations.iter().enumerate() {
            let name = animation
                .name
                .clone()
                .unwrap_or_else(|| format!("animation_{index}"));
            let name = taken.first_free(&name, "_");
            if !targets(animation).any(|(node, ..)| is_moving(node)) {
                notes.push(format!(
                    "animation \"{name}\" moves no joint and is left out"
                ));
                continue;
            }
            // The keys of one animation at a time are in memory, because keys take more than frames.
            let tracks = Tracks::read(name, &container, animation, is_moving)?;
            match tracks.repeated() {
                0 => {}
                keys => notes.push(format!(
                    "animation \"{}\": {keys} keys of a node have the time of the key before them; from that time on the last one counts",
                    tracks.name
                )),
            }
            animations.push(GltfAnimation {
                events: events_of(animation, &tracks.name)?,
                clip: rig.clip(&skeleton, &tracks, &mut entries)?,
                name: tracks.name,
            });
        }
        let rest = rig.rest.iter().map(|(rotation, _)| *rotation).collect();
        Ok(Self {
            skeleton,
            rest,
            repeated_names,
            animations,
            notes,
        })
    }

    /// Skeleton and motion of one animation, in metres.
    ///
    /// # Errors
    /// The scale makes a length too large.
    pub fn motion(
        &self,
        animation: &GltfAnimation,
        name: &str,
        metres_per_unit: f64,
    ) -> Result<(Skeleton, Clip), ClipError> {
        let metres = |place: Vec3| (place.as_dvec3() * metres_per_unit).as_vec3();
        let mut desc = animation.clip.desc();
        name.clone_into(&mut desc.name);
        mapped(&self.skeleton, desc, metres, |rotation| rotation)
    }
}

fn of_animation(name: &str, problem: String) -> FileError {
    FileError::part(format!("animation \"{name}\""), problem)
}

/// Events in the `extras` of an animation.
fn events_of(animation: &gltf_json::Animation, name: &str) -> Result<Vec<EventEntry>, FileError> {
    /// Contents of the key `sabaki`.
    #[derive(Deserialize)]
    struct SabakiExtras {
        events: Vec<EventEntry>,
    }
    let Some(extras) = &animation.extras else {
        return Ok(Vec::new());
    };
    let failed =
        |error: serde_json::Error| of_animation(name, format!("the events in its extras: {error}"));
    // Other keys belong to other programs and may hold anything.
    let value: serde_json::Value = serde_json::from_str(extras.get()).map_err(failed)?;
    match value.get("sabaki") {
        Some(ours) => Ok(SabakiExtras::deserialize(ours).map_err(failed)?.events),
        None => Ok(Vec::new()),
    }
}

/// The nodes that move the skeleton.
struct Rig<'a> {
    nodes: &'a Nodes,
    /// The nodes above the root, then the joints.
    chain: Vec<Link>,
    /// Local rotations and positions of the joints without animation.
    rest: Vec<(Quat, Vec3)>,
}

/// One node of a [`Rig`].
struct Link {
    node: usize,
    /// Index of the parent in the chain.
    parent: Option<usize>,
    rest: Local,
}

impl<'a> Rig<'a> {
    fn new(container: &Container, nodes: &'a Nodes) -> Self {
        let order: Vec<usize> = nodes.above.iter().chain(&nodes.joints).copied().collect();
        let mut places = vec![None; container.root.nodes.len()];
        for (index, &node) in order.iter().enumerate() {
            places[node] = Some(index);
        }
        let link = |&node: &usize| Link {
            node,
            parent: nodes.parents[node].and_then(|parent| places[parent]),
            rest: Local::of(&container.root.nodes[node]),
        };
        let mut rig = Self {
            nodes,
            chain: order.iter().map(link).collect(),
            rest: Vec::new(),
        };
        rig.rest = rig.pose(|link| link.rest, &mut Vec::new());
        rig
    }

    /// Parent joint of each joint.
    fn parents(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        let above = self.nodes.above.len();
        let joints = self.chain[above..].iter();
        joints.map(move |link| link.parent?.checked_sub(above))
    }

    /// Local rotations and positions of all joints, from the local transforms of all nodes. The
    /// root's are in the file's space.
    fn pose(&self, local: impl Fn(&Link) -> Local, worlds: &mut Vec<World>) -> Vec<(Quat, Vec3)> {
        worlds.clear();
        for link in &self.chain {
            let parent = link.parent.map_or(World::ORIGIN, |parent| worlds[parent]);
            worlds.push(parent.below(&local(link)));
        }
        let joints = &mut worlds[self.nodes.above.len()..];
        self.aim(joints);
        let pairs = joints.iter().zip(self.parents());
        let under = |(joint, parent): (&World, Option<usize>)| {
            let Some(parent) = parent.map(|parent| &joints[parent]) else {
                return (joint.rotation.as_quat(), joint.place().as_vec3());
            };
            let back = parent.rotation.conjugate();
            let rotation = (back * joint.rotation).normalize();
            let place = back * (joint.place() - parent.place());
            (rotation.as_quat(), place.as_vec3())
        };
        pairs.map(under).collect()
    }

    /// Turns each joint that a scale distorts so that the joints below it are, as seen from it, in the directions that they have without
    /// animation: as it turns in a space that is longer along one axis, the directions of its bones change otherwise.
    fn aim(&self, joints: &mut [World]) {
        let mut sums = vec![DMat3::ZERO; joints.len()];
        let bones = self.rest.iter().zip(self.parents()).enumerate();
        for (child, (&(_, rest), parent)) in bones {
            let Some(parent) = parent.filter(|&parent| !joints[parent].is_uniform) else {
                continue;
            };
            let rest = joints[parent].rotation * rest.as_dvec3();
            let away = joints[child].place() - joints[parent].place();
            // A share of the identity turns a single bone by the smallest angle that will do.
            let prior = DMat3::IDENTITY * (1e-4 * rest.length() * away.length());
            sums[parent] += outer(rest, away) + prior;
        }
        let distorted = |(_, sum): &(&mut World, DMat3)| *sum != DMat3::ZERO;
        for (joint, sum) in joints.iter_mut().zip(sums).filter(distorted) {
            joint.rotation = (nearest_rotation(sum) * joint.rotation).normalize();
        }
    }

    /// Builds the skeleton. A leaf whose name marks it as an end, and that no animation moves,
    /// becomes an end site. Returns the names that several joints had, too.
    fn skeleton(
        &self,
        container: &Container,
        turned: &HashSet<usize>,
    ) -> Result<(Skeleton, Vec<String>), FileError> {
        let mut has_child = vec![false; self.rest.len()];
        for parent in self.parents().flatten() {
            has_child[parent] = true;
        }
        let mut taken = UsedNames::default();
        let mut joints = Vec::with_capacity(self.rest.len());
        for (index, (parent, &(rotation, offset))) in self.parents().zip(&self.rest).enumerate() {
            let node = self.nodes.joints[index];
            let name = taken.first_free(&node_name(container, node), "_");
            let is_end = is_end_name(&name)
                && !has_child[index]
                && !turned.contains(&node)
                && rotation.angle_between(Quat::IDENTITY) < 1e-6;
            joints.push(Joint {
                parent: parent.map(|parent| JointId(parent as u16)),
                offset: if index == 0 { Vec3::ZERO } else { offset },
                kind: if is_end && index > 0 {
                    JointKind::EndSite
                } else {
                    JointKind::Moving
                },
                name,
            });
        }
        taken.repeated.sort();
        let skeleton = Skeleton::new(joints).map_err(ClipError::from)?;
        Ok((skeleton, taken.repeated))
    }

    /// Samples an animation. `entries` counts the frames times joints of all animations, with the nodes above the root.
    fn clip(
        &self,
        skeleton: &Skeleton,
        tracks: &Tracks,
        entries: &mut u64,
    ) -> Result<Clip, FileError> {
        let frames = Frames::of(tracks.times().collect::<Vec<_>>().into_iter());
        let joints = self.chain.len();
        let own = frames.count.saturating_mul(joints as u64);
        *entries = entries.saturating_add(own);
        if *entries > MOST_ENTRIES {
            let frames = frames.count;
            let problem = format!(
                "{frames} frames of {joints} joints; {MOST_ENTRIES} rotations in all are the most"
            );
            return Err(of_animation(&tracks.name, problem));
        }
        let seconds = (frames.count - 1) as f64 / frames.rate;
        if seconds > LONGEST_CLIP {
            let problem = format!("it lasts {seconds} s; {LONGEST_CLIP} s is the most");
            return Err(of_animation(&tracks.name, problem));
        }
        let mut worlds = Vec::new();
        let pose = |frame: usize, pose: &mut Pose| {
            let time = frames.time(frame as u64);
            let local = |link: &Link| tracks.sample(link.node, &link.rest, time);
            let (rotations, places): (Vec<Quat>, Vec<Vec3>) =
                self.pose(local, &mut worlds).into_iter().unzip();
            pose.root = places[0];
            (pose.rotations, pose.translations) = (rotations, places);
            for (joint, rotation) in skeleton.joints().iter().zip(&mut pose.rotations) {
                if joint.kind == JointKind::EndSite {
                    *rotation = Quat::IDENTITY;
                }
            }
        };
        let desc = ClipDesc::of_poses(&tracks.name, frames.rate, frames.count as usize, pose);
        Ok(clip_of(skeleton, desc)?)
    }
}
