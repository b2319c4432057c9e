//! Crowds: the poses of ten thousand characters and more, each with its own clip, moment, level of
//! detail and place, computed side by side in the lanes of vector registers.
//!
//! A [`Repertoire`] holds the clips in the form that the kernels read. A [`Crowd`] holds the
//! characters, sorts them so that sixteen of the same clip and level, near each other in time, stand
//! side by side, or else sixteen of neighbouring levels, and poses them into memory of the caller's.
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
mod radix;
mod repertoire;
mod sample;
mod schedule;
mod settings;
mod single;
mod step;
mod write;

pub use character::{Character, CharacterId, ClipId, Fade, LevelId, Placement};
pub use instances::Crowd;
pub use output::{Form, Layout, Memory, Output, Region};
pub use repertoire::{Repertoire, RepertoireError};
pub use settings::{CrowdError, CrowdSettings, Hold, PoseError};
pub use single::Single;
