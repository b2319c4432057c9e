//! Imports and exports files: motion capture, meshes, events, attacks and answers.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]

pub mod annotate;
pub mod asf;
mod attacks;
mod body;
pub mod bvh;
mod channels;
mod clip_set;
mod error;
mod events;
pub mod export;
#[cfg(feature = "fbx")]
mod fbx;
mod figure;
mod file;
pub mod fit;
pub mod gltf;
mod mirror;
mod motion_file;
mod obj;
mod recording;
mod retarget;
mod rotation;
mod units;

pub use attacks::AttackFile;
pub use body::{BodyEntry, BodyFile, MassFile};
pub use channels::{Channel, ChannelFile, ChannelJoint};
pub use clip_set::{ClipSet, motion_files, read_clips};
pub use error::{FileError, ReadError};
pub use events::{ClipEvents, EventEntry, EventsFile};
pub use file::{TextError, without_mark};
pub use mirror::MirrorError;
pub use motion_file::{
    LONGEST_CLIP, LoadedClip, MOST_ENTRIES, MeshFile, ReadOptions, SCALES, Up, clip_warnings,
    is_gltf, is_motion_file, read_bvh, read_clip, read_gltf, read_mesh, read_motions,
};
pub use obj::{parse_obj, read_obj};
pub use recording::{Chosen, RecordedRequest, Recording, RecordingError};
pub use units::{
    LengthUnit, STATURE_FACTOR, Scale, ScaleSource, USUAL_STATURE, body_scale, held_scale, stature,
};
