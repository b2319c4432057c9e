//! Turns the skeleton of a file into that of a figure, so that all that follows sees one kind: its root is the joint where legs and trunk
//! meet, and its bones are as long as the clips have them.
//!
//! The method is ours. Joints above the root (`Reference`, `Armature`, a root on the ground that carries the path) are evaluated in each frame
//! and become part of the root's own motion. Bones whose lengths stand in the frames and not in the skeleton, as in files whose offsets are 0,
//! get the median of their frames, if no frame has them as the skeleton does.

use std::ops::Range;
use std::path::Path;

use glam::{Quat, Vec3};
use sabaki::anim::{
    Chain, Clip, ClipDesc, ClipError, Facing, FileJoints, Joint, JointId, JointTransform, Leg,
    Limbs, PathCarrier, Pose, Skeleton, SkeletonError, WholeSkeleton, body_root,
    forward_kinematics,
};
use sabaki::math::Rigid2;
use serde::Deserialize;

use crate::body::unknown_joint;
use crate::error::shortened;
use crate::file::{parse_json, read_bytes};
use crate::{ClipSet, ReadError};

/// The part of a skeleton that is a body, below the joints that only carry it.
pub(crate) struct Rooted {
    /// The body's skeleton.
    pub(crate) skeleton: Skeleton,
    /// Its joints in the file's skeleton, the root first.
    joints: Vec<JointId>,
}

impl Rooted {
    /// Finds the body of a skeleton. `None` if the skeleton's root is that of the body.
    ///
    /// # Errors
    /// The body's root is too far away.
    pub(crate) fn of(skeleton: &Skeleton) -> Result<Option<Self>, SkeletonError> {
        Self::at(skeleton, figure_root(skeleton)?)
    }

    /// The body below a joint.
    fn at(skeleton: &Skeleton, root: JointId) -> Result<Option<Self>, SkeletonError> {
        if root == JointId::ROOT {
            return Ok(None);
        }
        let joints = skeleton.ids().filter(|&id| skeleton.carries(root, id));
        let joints: Vec<JointId> = joints.collect();
        let own = |id: JointId| joints.iter().position(|&joint| joint == id);
        let above = skeleton.ancestry(root);
        let place: Vec3 = above.map(|id| skeleton.joint(id).offset).sum();
        let of_body = joints.iter().map(|&id| {
            let joint = skeleton.joint(id);
            let parent = joint.parent.and_then(own).map(|own| JointId(own as u16));
            Joint {
                parent,
                offset: if parent.is_some() {
                    joint.offset
                } else {
                    place
                },
                ..joint.clone()
            }
        });
        let skeleton = Skeleton::new(of_body.collect())?;
        Ok(Some(Self { skeleton, joints }))
    }

    /// The body in a pose of the file's skeleton.
    pub(crate) fn pose(&self, file: &Skeleton, pose: &Pose) -> Pose {
        let root = Chain::of(file, pose).global(self.joints[0]);
        let mut own = Pose {
            root: root.translation,
            rotations: self
                .joints
                .iter()
                .map(|id| pose.rotations[id.index()])
                .collect(),
            translations: Vec::new(),
        };
        own.rotations[0] = root.rotation;
        if !pose.translations.is_empty() {
            let places = self.joints.iter().map(|id| pose.translations[id.index()]);
            own.translations.extend(places);
            own.translations[0] = root.translation;
        }
        own
    }

    /// The body's skeleton, which knows the other joints as the clip has them, and its motion.
    ///
    /// # Errors
    /// The root is too far away in a frame.
    pub(crate) fn clip(&self, file: &Skeleton, clip: &Clip) -> Result<(Skeleton, Clip), ClipError> {
        let mut pose = Pose::default();
        let own = |frame, own: &mut Pose| {
            clip.pose(frame, &mut pose);
            *own = self.pose(file, &pose);
        };
        let (rate, frames) = (clip.frame_rate(), clip.frames());
        let own = ClipDesc::of_poses(clip.name(), rate, frames, own);
        let own = clip_of(&self.skeleton, own)?;
        clip.pose(0, &mut pose);
        let locals = file.ids().map(|id| pose.local(file, id));
        let (rotations, places): (Vec<Quat>, Vec<Vec3>) = locals.unzip();
        let joints = file.joints().iter().zip(places);
        let file_joints = FileJoints {
            joints: joints
                .map(|(joint, offset)| Joint {
                    offset,
                    ..joint.clone()
                })
                .collect(),
            rotations: rotations.into_iter().map(Quat::normalize).collect(),
            body: self.joints.clone(),
            carrier: self.carrier(file, clip),
        };
        let skeleton = self.skeleton.clone().with_file(file_joints);
        Ok((skeleton.ok_or(SkeletonError::File)?, own))
    }

