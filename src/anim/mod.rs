//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.

#[cfg(test)]
pub(crate) mod bodies;
mod clip;
mod clip_id;
mod event;
pub(crate) mod facing;
mod ik;
mod kinematics;
mod knee;
pub(crate) mod leg;
pub(crate) mod limbs;
mod moment;
mod packed;
mod plain;
mod pose;
mod rig;
mod rows;
mod side;
mod skeleton;
pub(crate) mod warp;

pub use clip::{Clip, ClipDesc, ClipError};
pub use clip_id::ClipId;
pub use event::{Event, EventKind};
pub(crate) use facing::Facing;
pub(crate) use ik::{LegGoal, free_distance};
pub use kinematics::{JointTransform, forward_kinematics};
pub(crate) use knee::{Knee, KneeLimit};
pub(crate) use leg::Chain;
pub(crate) use leg::Leg;
pub(crate) use limbs::Limbs;
pub(crate) use moment::Moment;
pub use packed::CompressionSettings;
pub(crate) use packed::{PackedMoment, scatter};
pub use pose::Pose;
pub(crate) use pose::slerp;
pub(crate) use rig::{Rig, RiggedSkeleton};
pub(crate) use rows::{LANES, Rows, Slerp, unpack};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
pub(crate) use warp::{Bend, Envelope, Warp};
