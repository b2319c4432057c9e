use std::str::FromStr;

use glam::{Quat, Vec3};
use thiserror::Error;

use sabaki::anim::{Clip, ClipDesc, ClipError, Joint, Skeleton};

/// Axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +X.
    X,
    /// +Y, as in sabaki.
    #[default]
    Y,
    /// +Z.
    Z,
}

/// A word is not the name of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Error)]
#[error("up is x, y or z")]
pub struct UpError;

impl FromStr for Up {
    type Err = UpError;
    fn from_str(word: &str) -> Result<Self, UpError> {
        match word.to_ascii_lowercase().as_str() {
            "x" => Ok(Self::X),
            "y" => Ok(Self::Y),
            "z" => Ok(Self::Z),
            _ => Err(UpError),
        }
    }
}

impl Up {
    /// Rotation from the file's axes to +Y up.
    fn turn(self) -> Quat {
        match self {
            Self::X => Quat::from_rotation_arc(Vec3::X, Vec3::Y),
            Self::Y => Quat::IDENTITY,
            Self::Z => Quat::from_rotation_arc(Vec3::Z, Vec3::Y),
        }
    }

    /// Skeleton and motion with +Y up. The axes of every joint are changed, so that the rest pose
    /// is upright too.
    pub(super) fn stood(
        self,
        skeleton: &Skeleton,
        clip: &Clip,
    ) -> Result<(Skeleton, Clip), ClipError> {
        let turn = self.turn();
        let mut joints: Vec<Joint> = skeleton.clone().into();
        joints
            .iter_mut()
            .for_each(|joint| joint.offset = turn * joint.offset);
        let skeleton = Skeleton::new(joints)?;
        let ClipDesc {
            name,
            frame_rate,
            roots,
            rotations,
            translations,
        } = &clip.desc();
        let places = |places: &[Vec3]| places.iter().map(|&place| turn * place).collect();
        let rotations = rotations
            .iter()
            .map(|&q| (turn * q * turn.conjugate()).normalize());
        let desc = ClipDesc {
            name: name.clone(),
            frame_rate: *frame_rate,
            roots: places(roots),
            rotations: rotations.collect(),
            translations: places(translations),
        };
        let clip = Clip::new(&skeleton, desc)?;
        Ok((skeleton, clip))
    }
}
