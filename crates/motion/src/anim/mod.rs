//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.

mod clip;
mod clip_id;
mod event;
mod facing;
mod ik;
mod kinematics;
mod knee;
mod leg;
mod limbs;
mod moment;
mod packed;
mod plain;
mod pose;
mod rig;
mod rows;
mod side;
mod skeleton;
mod warp;

pub use clip::{Clip, ClipDesc, ClipError};
pub use clip_id::ClipId;
pub use event::{Event, EventKind};
pub use facing::Facing;
pub use ik::{LegGoal, free_distance};
pub use kinematics::{JointTransform, forward_kinematics};
pub use knee::{Knee, KneeLimit};
pub use leg::{Chain, Leg};
pub use limbs::Limbs;
pub use moment::Moment;
pub use packed::CompressionSettings;
pub use pose::{Pose, slerp};
pub use rig::{Part, Rig, RiggedSkeleton};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
pub use warp::{Bend, Envelope, Warp};
