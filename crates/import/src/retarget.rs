//! Plays a motion on another skeleton whose joints have the same names.
//!
//! Source: the motion of each bone is copied and only the root's path is scaled, as in Monzani, Baerlocher, Boulic & Thalmann, "Using an
//! Intermediate Skeleton and Inverse Kinematics for Motion Retargeting" (2000), section 3, without the inverse kinematics that follows there.
//!
//! With rest directions d of the bones below a joint, G its rotation in the space of the motion, and A the rotation with A d' = d:
//! ```text
//! G'(joint, frame) = G(joint, frame) A(joint)
//! ```
//! where a dash marks the skeleton that the motion is put on. Bones then have the directions of the captured ones in each frame, whatever the rest poses
//! are. Lengths are those of the new skeleton: what this moves is measured.
//!
//! Differs: the roots are paired whatever their names. Another joint without a joint of its name in the file keeps its rest rotation.

use std::collections::HashMap;
use std::path::PathBuf;

use glam::{DMat3, Quat, Vec3};
use sabaki::anim::{
    Clip, ClipDesc, ClipError, JointId, JointKind, JointTransform, Pose, Skeleton,
    forward_kinematics,
};

use crate::LoadedClip;
use crate::error::FileError;
use crate::rotation::{nearest_rotation, outer};

/// Least share of the moving joints that must be found by name.
const LEAST_FOUND: f32 = 0.75;

/// Puts motions of one skeleton on another.
struct Retargeter<'a> {
    from: &'a Skeleton,
    to: &'a Skeleton,
    /// Joint of `from` for each joint of `to`.
    twins: Vec<Option<JointId>>,
    /// Whether the roots are paired although that of `to` has no joint of its name.
    pairs_roots: bool,
    /// Rotation from the rest directions of `to` to those of `from`, for each joint of `to`.
    adjustments: Vec<Quat>,
}

impl LoadedClip {
    /// The motion on another skeleton, that of the file `first`. A note says by how much joints are moved. Events get the names that their
    /// joints have there; joints that it lacks keep their names.
    pub(super) fn retargeted(mut self, to: &Skeleton, first: PathBuf) -> Result<Self, FileError> {
        let retargeter = Retargeter::new(&self, to);
        let moving = |id: &JointId| to.joint(*id).kind == JointKind::Moving;
        let all = to.ids().filter(moving).count();
        let missing = retargeter.missing();
        let found = all - missing.len();
        if (found as f32) < LEAST_FOUND * all as f32 {
            return Err(FileError::NotRetargeted { first, missing });
        }
        let scale = retargeter.scale(&self.clip);
        let (desc, mean, most) = retargeter.motion(&self.clip, scale);
        let clip = Clip::new(to, desc).map_err(not_retargeted)?;
        let note = format!(
            "retargeted: {found} of {all} joints by name, its size times {scale:.3}; joints are {:.1} cm from where its own bones would have them on average, {:.1} cm at most{}",
            100.0 * mean,
            100.0 * most,
            retargeter.unnamed(&missing)
        );
        let mut events = self.events.clone();
        for joint in events.iter_mut().flat_map(|event| &mut event.joints) {
            // A name that several joints of the file have is reported later.
            if !self.repeated_names.contains(joint)
                && let Some(name) = retargeter.name_of(joint)
            {
                name.clone_into(joint);
            }
        }
        self.notes.push(note);
        Ok(Self {
            skeleton: to.clone(),
            clip,
            events,
            ..self
        })
    }
}

/// The motion is invalid on the skeleton of the others, for example because its root is too far away there.
pub(crate) fn not_retargeted(error: ClipError) -> FileError {
    FileError::part("on the skeleton of the other files", error)
}

impl<'a> Retargeter<'a> {
    fn new(motion: &'a LoadedClip, to: &'a Skeleton) -> Self {
        let from = &motion.skeleton;
        let mut twins = by_name(from, to);
        let pairs_roots = twins[0].is_none();
        if pairs_roots {
            twins[0] = Some(JointId::ROOT);
        }
        let mut retargeter = Self {
            from,
            to,
            twins,
            pairs_roots,
            adjustments: Vec::new(),
        };
        let below = retargeter.nearest_below();
        for id in to.ids() {
            let above = to.joint(id).parent;
            let inherited = above.map_or(Quat::IDENTITY, |p| retargeter.adjustments[p.index()]);
            let bones = below[id.index()].iter();
            let bones: Vec<_> = bones.filter_map(|&end| retargeter.bone(id, end)).collect();
            let own = alignment(&bones);
            retargeter.adjustments.push(own.unwrap_or(inherited));
        }
        retargeter
    }

