//! Skeleton, clip, pose, sampling and forward kinematics.

mod clip;
mod event;
mod facing;
mod kinematics;
mod limbs;
mod pose;
mod side;
mod skeleton;

pub use clip::{Clip, ClipDesc, ClipError};
pub use event::{Event, EventKind};
pub use facing::Facing;
pub use kinematics::{JointTransform, forward_kinematics};
pub use limbs::Limbs;
pub use pose::Pose;
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
