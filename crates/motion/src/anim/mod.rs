//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.

mod clip;
mod leg;
mod limbs;
mod moment;
mod packed;
mod plain;
mod pose;
mod rig;
mod rows;
mod skeleton;
mod warp;

pub use clip::{Clip, ClipDesc, ClipError, ClipId, Event, EventKind};
pub use leg::{Chain, Knee, KneeLimit, Leg, LegGoal, free_distance};
pub use limbs::{Facing, Limbs};
pub use moment::Moment;
pub use packed::CompressionSettings;
pub use pose::{JointTransform, Pose, forward_kinematics, slerp};
pub use rig::{Part, Rig, RiggedSkeleton};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
pub use warp::{Bend, Envelope, Warp};
