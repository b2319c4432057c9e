//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.

mod clip;
mod event;
mod facing;
mod ik;
mod kinematics;
mod leg;
mod limbs;
mod pose;
mod rig;
mod rows;
mod side;
mod skeleton;
mod warp;

pub(crate) use clip::Moment;
pub use clip::{Clip, ClipDesc, ClipError};
pub use event::{Event, EventKind};
pub use facing::Facing;
pub(crate) use ik::{free_distance, reach};
pub use kinematics::{JointTransform, forward_kinematics};
pub(crate) use leg::Chain;
pub use leg::Leg;
pub use limbs::Limbs;
pub use pose::Pose;
pub(crate) use pose::slerp;
pub(crate) use rig::Rig;
pub(crate) use rows::{Block, LANES, Slerp, unpack};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
pub use warp::{Bend, Envelope, Warp};
