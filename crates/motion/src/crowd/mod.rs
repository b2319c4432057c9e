//! Crowds: poses of ten thousand characters and more, each with its own clip, time, level of detail and place, computed side by
//! side in the lanes of vector registers.
//!
//! 1. [`AnimationSet::new`] stores the clips on all levels in the form that the kernel reads. It is called once.
//! 2. [`Crowd::with_capacity`] reserves memory; [`Crowd::add`] adds a character. [`Crowd::set`], [`Crowd::place`] and
//!    [`Crowd::deactivate`] change it at any time.
//! 3. [`Crowd::frame`] does a whole frame: time, levels and poses, into memory that the caller owns, such as a buffer
//!    mapped from a device. [`Crowd::pose`] does the poses alone.
//! 4. [`Crowd::pose_slice`] then says where a character's pose is.
//!
//! ```text
//! clips, levels ─▶ keys: 16-bit tracks          once
//! characters ─▶ sort: groups of sixteen         when the groups have become slow
//!            ─▶ levels: by distance             every frame
//!            ─▶ kernel: poses in the lanes      every frame
//! ```
//!
//! A group is sixteen characters that play nearby frames of one clip on one level, which are sampled together from one load of the
//! keys, or else characters of neighbouring levels, which are read one by one.
//!
//! ```
//! use std::sync::Arc;
//! use sabaki_motion::anim::{Clip, Skeleton};
//! use sabaki_motion::crowd::{AnimationSet, Character, Crowd, CrowdSettings, Frame};
//! use sabaki_motion::lod::{LevelSettings, Levels, SwitchSettings, Switching};
//! use sabaki_motion::math::F32x16;
//!
//! fn march(skeleton: &Skeleton, clips: &[Clip]) -> Result<(), Box<dyn std::error::Error>> {
//!     let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
//!     let switching = Switching::new(&levels, &SwitchSettings::default())?;
//!     let animations = Arc::new(AnimationSet::new(skeleton, clips, &levels.levels)?);
//!     let mut crowd = Crowd::with_capacity(animations, CrowdSettings::default(), 1000);
//!     let id = crowd.add(&Character { time: 0.7, ..Character::default() })?;
//!     // As long as there are no more than 1000 characters, this is enough.
//!     let mut out = vec![F32x16::ZERO; crowd.max_output_len(1000)];
//!     // Every frame:
//!     let eye = glam::Vec3::new(0.0, 1.7, 25.0);
//!     let frame = Frame { seconds: 1.0 / 60.0, switching: Some(&switching), eye };
//!     crowd.frame(&frame, &mut out)?;
//!     // The first joint's X coordinate. Joints stand in the order of `AnimationSet::joint_ids`.
//!     let x = crowd.pose_slice(id)?.number(&out, 0, 3);
//!     println!("{x} m");
//!     Ok(())
//! }
//! ```
//!
//! Architecture invariant: nothing here knows what else a character may be doing (graph, avoidance) or what draws it.

mod character;
mod error;
mod external_pose;
mod frame;
mod frame_input;
mod instances;
mod kernel;
mod keys;
mod levels;
mod output;
mod sort;

pub use crate::anim::ClipId;
pub use crate::lod::LevelId;
pub use character::{Character, ClipMix, MemberId, Placement};
pub use error::CrowdError;
pub use external_pose::ExternalPose;
pub use frame_input::{Frame, FrameReport};
pub use instances::{Crowd, CrowdSettings};
pub use keys::animation_set::AnimationSet;
pub use output::{Layout, Output, PoseSlice, WriteMode};
