//! Skeletons, clips and poses: sampling, forward kinematics, and inverse kinematics of legs.
//!
//! 1. A [`Skeleton`] is a tree of joints, parents first. A [`Clip`] has their rotations frame by frame; it may be
//!    [compressed](Clip::compressed).
//! 2. [`Clip::sample`] writes a [`Pose`] at any time between frames. [`Clip::at`] reads single joints of a [`Moment`].
//! 3. [`forward_kinematics`] computes where the joints of a pose are.
//! 4. [`Leg::reach`] bends a leg so that its foot reaches a place; [`Warp`] bends a whole body.
//!
//! ```
//! use glam::{Quat, Vec3};
//! use sabaki_motion::anim::{Clip, ClipDesc, Joint, JointKind, Pose, Skeleton, forward_kinematics};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let hip = Joint { name: "hip".into(), parent: None, offset: Vec3::ZERO, kind: JointKind::Moving };
//! let skeleton = Skeleton::new(vec![hip])?;
//! let desc = ClipDesc {
//!     name: "turn".into(),
//!     frame_rate: 30.0,
//!     roots: vec![Vec3::Y; 2],
//!     rotations: vec![Quat::IDENTITY, Quat::from_rotation_y(0.2)],
//!     translations: Vec::new(),
//! };
//! let clip = Clip::new(&skeleton, desc)?;
//! let (mut pose, mut joints) = (Pose::default(), Vec::new());
//! clip.sample(0.5, &mut pose);
//! forward_kinematics(&skeleton, &pose, &mut joints);
//! assert_eq!(joints[0].translation, Vec3::Y);
//! # Ok(())
//! # }
//! ```

mod clip;
mod leg;
mod limbs;
mod moment;
mod packed;
mod place;
mod plain;
mod pose;
mod rig;
mod rows;
mod skeleton;
mod warp;
mod whole;

pub use clip::{Clip, ClipDesc, ClipError, ClipId, Event, EventKind};
pub use leg::{Chain, Knee, KneeLimit, Leg, free_distance};
pub use limbs::{Facing, Limbs, body_root, carried, details};
pub use moment::Moment;
pub use packed::CompressionSettings;
pub(crate) use place::{Place, place_all};
pub use pose::{JointTransform, Pose, forward_kinematics, slerp};
pub use rig::{Part, Rig, RiggedSkeleton};
pub use skeleton::{Joint, JointId, JointKind, Skeleton, SkeletonError};
pub use warp::{Bend, Envelope, Warp};
pub use whole::{FileJoints, PathCarrier, WholeSkeleton};
