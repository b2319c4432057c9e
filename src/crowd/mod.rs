//! Crowds: the poses of ten thousand characters and more, each with its own clip, moment, level of
//! detail and place, computed side by side in the lanes of vector registers.
//!
//! A [`Repertoire`] holds the clips in the form that the kernels read. A [`Crowd`] holds the
//! characters, sorts them so that sixteen of the same clip and level, near each other in time, stand
//! side by side, and poses them into memory of the caller's.
//!
//! Architecture invariant: nothing here knows what else a character may be doing (graph, avoidance)
//! or what draws it.

mod bank;
mod character;
mod form;
mod group;
mod instances;
mod kernel;
mod output;
mod quantise;
mod repertoire;
mod sample;
mod schedule;

pub use character::{Character, CharacterId, ClipId, Fade, LevelId, Placement};
pub use instances::{Crowd, CrowdError, CrowdSettings, PoseError};
pub use output::{Form, Layout, Memory, Output, Region};
pub use repertoire::{Repertoire, RepertoireError};
