//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.

mod clip;
mod clip_id;
mod event;
pub(crate) mod facing;
pub(crate) mod ik;
mod kinematics;
pub(crate) mod knee;
pub(crate) mod leg;
pub(crate) mod limbs;
pub(crate) mod moment;
pub(crate) mod packed;
mod plain;
pub(crate) mod pose;
pub(crate) mod rig;
pub(crate) mod rows;
mod side;
mod skeleton;
pub(crate) mod warp;

pub use clip::{Clip, ClipDesc, ClipError};
pub use clip_id::ClipId;
pub use event::{Event, EventKind};
pub use kinematics::{JointTransform, forward_kinematics};
pub(crate) use leg::{Chain, Leg};
pub(crate) use moment::Moment;
pub use packed::CompressionSettings;
pub use pose::Pose;
pub(crate) use rig::{Rig, RiggedSkeleton};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