    /// The topmost joint above the body that moves in a clip, and how.
    fn carrier(&self, file: &Skeleton, clip: &Clip) -> Option<PathCarrier> {
        /// Rotation in radians, and distance in metres, below which a joint is still; height in metres, and rotation in radians, that a path on
        /// the ground does not have.
        const STILL: (f32, f32) = (2e-3, 1e-3);
        const FLAT: (f32, f32) = (0.01, 0.02);
        let mut frames = vec![Pose::default(); clip.frames()];
        for (frame, pose) in frames.iter_mut().enumerate() {
            clip.pose(frame, pose);
        }
        let moves = |&id: &JointId| {
            let (rotation, place) = frames[0].local(file, id);
            frames.iter().any(|pose| {
                let (turned, moved) = pose.local(file, id);
                rotation.angle_between(turned) > STILL.0 || place.distance(moved) > STILL.1
            })
        };
        let mut above: Vec<JointId> = file.ancestry(self.joints[0]).skip(1).collect();
        above.reverse();
        let joint = above.into_iter().find(moves)?;
        let place = |pose: &Pose| Chain::of(file, pose).global(joint);
        let first = place(&frames[0]);
        let body = self.pose(file, &frames[0]);
        let chain = Chain::of(&self.skeleton, &body);
        let heading = Facing::of(&self.skeleton).placement_by(|id| chain.global(id));
        let mut places = frames.iter().map(place);
        let rises = places
            .clone()
            .any(|place| (place.translation.y - first.translation.y).abs() > FLAT.0);
        let turns = places.any(|place| place.rotation.angle_between(first.rotation) > FLAT.1);
        let facing = Rigid2::new(-heading.heading(), 0.0, 0.0).rotation();
        let of_root = if rises { body.root.y } else { 0.0 };
        Some(PathCarrier {
            joint,
            height: first.translation.y - of_root,
            rises,
            rotation: if turns { facing } else { Quat::IDENTITY } * first.rotation,
            turns,
        })
    }
}

/// The joint where legs and trunk of a body meet: of the first one, if the skeleton has several.
fn figure_root(skeleton: &Skeleton) -> Result<JointId, SkeletonError> {
    let root = body_root(skeleton);
    let limbs = Limbs::of(skeleton);
    let is_figure = |&id: &JointId| {
        let has_pair = |ends: &[JointId]| {
            let below = ends.iter().filter(|&&end| skeleton.carries(id, end));
            below.count() > 1
        };
        has_pair(&limbs.hands) && has_pair(&limbs.feet)
    };
    // Below the root of one figure, no joint carries all limbs.
    let Some(first) = skeleton.children(root).find(is_figure) else {
        return Ok(root);
    };
    Ok(match Rooted::at(skeleton, first)? {
        Some(own) => own.joints[figure_root(&own.skeleton)?.index()],
        None => root,
    })
}

/// A motion on the skeleton that its files have.
///
/// # Errors
/// A joint is too far away.
pub(crate) fn on_whole(whole: &WholeSkeleton, clip: &Clip) -> Result<Clip, ClipError> {
    let mut body = Pose::default();
    let pose = |frame, pose: &mut Pose| {
        clip.pose(frame, &mut body);
        whole.pose(&body, pose);
    };
    let desc = ClipDesc::of_poses(clip.name(), clip.frame_rate(), clip.frames(), pose);
    Clip::new(&whole.skeleton, desc)
}

/// A clip without places of joints that are always the skeleton's offsets.
///
/// # Errors
/// The clip is invalid.
pub(crate) fn clip_of(skeleton: &Skeleton, mut desc: ClipDesc) -> Result<Clip, ClipError> {
    if !moves_joints(skeleton, &desc.translations) {
        desc.translations = Vec::new();
    }
    Clip::new(skeleton, desc)
}

