//! Files: motion capture in and out, events, attacks.

mod attacks;
pub mod bvh;
mod clip_set;
mod events;
mod json;
mod read;
mod read_error;
mod units;

pub use attacks::{AttackEntry, AttackFile, AttacksError};
pub use clip_set::{ClipSet, read_clips};
pub use events::{ClipEvents, EventEntry, EventsError, EventsFile, KindName};
pub use json::JsonError;
pub use read::{LARGEST_FILE, LONGEST_CLIP, LoadedClip, ReadOptions, read_bvh, read_clip};
pub use read_error::ReadError;
pub use units::{LengthUnit, STATURE_FACTOR, Scale, ScaleSource, USUAL_STATURE, stature};
