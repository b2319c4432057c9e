//! Imports and exports files: motion capture, meshes, events, attacks and answers.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]

pub mod annotate;
pub mod asf;
mod attacks;
mod body;
pub mod bvh;
mod clip_set;
mod error;
mod events;
pub mod export;
mod file;
pub mod fit;
pub mod gltf;
mod json;
mod loaded_clip;
mod masses;
mod mesh_scale;
mod mirror;
mod motion_file;
mod obj;
mod options;
mod read;
mod recording;
mod retarget;
mod units;
mod up;
mod warnings;

pub use attacks::{AttackEntry, AttackFile};
pub use body::{BodyEntry, BodyFile};
pub use clip_set::{ClipSet, motion_files, read_clips};
pub use error::{
    AttacksError, BodyFileError, EventsError, MassFileError, ObjError, ReadError, RecordingError,
};
pub use events::{ClipEvents, EventEntry, EventsFile};
pub use file::without_mark;
pub use json::JsonError;
pub use loaded_clip::LoadedClip;
pub use masses::MassFile;
pub use mesh_scale::{body_scale, held_scale};
pub use mirror::MirrorError;
pub use motion_file::{is_gltf, is_motion_file, read_bvh, read_gltf, read_mesh};
pub use obj::{parse_obj, read_obj};
pub use options::{LONGEST_CLIP, MOST_ENTRIES, ReadOptions, SCALES};
pub use read::{read_clip, read_motions};
pub use recording::{Chosen, RecordedRequest, Recording};
pub use units::{LengthUnit, STATURE_FACTOR, Scale, ScaleSource, USUAL_STATURE, stature};
pub use up::{Up, UpError};
pub use warnings::clip_warnings;