/// A skeleton and a motion of it with other places and rotations.
///
/// # Errors
/// A place is too far away.
pub(crate) fn mapped(
    skeleton: &Skeleton,
    mut desc: ClipDesc,
    place: impl Fn(Vec3) -> Vec3,
    rotation: impl Fn(Quat) -> Quat,
) -> Result<(Skeleton, Clip), ClipError> {
    let joints = skeleton.joints().iter().map(|joint| Joint {
        offset: place(joint.offset),
        ..joint.clone()
    });
    let skeleton = Skeleton::new(joints.collect())?;
    for own in desc.roots.iter_mut().chain(&mut desc.translations) {
        *own = place(*own);
    }
    for own in &mut desc.rotations {
        *own = rotation(*own);
    }
    let clip = Clip::new(&skeleton, desc)?;
    Ok((skeleton, clip))
}

/// The frames between those at a clip's start and at its end in which the figure stands still with straight arms held apart (T-pose, A-pose).
fn without_rest(skeleton: &Skeleton, clip: &Clip) -> Range<usize> {
    /// Least reach of a straight arm, as a share of its length; largest cosine of the angle between the arms; and largest distance of a
    /// joint from its place in the first frame, in metres. A rest that is shorter than a time, in seconds, ends with a jump of a joint, in
    /// metres: others are moments of a motion.
    const STRAIGHT: f32 = 0.97;
    const APART: f32 = 0.2;
    const STILL: f32 = 0.02;
    const SHORT: f64 = 0.25;
    const JUMP: f32 = 0.1;
    let frames = clip.frames();
    let Ok(arms) = <[Leg; 2]>::try_from(Leg::arms(skeleton)) else {
        return 0..frames;
    };
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    let mut count = |order: &mut dyn Iterator<Item = usize>| {
        let mut first: Option<Vec<JointTransform>> = None;
        let mut moved = 0.0;
        let is_rest = |&frame: &usize| {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            let place = |id: JointId| joints[id.index()].translation;
            let reach = arms.map(|arm| (place(arm.foot) - place(arm.hip)) / arm.length(skeleton));
            let directions = reach.map(Vec3::normalize_or_zero);
            let first = first.get_or_insert_with(|| joints.clone());
            let pairs = first.iter().zip(&joints);
            let distances = pairs.map(|(a, b)| a.translation.distance(b.translation));
            moved = distances.fold(0.0, f32::max);
            reach.iter().all(|reach| reach.length() >= STRAIGHT)
                && directions[0].dot(directions[1]) <= APART
                && moved <= STILL
        };
        let count = order.take_while(is_rest).count();
        let is_moment = (count as f64) < SHORT * clip.frame_rate() && moved < JUMP;
        if is_moment { 0 } else { count }
    };
    let first = count(&mut (0..frames));
    match first < frames {
        true => first..frames - count(&mut (first..frames).rev()),
        // A clip of rest alone is what somebody wants.
        false => 0..frames,
    }
}

/// The longest run of frames in which the legs have about the length that the skeleton has. In others the figure is scaled to nothing, as where
/// it appears or vanishes.
fn whole_frames(skeleton: &Skeleton, clip: &Clip) -> Range<usize> {
    /// Share of the legs' length that is left, below which a frame shows no body.
    const LEFT: f32 = 0.8;
    let feet = Limbs::of(skeleton).feet.into_iter();
    let bones: Vec<JointId> = feet
        .flat_map(|foot| skeleton.ancestry(foot).filter(|&id| id != JointId::ROOT))
        .collect();
    let length = |place: &dyn Fn(JointId) -> Vec3| -> f32 {
        bones.iter().map(|&id| place(id).length()).sum()
    };
    let own = length(&|id| skeleton.joint(id).offset);
    let mut pose = Pose::default();
    let mut is_whole = |frame: usize| {
        clip.pose(frame, &mut pose);
        length(&|id| pose.translations[id.index()]) >= LEFT * own
    };
    let (mut longest, mut run) = (0..0, 0..0);
    for frame in 0..clip.frames() {
        if is_whole(frame) {
            run.end = frame + 1;
        } else {
            run = frame + 1..frame + 1;
        }
        if run.len() > longest.len() {
            longest = run.clone();
        }
    }
    longest
}

