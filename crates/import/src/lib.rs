//! Imports and exports files: motion capture, meshes, events, attacks and answers.

pub mod asf;
mod attacks;
mod body;
pub mod bvh;
mod clip_set;
mod events;
pub mod export;
pub mod fit;
pub mod gltf;
mod json;
mod masses;
mod mesh_scale;
mod motion_file;
mod obj;
mod read;
mod read_error;
mod recording;
mod units;
mod up;
mod warnings;

pub use attacks::{AttackEntry, AttackFile, AttacksError};
pub use body::{BodyEntry, BodyFile, BodyFileError};
pub use clip_set::{ClipSet, read_clips};
pub use events::{ClipEvents, EventEntry, EventsError, EventsFile};
pub use json::JsonError;
pub use masses::{MassFile, MassFileError};
pub use mesh_scale::{body_scale, held_scale};
pub use motion_file::{is_gltf, is_motion_file, read_gltf};
pub use obj::{ObjError, parse_obj, read_obj};
pub use read::{LONGEST_CLIP, LoadedClip, ReadOptions, SCALES, read_bvh, read_clip, read_motions};
pub use read_error::ReadError;
pub use recording::{Chosen, Question, Recording, RecordingError};
pub use units::{LengthUnit, STATURE_FACTOR, Scale, ScaleSource, USUAL_STATURE, stature};
pub use up::{Up, UpError};
pub use warnings::clip_warnings;
