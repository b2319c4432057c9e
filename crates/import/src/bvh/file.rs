use glam::{DVec3, Quat, Vec3};

use super::channel::local_transform;
use super::lexer::Lexer;
use super::{BvhError, Channel, hierarchy, motion, names};
use sabaki::anim::{
    Clip, ClipDesc, ClipError, Joint, JointId, JointKind, Pose, Skeleton, SkeletonError,
};

/// A BVH file as it is: lengths in its own unit, angles in degrees.
///
/// Position channels *replace* the joint's offset, of the root as of any other joint.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhFile {
    joints: Vec<BvhJoint>,
    frame_time: f64,
    declared_frames: u64,
    channels: usize,
    values: Vec<f64>,
}

/// One joint of a [`BvhFile`].
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// Unique in the file: a repeated name got `_2`, an End Site is named after its parent with `_End`.
    pub name: String,
    /// Index of the parent; `None` for the root alone.
    pub parent: Option<usize>,
    /// From the parent, in the file's unit.
    pub offset: DVec3,
    /// Whether it is an End Site.
    pub kind: JointKind,
    /// In the order of the file.
    pub channels: Vec<Channel>,
    /// Where its values start in a frame.
    pub first_channel: usize,
}

/// Why what a file holds is no motion in metres: as a rule, the scale is out of all range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// Of the skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Of the motion.
    #[error(transparent)]
    Clip(#[from] ClipError),
}

impl BvhFile {
    /// Reads the text of a file.
    ///
    /// More frames than `Frames:` says are read too: nothing recorded is dropped. Fewer are an error.
    ///
    /// # Errors
    /// The first thing that is wrong, with its line and column.
    pub fn parse(text: &[u8]) -> Result<Self, BvhError> {
        let mut lexer = Lexer::new(text)?;
        let raw = hierarchy::parse(&mut lexer)?;
        let names = names::unique(&raw);
        let mut channels = 0;
        let joints = raw
            .into_iter()
            .zip(names)
            .map(|(raw, name)| {
                let kind = if raw.is_end {
                    JointKind::EndSite
                } else {
                    JointKind::Moving
                };
                let joint = BvhJoint {
                    name,
                    parent: raw.parent,
                    offset: raw.offset.unwrap_or_default(),
                    kind,
                    channels: raw.channels.unwrap_or_default(),
                    first_channel: channels,
                };
                channels += joint.channels.len();
                joint
            })
            .collect();
        let motion = motion::parse(&mut lexer, channels)?;
        Ok(Self {
            joints,
            frame_time: motion.frame_time,
            declared_frames: motion.declared_frames,
            channels,
            values: motion.values,
        })
    }

    /// Parents before children, the root first, in the order of the file.
    #[must_use]
    pub fn joints(&self) -> &[BvhJoint] {
        &self.joints
    }

    /// How many frames the file holds, at least one.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// How many frames it says it holds; not more than [`Self::frames`].
    #[must_use]
    pub fn declared_frames(&self) -> u64 {
        self.declared_frames
    }

    /// From frame to frame, seconds.
    #[must_use]
    pub fn frame_time(&self) -> f64 {
        self.frame_time
    }

    /// The values of one frame, one for each channel of each joint.
    #[must_use]
    pub fn frame(&self, frame: usize) -> &[f64] {
        &self.values[frame * self.channels..(frame + 1) * self.channels]
    }

    /// The skeleton, in metres; in the file's unit for a scale of 1.
    ///
    /// # Errors
    /// Only where the scale makes an offset infinite.
    pub fn skeleton(&self, metres_per_unit: f64) -> Result<Skeleton, SkeletonError> {
        let joints = self.joints.iter().map(|joint| Joint {
            name: joint.name.clone(),
            parent: joint.parent.map(|parent| JointId(parent as u16)),
            offset: (joint.offset * metres_per_unit).as_vec3(),
            kind: joint.kind,
        });
        Skeleton::new(joints.collect())
    }

    /// One frame as a pose, in metres; with the places of all joints.
    pub fn pose(&self, frame: usize, metres_per_unit: f64, out: &mut Pose) {
        out.rotations.clear();
        out.translations.clear();
        let values = self.frame(frame);
        for joint in &self.joints {
            let (rotation, place) = local_transform(
                &joint.channels,
                &values[joint.first_channel..],
                joint.offset,
            );
            out.rotations.push(rotation.as_quat());
            out.translations.push((place * metres_per_unit).as_vec3());
        }
        out.root = out.translations.first().copied().unwrap_or_default();
    }

    /// Skeleton and motion in metres; in the file's unit for a scale of 1. The clip has translations only where a joint
    /// other than the root leaves its offset.
    ///
    /// # Errors
    /// Only where the scale makes a length infinite.
    pub fn motion(
        &self,
        name: &str,
        metres_per_unit: f64,
    ) -> Result<(Skeleton, Clip), MotionError> {
        let skeleton = self.skeleton(metres_per_unit)?;
        let frames = self.frames();
        let entries = frames * self.joints.len();
        let moves_joints = self.moves_joints();
        let mut desc = ClipDesc {
            name: name.to_owned(),
            frame_rate: 1.0 / self.frame_time,
            roots: Vec::<Vec3>::with_capacity(frames),
            rotations: Vec::<Quat>::with_capacity(entries),
            translations: Vec::with_capacity(if moves_joints { entries } else { 0 }),
        };
        let mut pose = Pose::default();
        for frame in 0..frames {
            self.pose(frame, metres_per_unit, &mut pose);
            desc.roots.push(pose.root);
            desc.rotations.append(&mut pose.rotations);
            if moves_joints {
                desc.translations.append(&mut pose.translations);
            }
        }
        let clip = Clip::new(&skeleton, desc)?;
        Ok((skeleton, clip))
    }

    /// Whether a joint other than the root leaves its offset. Files that repeat the offset in every frame, written with few
    /// digits, do not.
    fn moves_joints(&self) -> bool {
        const DIGITS: f64 = 1e-5;
        let below_root = || self.joints.iter().skip(1);
        let longest = below_root()
            .map(|joint| joint.offset.length())
            .fold(0.0, f64::max);
        below_root().any(|joint| {
            joint.channels.iter().enumerate().any(|(index, &channel)| {
                let Channel::Position(axis) = channel else {
                    return false;
                };
                self.values
                    .iter()
                    .skip(joint.first_channel + index)
                    .step_by(self.channels)
                    .any(|value| (value - joint.offset[axis]).abs() > DIGITS * longest)
            })
        })
    }
}