impl ClipSet {
    /// Leaves out frames of rest at the clips' starts and ends, and frames in which the figure is scaled to nothing, and names them. Events keep their
    /// frames.
    pub(crate) fn leave_out_rest(&mut self) -> Result<(), ClipError> {
        for index in 0..self.clips.len() {
            let clip = &self.clips[index];
            if clip.moves_joints() {
                let whole = whole_frames(&self.skeleton, clip);
                // A figure that is small in all frames is what somebody wants.
                if whole.len() > 1 {
                    self.keep_frames(index, whole, "which show no body, but joints in one place")?;
                }
            }
            let clip = &self.clips[index];
            let kept = without_rest(&self.skeleton, clip);
            self.keep_frames(index, kept, "a pose of rest with the arms held apart")?;
        }
        Ok(())
    }

    /// Keeps some frames of a clip, and says what the others are.
    fn keep_frames(
        &mut self,
        index: usize,
        kept: Range<usize>,
        what: &str,
    ) -> Result<(), ClipError> {
        let clip = &self.clips[index];
        let frames = clip.frames();
        if kept.len() == frames {
            return Ok(());
        }
        let (name, rate) = (clip.name(), clip.frame_rate());
        let (first, last) = (kept.start, frames - kept.end);
        let seconds = (first + last) as f64 / rate;
        self.warnings.push(format!(
            "{name}: left out: {first} frames at the start and {last} at the end ({seconds:.2} s), {what}"
        ));
        let pose = |frame: usize, pose: &mut Pose| clip.pose(kept.start + frame, pose);
        let desc = ClipDesc::of_poses(name, rate, kept.len(), pose);
        self.clips[index] = clip_of(&self.skeleton, desc)?;
        let (start, most) = (kept.start as f64 / rate, self.clips[index].duration());
        for event in self.events.iter_mut().filter(|event| event.clip == index) {
            event.start = (event.start - start).max(0.0);
            event.end = (event.end - start).min(most);
        }
        self.events
            .retain(|event| event.clip != index || event.end > event.start);
        Ok(())
    }
}

/// Gives the hands and feet sides if the names do not, or if toes and knees contradict them: those that the poses of the clips show. The figure
/// faces where its knees bend and its toes point.
/// Returns by what the sides are told, in words, and a note on names that are contradicted.
pub(crate) fn settle_sides(
    skeleton: &mut Skeleton,
    clips: &[Clip],
) -> (&'static str, Option<String>) {
    const BY_NAMES: (&str, Option<String>) = ("by names", None);
    const FRAMES: usize = 256;
    /// Share of their length by which toes, or knees without toes, point against the direction that the names tell if these are wrong.
    const AGAINST: f32 = 0.5;
    let limbs = Limbs::of(skeleton);
    let pairs = [limbs.hands, limbs.feet].map(|pair| <[JointId; 2]>::try_from(pair).ok());
    let [Some(hands), Some(feet)] = pairs else {
        return BY_NAMES;
    };
    let top = |end: JointId, other: JointId| {
        let own = |&joint: &JointId| !skeleton.carries(joint, other);
        skeleton.ancestry(end).take_while(own).last().unwrap_or(end)
    };
    let tops = [hands, feet].map(|[a, b]| [top(a, b), top(b, a)]);
    let (legs, facing) = (Leg::all(skeleton), Facing::of(skeleton));
    let mut leftness = [0f32; 2];
    // Of toes and knees: how far they point ahead by the names, and their length.
    let mut ahead_by_names = [[0f32; 2]; 2];
    for_some_frames(skeleton, clips, FRAMES, |_, joints| {
        let place = |id: JointId| joints[id.index()].translation;
        let named = facing.placement(joints).vector(Vec3::Z);
        let mut ahead = Vec3::ZERO;
        for leg in &legs {
            let [hip, knee, foot, toe] =
                [leg.hip, leg.knee, leg.foot, leg.toe_or_foot()].map(place);
            let thigh = knee - hip;
            let ways = [toe - foot, thigh - thigh.project_onto(foot - hip)];
            for (sums, way) in ahead_by_names.iter_mut().zip(ways) {
                sums[0] += way.dot(named);
                sums[1] += way.with_y(0.0).length();
                ahead += way;
            }
        }
        let left = Vec3::Y.cross(ahead.with_y(0.0).normalize_or_zero());
        for (sum, [a, b]) in leftness.iter_mut().zip(tops) {
            *sum += left.dot(place(a) - place(b));
        }
    });
    let is_named = |[a, b]: [JointId; 2]| skeleton.mirror(a) == Some(b);
    let has_names = is_named(hands) && is_named(feet);
    let [toes, knees] = ahead_by_names;
    // Knees turn in and out: beside toes it is enough that they do not contradict these.
    let knees_must = if toes[1] > 0.0 { 0.0 } else { AGAINST };
    let against = |[ahead, length]: [f32; 2], share: f32| ahead <= -share * length;
    let is_against = against(toes, AGAINST) && against(knees, knees_must);
    let is_against = is_against && facing.is_of_hips() && leftness != [0.0; 2];
    if has_names && !is_against {
        return BY_NAMES;
    }
    let sided = |[a, b]: [JointId; 2], leftness: f32| if leftness < 0.0 { [b, a] } else { [a, b] };
    let [hands, feet] = [sided(hands, leftness[0]), sided(feet, leftness[1])];
    if let Some(with_sides) = skeleton
        .clone()
        .with_ends([hands[0], hands[1], feet[0], feet[1]])
    {
        *skeleton = with_sides;
    }
    let note = has_names.then(|| {
        let name = |id: JointId| &skeleton.joint(id).name;
        let (left, right) = (name(feet[0]), name(feet[1]));
        format!("toes and knees point backwards by the names of left and right, so the names are taken to be exchanged: \"{left}\" is on the left, \"{right}\" on the right")
    });
    ("by structure and motion", note)
}

