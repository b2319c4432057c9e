use glam::{DQuat, DVec3};

use super::parse::{Lexer, make_unique, parse_hierarchy, parse_motion, repeated_names};
use crate::figure::motion_of_poses;
use crate::{FileError, TextError};
use sabaki::anim::{Clip, ClipError, Joint, JointId, JointKind, Pose, Skeleton, SkeletonError};

/// The contents of a BVH file, with lengths in the file's unit and angles in degrees.
///
/// Position channels *replace* the offset of a joint, including the root's.
#[derive(Clone, Debug, PartialEq)]
pub struct BvhFile {
    /// Joints in the order of the file: the root first, parents before children.
    pub joints: Vec<BvhJoint>,
    /// The names that several joints have in the file; all but the first of each were renamed.
    pub repeated_names: Vec<String>,
    /// Time between frames, in seconds.
    pub frame_time: f64,
    declared_frames: u64,
    channels: usize,
    values: Vec<f64>,
}

/// One joint of a [`BvhFile`].
#[derive(Clone, Debug, PartialEq)]
pub struct BvhJoint {
    /// Name, unique in the file. Repeated names get a number (`_2`). The name of an End Site is its
    /// parent's name with `_End`.
    pub name: String,
    /// Index of the parent, or `None` for the root.
    pub parent: Option<usize>,
    /// Position in the parent's frame, in the file's unit.
    pub offset: DVec3,
    /// Kind of the joint: moving or End Site.
    pub kind: JointKind,
    /// Channels, in the order of the file.
    pub channels: Vec<Channel>,
}

impl BvhFile {
    /// Parses the text of a file.
    ///
    /// If the file has more frames than `Frames:` declares, all of them are read. Fewer frames are
    /// an error.
    ///
    /// # Errors
    /// The first error, with its line and column.
    pub fn parse(text: &[u8]) -> Result<Self, TextError> {
        let mut lexer = Lexer::new(text)?;
        let mut joints = parse_hierarchy(&mut lexer)?;
        let channels = joints.iter().map(|joint| joint.channels.len()).sum();
        let (declared_frames, frame_time, values) = parse_motion(&mut lexer, channels)?;
        let moving = joints
            .iter()
            .filter(|joint| joint.kind == JointKind::Moving);
        let repeated_names = repeated_names(moving.map(|joint| &joint.name[..]));
        make_unique(&mut joints);
        Ok(Self {
            joints,
            repeated_names,
            frame_time,
            declared_frames,
            channels,
            values,
        })
    }

    /// Doubtful contents of the file, one line each: frames beyond the number that it states, joints that rotate about one
    /// axis twice in a row, and scales, which are ignored.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let frames = self.frames();
        if self.declared_frames != frames as u64 {
            notes.push(format!(
                "the file says that it has {} frames, but has {frames}: all of them are read",
                self.declared_frames
            ));
        }
        for joint in &self.joints {
            let is_twice =
                |pair: &[Channel]| matches!(pair[0], Channel::Rotation(_)) && pair[0] == pair[1];
            if joint.channels.windows(2).any(is_twice) {
                let names = joint.channels.iter().map(|channel| channel.name());
                let names: Vec<&str> = names.collect();
                notes.push(format!(
                    "joint \"{}\" turns about one axis twice in a row ({}): it cannot turn about all three",
                    joint.name,
                    names.join(" ")
                ));
            }
        }
        let has_scale = |joint: &&BvhJoint| {
            let mut channels = joint.channels.iter();
            channels.any(|channel| matches!(channel, Channel::Scale(_)))
        };
        let mut scaled = self.joints.iter().filter(has_scale);
        if let Some(first) = scaled.next() {
            let more = match scaled.count() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            notes.push(format!(
                "joints have channels of scale, which are ignored: \"{}\"{more}",
                first.name
            ));
        }
        notes
    }

    /// Number of frames in the file, at least 1.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// The skeleton in metres. A scale of 1 keeps the file's unit.
    ///
    /// # Errors
    /// The scale makes an offset infinite.
    pub fn skeleton(&self, metres_per_unit: f64) -> Result<Skeleton, SkeletonError> {
        let joints = self.joints.iter().map(|joint| Joint {
            name: joint.name.clone(),
            parent: joint.parent.map(|parent| JointId(parent as u16)),
            offset: (joint.offset * metres_per_unit).as_vec3(),
            kind: joint.kind,
        });
        Skeleton::new(joints.collect())
    }

    /// Writes one frame to `out` as a pose in metres, with the positions of all joints.
    pub fn pose(&self, frame: usize, metres_per_unit: f64, out: &mut Pose) {
        out.rotations.clear();
        out.translations.clear();
        let mut values = self.values[frame * self.channels..][..self.channels].iter();
        for joint in &self.joints {
            let (mut rotation, mut place) = (DQuat::IDENTITY, joint.offset);
            for (&channel, &value) in joint.channels.iter().zip(&mut values) {
                match channel {
                    Channel::Position(axis) => place[axis] = value,
                    Channel::Rotation(axis) => {
                        rotation *= DQuat::from_axis_angle(DVec3::AXES[axis], value.to_radians());
                    }
                    Channel::Scale(_) => {}
                }
            }
            out.rotations.push(rotation.normalize().as_quat());
            out.translations.push((place * metres_per_unit).as_vec3());
        }
        out.root = out.translations.first().copied().unwrap_or_default();
    }

    /// Skeleton and motion in metres. A scale of 1 keeps the file's unit. The clip has translations
    /// only if a joint other than the root moves relative to its parent.
    ///
    /// # Errors
    /// The scale makes a length infinite, or the file has more than [`MOST_ENTRIES`](crate::MOST_ENTRIES) frames times joints.
    pub fn motion(&self, name: &str, metres_per_unit: f64) -> Result<(Skeleton, Clip), FileError> {
        let skeleton = self.skeleton(metres_per_unit).map_err(ClipError::from)?;
        let pose = |frame, pose: &mut Pose| self.pose(frame, metres_per_unit, pose);
        motion_of_poses(skeleton, name, 1.0 / self.frame_time, self.frames(), pose)
    }
}

/// A value that a joint has in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The joint's position along an axis (0 = X), in the file's unit. It replaces the offset.
    Position(usize),
    /// A rotation about an axis (0 = X), in degrees. Rotations are multiplied in the order of the
    /// channels.
    Rotation(usize),
    /// A scale along an axis (0 = X). Joints have no scale, so it is ignored.
    Scale(usize),
}

impl Channel {
    const NAMES: [(&'static str, Self); 9] = [
        ("Xposition", Self::Position(0)),
        ("Yposition", Self::Position(1)),
        ("Zposition", Self::Position(2)),
        ("Xrotation", Self::Rotation(0)),
        ("Yrotation", Self::Rotation(1)),
        ("Zrotation", Self::Rotation(2)),
        ("Xscale", Self::Scale(0)),
        ("Yscale", Self::Scale(1)),
        ("Zscale", Self::Scale(2)),
    ];

    /// Finds a channel by its BVH name, ignoring case.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|&(_, channel)| channel)
    }

    /// BVH name of the channel.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES
            .iter()
            .find(|&&(_, channel)| channel == self)
            .map_or("", |&(name, _)| name)
    }
}