    fn twin(&self, id: JointId) -> Option<JointId> {
        self.twins[id.index()]
    }

    /// Name in `to` of a joint of `from`.
    fn name_of(&self, joint: &str) -> Option<&str> {
        let own = self.from.find(joint)?;
        let id = self.to.ids().find(|&id| self.twin(id) == Some(own))?;
        Some(&self.to.joint(id).name)
    }

    /// Names of the moving joints of `to` that the file does not have.
    fn missing(&self) -> Vec<String> {
        let pairs = self.to.ids().zip(self.to.joints());
        let missing = pairs.filter(|&(id, joint)| {
            let has_name = self.twin(id).is_some() && !(self.pairs_roots && id == JointId::ROOT);
            joint.kind == JointKind::Moving && !has_name
        });
        missing.map(|(_, joint)| joint.name.clone()).collect()
    }

    /// The end of the note: what became of the joints that the file does not have.
    fn unnamed(&self, missing: &[String]) -> String {
        let roots = [self.from, self.to].map(|skeleton| &skeleton.joint(JointId::ROOT).name[..]);
        let (paired, missing) = match missing {
            [root, others @ ..] if self.pairs_roots && root == roots[1] => (true, others),
            _ => (false, missing),
        };
        let mut text = String::new();
        if paired {
            text += &format!("; its root \"{}\" is taken for \"{}\"", roots[0], roots[1]);
        }
        if !missing.is_empty() {
            text += &format!("; not in the file: {}", missing.join(", "));
        }
        text
    }

    /// For each joint of `to` the nearest joints below it that have a twin, if it has one itself.
    fn nearest_below(&self) -> Vec<Vec<JointId>> {
        let mut below: Vec<Vec<JointId>> = vec![Vec::new(); self.to.len()];
        for id in self.to.ids().filter(|&id| self.twin(id).is_some()) {
            let mut above = self.to.ancestry(id).skip(1);
            if let Some(next) = above.find(|&above| self.twin(above).is_some()) {
                below[next.index()].push(id);
            }
        }
        below
    }

    /// Rest directions from a joint to one below it, in `to` and in `from`; `None` if one of them has no bone there.
    fn bone(&self, id: JointId, end: JointId) -> Option<[Vec3; 2]> {
        let bones = [
            rest_bone(self.to, id, end)?,
            rest_bone(self.from, self.twin(id)?, self.twin(end)?)?,
        ];
        let is_long = bones.iter().all(|bone| bone.length() > 1e-4);
        is_long.then(|| bones.map(Vec3::normalize))
    }