/// Looks at the poses and joints of about as many frames of all clips.
pub(crate) fn for_some_frames(
    skeleton: &Skeleton,
    clips: &[Clip],
    frames: usize,
    mut look: impl FnMut(&Pose, &[JointTransform]),
) {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    for clip in clips.iter().step_by(clips.len().div_ceil(frames).max(1)) {
        let step = (clip.frames() * clips.len()).div_ceil(frames).max(1);
        for frame in (0..clip.frames()).step_by(step) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            look(&pose, &joints);
        }
    }
}

/// What was taken for what, and by what, in one line.
pub(crate) fn describe(skeleton: &Skeleton, by: &str) -> String {
    let limbs = Limbs::of(skeleton);
    let names = |ids: &[JointId]| match ids {
        [] => "none".to_owned(),
        ids => {
            let names = ids.iter().map(|&id| skeleton.joint(id).name.as_str());
            names.collect::<Vec<_>>().join(", ")
        }
    };
    let above = skeleton.file_joints().map_or_else(String::new, |file| {
        let above: Vec<&str> = file.above().collect();
        format!(" (with the motion of {})", above.join(", "))
    });
    format!(
        "root {}{above}; hands {}; feet {}; {by}",
        skeleton.joint(JointId::ROOT).name,
        names(&limbs.hands),
        names(&limbs.feet)
    )
}

/// Names of the joints that stand for parts of the body, as a JSON file has them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointsFile {
    /// Joint where legs and trunk meet. Default: found.
    root: Option<String>,
    /// Left hand or wrist.
    left_hand: String,
    /// Right hand or wrist.
    right_hand: String,
    /// Left foot or ankle.
    left_foot: String,
    /// Right foot or ankle.
    right_foot: String,
}

impl ClipSet {
    /// Takes a joint of the files for the body's root. `None` if they have no such joint.
    fn root_at(&mut self, name: &str) -> Result<Option<()>, ClipError> {
        let whole = self.skeleton.whole();
        let file = whole
            .as_ref()
            .map_or(&self.skeleton, |whole| &whole.skeleton)
            .clone();
        let Some(root) = file.find(name) else {
            return Ok(None);
        };
        let rooted = Rooted::at(&file, root)?;
        for clip in &mut self.clips {
            if let Some(whole) = &whole {
                *clip = on_whole(whole, clip)?;
            }
            if let Some(rooted) = &rooted {
                (self.skeleton, *clip) = rooted.clip(&file, clip)?;
            }
        }
        let own = |id: JointId| {
            let id = whole.as_ref().map_or(id, |whole| whole.joint(id));
            match &rooted {
                Some(rooted) => rooted.joints.iter().position(|&joint| joint == id),
                None => Some(id.index()),
            }
        };
        for event in &mut self.events {
            let joints = event.joints.iter().filter_map(|&id| own(id));
            event.joints = joints.map(|own| JointId(own as u16)).collect();
        }
        if rooted.is_none() {
            self.skeleton = file;
        }
        Ok(Some(()))
    }

