//! Crowds: the poses of ten thousand characters and more, each with its own clip, moment, level of
//! detail and place, computed side by side in the lanes of vector registers.
//!
//! A [`AnimationSet`] holds the clips in the form that the kernels read. A [`Crowd`] holds the
//! characters, sorts them so that sixteen of the same clip and level, near each other in time, stand
//! side by side, or else sixteen of neighbouring levels, and poses them into memory of the caller's.
//!
//! Architecture invariant: nothing here knows what else a character may be doing (graph, avoidance)
//! or what draws it.

mod animation_set;
mod character;
mod external_pose;
mod frame;
mod group;
mod instances;
mod joint_math;
mod kernel;
mod level_clips;
mod level_pass;
mod level_step;
mod output;
mod posing;
mod quantise;
mod radix_sort;
mod sampling;
mod schedule;
mod settings;
mod write;

pub use crate::lod::LevelId;
pub use animation_set::{AnimationSet, AnimationSetError};
pub use character::{Character, CharacterId, ClipId, Fade, Placement};
pub use external_pose::ExternalPose;
pub use frame::{Frame, FrameReport, Frustum, LevelView};
pub use instances::Crowd;
pub use output::{Form, Layout, Output, PoseSlice, WriteMode};
pub use settings::{CrowdError, CrowdSettings, Hold, PoseError};