    /// Ratio of the lengths of the chains from the root to the lowest joint of the first frame.
    fn scale(&self, clip: &Clip) -> f32 {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        clip.pose(0, &mut pose);
        forward_kinematics(self.from, &pose, &mut joints);
        let height = |joint: JointId| joints[joint.index()].translation.y;
        let length = |skeleton: &Skeleton, above: JointId, below: JointId| -> Option<f32> {
            let bones = chain(skeleton, above, below)?;
            Some(bones.map(Vec3::length).sum())
        };
        let pairs = self.to.ids().filter_map(|id| {
            let (twin, above) = (self.twin(id)?, self.twin(JointId::ROOT)?);
            let lengths = [
                length(self.to, JointId::ROOT, id)?,
                length(self.from, above, twin)?,
            ];
            Some((height(twin), lengths))
        });
        match pairs.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, [to, from])) if from > 1e-4 && to > 1e-4 => to / from,
            _ => 1.0,
        }
    }

    /// The motion, and mean and largest distance of joints from their positions in the scaled skeleton of the file, in metres.
    fn motion(&self, clip: &Clip, scale: f32) -> (ClipDesc, f64, f32) {
        let mut pose = Pose::default();
        let (mut joints, mut moved): (Vec<JointTransform>, Vec<JointTransform>) =
            Default::default();
        let (mut sum, mut count, mut most) = (0.0, 0usize, 0f32);
        let own = |frame: usize, own: &mut Pose| {
            clip.pose(frame, &mut pose);
            forward_kinematics(self.from, &pose, &mut joints);
            self.rotate(&joints, &mut own.rotations);
            own.root = Vec3::ZERO;
            forward_kinematics(self.to, own, &mut moved);
            if let Some(twin) = self.twin(JointId::ROOT) {
                own.root = scale * joints[twin.index()].translation;
            }
            for (joint, twin) in moved.iter().zip(&self.twins) {
                let Some(twin) = twin else { continue };
                let away = (own.root + joint.translation)
                    .distance(scale * joints[twin.index()].translation);
                (sum, count, most) = (sum + f64::from(away), count + 1, most.max(away));
            }
        };
        let desc = ClipDesc::of_poses(clip.name(), clip.frame_rate(), clip.frames(), own);
        (desc, sum / count.max(1) as f64, most)
    }

    /// Writes the rotation of each joint of `to` relative to its parent. `joints` are those of `from`.
    fn rotate(&self, joints: &[JointTransform], out: &mut Vec<Quat>) {
        let mut global: Vec<Quat> = Vec::with_capacity(self.to.len());
        out.clear();
        for (id, joint) in self.to.ids().zip(self.to.joints()) {
            let above = joint.parent.map_or(Quat::IDENTITY, |p| global[p.index()]);
            let twin = self.twin(id).filter(|_| joint.kind == JointKind::Moving);
            let own = twin.map_or(above, |twin| {
                joints[twin.index()].rotation * self.adjustments[id.index()]
            });
            global.push(own);
            out.push(match joint.kind {
                JointKind::Moving => (above.inverse() * own).normalize(),
                JointKind::EndSite => Quat::IDENTITY,
            });
        }
    }
}

/// A joint's name without its namespace, in small letters and digits: `mixamorig:Left_Arm` is `leftarm`.
fn plain(name: &str) -> String {
    let own = name.rsplit(':').next().unwrap_or(name);
    let letters = own.chars().filter(|letter| letter.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

/// The joint of `from` with the name of each joint of `to`.
fn by_name(from: &Skeleton, to: &Skeleton) -> Vec<Option<JointId>> {
    let mut joints = HashMap::new();
    for (id, joint) in from.ids().zip(from.joints()) {
        joints.entry(plain(&joint.name)).or_insert(id);
    }
    let named = to.joints().iter().map(|joint| plain(&joint.name));
    named.map(|name| joints.get(&name).copied()).collect()
}

/// Bones from a joint to one below it in the rest pose, the last first; `None` if it is not below.
fn chain(
    skeleton: &Skeleton,
    above: JointId,
    below: JointId,
) -> Option<impl Iterator<Item = Vec3>> {
    let is_below = skeleton.ancestry(below).skip(1).any(|id| id == above);
    let chain = skeleton.ancestry(below).take_while(move |&id| id != above);
    is_below.then_some(chain.map(move |id| skeleton.joint(id).offset))
}

/// Vector from a joint to one below it in the rest pose; `None` if it is not below.
fn rest_bone(skeleton: &Skeleton, above: JointId, below: JointId) -> Option<Vec3> {
    Some(chain(skeleton, above, below)?.sum())
}

/// The rotation that turns the first direction of each pair to the second, by least squares; `None` without a pair. A single pair gives no
/// twist.
fn alignment(pairs: &[[Vec3; 2]]) -> Option<Quat> {
    /// Weight of the smallest rotation of the first pair, beside those of the pairs.
    const PRIOR: f64 = 1e-6;
    let &[from, to] = pairs.first()?;
    let smallest = DMat3::from_quat(Quat::from_rotation_arc(from, to).as_dquat());
    let products = pairs.iter().map(|pair| pair.map(Vec3::as_dvec3));
    let products = products.map(|[from, to]| outer(from, to));
    let sums = products.fold(smallest.transpose() * PRIOR, |sum, product| sum + product);
    Some(nearest_rotation(sums).as_quat())
}