    /// Takes the joints of a file for root, hands and feet, whatever their names say.
    ///
    /// # Errors
    /// The file cannot be read, or names joints that are not there, or that carry each other.
    pub fn take_joints(&mut self, path: &Path) -> Result<(), ReadError> {
        let bytes = read_bytes(path)?;
        let file: JointsFile = parse_json(&bytes).map_err(ReadError::in_file(path))?;
        let wrong = |error: ClipError| ReadError::in_file(path)(error);
        let unknown = |name: &str| ReadError::in_file(path)(unknown_joint(name));
        if let Some(root) = &file.root {
            self.root_at(root)
                .map_err(wrong)?
                .ok_or_else(|| unknown(root))?;
        }
        let named = [
            &file.left_hand,
            &file.right_hand,
            &file.left_foot,
            &file.right_foot,
        ];
        let mut ends = [JointId::ROOT; 4];
        for (end, name) in ends.iter_mut().zip(named) {
            *end = self.skeleton.find(name).ok_or_else(|| unknown(name))?;
        }
        self.skeleton = (self.skeleton.clone().with_ends(ends))
            .ok_or_else(|| wrong(SkeletonError::Ends.into()))?;
        self.figure = describe(&self.skeleton, "by the file of joints");
        Ok(())
    }
}

/// Puts height 0 where the feet stand, if it is far from there: some programs write figures whose root stays at the origin. Puts clips that
/// begin far from the origin, where single precision is coarse, at the origin. Returns notes on that.
///
/// # Errors
/// A root is too far away.
pub(crate) fn settle_places(
    skeleton: &Skeleton,
    clips: &mut [Clip],
) -> Result<Vec<String>, ClipError> {
    /// Number of frames of all clips, share of them in which a foot may be lower than where it stands, and the height, as a share of a leg, up
    /// to which the ground is where the clips have it.
    const FRAMES: usize = 512;
    const LOWER: f32 = 0.1;
    const OFF: f32 = 0.25;
    /// Least height of the root over the lower foot of a figure that stands, as a share of a leg.
    const STANDS: f32 = 0.6;
    /// Distance from the origin, along the ground, up to which clips may begin, in metres.
    const FAR: f32 = 50.0;
    let legs = Leg::all(skeleton);
    let longest = legs.iter().map(|leg| leg.length(skeleton));
    let longest = longest.fold(0.0, f32::max);
    let mut lowest = Vec::new();
    for_some_frames(skeleton, clips, FRAMES, |pose, joints| {
        let height = |leg: &Leg| joints[leg.toe_or_foot().index()].translation.y;
        let lower = legs.iter().map(height).reduce(f32::min);
        let stands = |lower: &f32| pose.root.y - lower > STANDS * longest;
        lowest.extend(lower.filter(stands));
    });
    lowest.sort_by(f32::total_cmp);
    let ground = lowest.get((LOWER * lowest.len() as f32) as usize).copied();
    let ground = ground.filter(|ground| ground.abs() > OFF * longest);
    let (mut notes, mut far) = (Vec::new(), Vec::new());
    if let Some(ground) = ground {
        notes.push(format!(
            "the feet stand at a height of {ground:.2} m, which is taken for the ground"
        ));
    }
    for clip in clips {
        let start = clip.root(0).with_y(0.0);
        let is_far = start.length() > FAR;
        if is_far {
            far.push(clip.name().to_owned());
        }
        if !is_far && ground.is_none() {
            continue;
        }
        let away = if is_far { start } else { Vec3::ZERO }.with_y(ground.unwrap_or(0.0));
        let mut desc = clip.desc();
        let of_joints = desc.translations.iter_mut().step_by(skeleton.len());
        for place in desc.roots.iter_mut().chain(of_joints) {
            *place -= away;
        }
        *clip = Clip::new(skeleton, desc)?;
    }
    if !far.is_empty() {
        let far = shortened(&far);
        notes.push(format!("clips begin more than {FAR} m from the origin, where positions are coarse, and are put there: {far}"));
    }
    Ok(notes)
}

