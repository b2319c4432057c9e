//! Motions whose files have values of the joints' channels, frame by frame: BVH, and ASF with AMC.

use glam::{DQuat, DVec3};
use sabaki::anim::{
    Clip, ClipDesc, ClipError, Joint, JointId, JointKind, Pose, Skeleton, SkeletonError,
};

use crate::figure::clip_of;
use crate::{FileError, MOST_ENTRIES};

/// The contents of a file, with lengths and angles in the file's units.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelFile {
    /// Joints: the root first, parents before children.
    pub joints: Vec<ChannelJoint>,
    /// The names that several joints have in the file; all but the first of each were renamed.
    pub repeated_names: Vec<String>,
    /// Frames per second.
    pub frame_rate: f64,
    /// Doubtful contents of the file, one line each.
    pub notes: Vec<String>,
    /// Whether angles are in degrees, or else in radians.
    pub(crate) degrees: bool,
    /// Number of values in a frame.
    pub(crate) channels: usize,
    /// Values, frame by frame and joint by joint.
    pub(crate) values: Vec<f64>,
}

/// One joint of a [`ChannelFile`].
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelJoint {
    /// Name, unique in the file. Of BVH files, repeated names get a number (`_2`). The name of an end site is its
    /// parent's name with `_End`.
    pub name: String,
    /// Index of the parent, or `None` for the root.
    pub parent: Option<usize>,
    /// Position in the parent's frame, in the file's unit.
    pub offset: DVec3,
    /// Kind of the joint: moving or end site.
    pub kind: JointKind,
    /// Channels, in the order of the file.
    pub channels: Vec<Channel>,
    /// Rotation of the axes of a bone of an ASF file, about which its channels rotate and along which they move it, from its offset. Its
    /// rotations are applied in the order of the channels. `None` in BVH files: positions replace the offset, and rotations are multiplied in
    /// the order of the channels.
    pub axes: Option<DQuat>,
}

/// A value that a joint has in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The joint's position along an axis (0 = X), in the file's unit.
    Position(usize),
    /// A rotation about an axis (0 = X).
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
        let mut names = Self::NAMES.iter();
        let found = names.find(|(known, _)| known.eq_ignore_ascii_case(name));
        found.map(|&(_, channel)| channel)
    }

    /// BVH name of the channel.
    #[must_use]
    pub fn name(self) -> &'static str {
        let mut names = Self::NAMES.iter();
        let found = names.find(|&&(_, channel)| channel == self);
        found.map_or("", |&(name, _)| name)
    }
}

impl ChannelFile {
    /// Number of frames in the file, at least 1.
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// The skeleton in metres. A scale of 1 keeps the file's unit.
    ///
    /// # Errors
    /// The scale makes an offset infinite.
    pub fn skeleton(&self, metres_per_unit: f64) -> Result<Skeleton, SkeletonError> {
        skeleton_of(&self.joints, metres_per_unit)
    }

    /// Writes one frame to `out` as a pose in metres, with the positions of all joints.
    pub fn pose(&self, frame: usize, metres_per_unit: f64, out: &mut Pose) {
        out.rotations.clear();
        out.translations.clear();
        let mut values = self.values[frame * self.channels..][..self.channels].iter();
        for joint in &self.joints {
            let mut rotation = DQuat::IDENTITY;
            let mut place = joint.axes.map_or(joint.offset, |_| DVec3::ZERO);
            for (&channel, &value) in joint.channels.iter().zip(&mut values) {
                match channel {
                    Channel::Position(axis) => place[axis] = value,
                    Channel::Rotation(axis) => {
                        let angle = match self.degrees {
                            true => value.to_radians(),
                            false => value,
                        };
                        let turn = DQuat::from_axis_angle(DVec3::AXES[axis], angle);
                        rotation = match joint.axes {
                            Some(_) => turn * rotation,
                            None => rotation * turn,
                        };
                    }
                    Channel::Scale(_) => {}
                }
            }
            if let Some(axes) = joint.axes {
                rotation = axes * rotation * axes.conjugate();
                // The root's place is not along its axes.
                let moved = joint.parent.map_or(place, |_| axes * place);
                place = joint.offset + moved;
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
    /// The scale makes a length infinite, or the file has more than [`MOST_ENTRIES`] frames times joints.
    pub fn motion(&self, name: &str, metres_per_unit: f64) -> Result<(Skeleton, Clip), FileError> {
        let (frames, joints) = (self.frames(), self.joints.len());
        if (frames as u64).saturating_mul(joints as u64) > MOST_ENTRIES {
            return Err(FileError::TooManyEntries { frames, joints });
        }
        let skeleton = self.skeleton(metres_per_unit).map_err(ClipError::from)?;
        let pose = |frame, pose: &mut Pose| self.pose(frame, metres_per_unit, pose);
        let desc = ClipDesc::of_poses(name, self.frame_rate, frames, pose);
        let clip = clip_of(&skeleton, desc)?;
        Ok((skeleton, clip))
    }
}

pub(crate) fn skeleton_of(
    joints: &[ChannelJoint],
    metres_per_unit: f64,
) -> Result<Skeleton, SkeletonError> {
    let joints = joints.iter().map(|joint| Joint {
        name: joint.name.clone(),
        parent: joint.parent.map(|parent| JointId(parent as u16)),
        offset: (joint.offset * metres_per_unit).as_vec3(),
        kind: joint.kind,
    });
    Skeleton::new(joints.collect())
}