/// Whether a joint below the root moves relative to its parent by more than rounding errors.
pub(crate) fn moves_joints(skeleton: &Skeleton, translations: &[Vec3]) -> bool {
    const DIGITS: f32 = 1e-5;
    let offsets = skeleton.joints().iter().map(|joint| joint.offset);
    let longest = offsets
        .clone()
        .skip(1)
        .map(Vec3::length)
        .fold(0.0, f32::max);
    let mut frames = translations.chunks_exact(skeleton.len());
    let leaves = |frame: &[Vec3]| {
        let mut pairs = frame.iter().zip(offsets.clone()).skip(1);
        let off = |place: Vec3, offset: Vec3| (place - offset).abs().max_element();
        // Values that are not finite count as moved, so that later checks find them.
        pairs.any(|(&place, offset)| !place.is_finite() || off(place, offset) > DIGITS * longest)
    };
    frames.any(leaves)
}

/// Share of the skeleton's bones below which those of the frames are none: some files have channels of positions that are all 0.
pub(crate) const COLLAPSED: f32 = 0.5;

/// Gives the skeleton the bones that the clips have, and drops the places of joints that keep them. A clip without places has the skeleton's
/// own bones.
///
/// # Errors
/// A bone or a clip is invalid.
pub(crate) fn settle_bones(skeleton: &mut Skeleton, clips: &mut [Clip]) -> Result<(), ClipError> {
    /// Number of frames that are read, of all clips together.
    const FRAMES: usize = 512;
    /// Difference from the median of the frames above which an offset is wrong, as a share of the bone and of the longest bone.
    const OFF: (f32, f32) = (0.01, 1e-3);
    if !clips.iter().any(Clip::moves_joints) {
        return Ok(());
    }
    let of_clip = (FRAMES / clips.len()).max(1);
    let (mut pose, mut poses) = (Pose::default(), Vec::new());
    for clip in clips.iter() {
        for sample in 0..of_clip.min(clip.frames()) {
            let frame = sample * clip.frames() / of_clip.min(clip.frames());
            clip.pose(frame, &mut pose);
            pose.fill_translations(skeleton);
            poses.push(std::mem::take(&mut pose.translations));
        }
    }
    let median = |joint: usize| {
        Vec3::from([0, 1, 2].map(|axis| {
            let mut values: Vec<f32> = poses.iter().map(|places| places[joint][axis]).collect();
            let middle = values.len() / 2;
            *values.select_nth_unstable_by(middle, f32::total_cmp).1
        }))
    };
    let mut joints = skeleton.joints().to_vec();
    let bones: Vec<Vec3> = (0..joints.len()).map(median).collect();
    let sum = |bones: &mut dyn Iterator<Item = Vec3>| bones.skip(1).map(Vec3::length).sum::<f32>();
    let own = sum(&mut joints.iter().map(|joint| joint.offset));
    if sum(&mut bones.iter().copied()) < COLLAPSED * own {
        for clip in clips {
            let mut desc = clip.desc();
            desc.translations.clear();
            *clip = Clip::new(skeleton, desc)?;
        }
        return Ok(());
    }
    let longest = bones[1..]
        .iter()
        .map(|bone| bone.length())
        .fold(0.0, f32::max);
    for (index, (joint, bone)) in joints.iter_mut().zip(bones).enumerate().skip(1) {
        let most = OFF.0 * bone.length().max(joint.offset.length()) + OFF.1 * longest;
        // A bone that moves now and then keeps its length at rest.
        if poses
            .iter()
            .all(|places| joint.offset.distance(places[index]) > most)
        {
            joint.offset = bone;
        }
    }
    let file = skeleton.file_joints().cloned();
    *skeleton = Skeleton::new(joints)?;
    if let Some(file) = file {
        *skeleton = skeleton
            .clone()
            .with_file(file)
            .ok_or(SkeletonError::File)?;
    }
    for clip in clips.iter_mut().filter(|clip| clip.moves_joints()) {
        *clip = clip_of(skeleton, clip.desc())?;
    }
    Ok(())
}
