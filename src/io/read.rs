use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::bvh::BvhFile;
use super::{ReadError, Scale, ScaleSource};
use crate::anim::{Clip, Skeleton};

/// Bytes. What is larger is no motion file.
pub const LARGEST_FILE: u64 = 1_000_000_000;

/// Seconds: ten hours. A longer clip comes of a wrong frame time, and would fill the memory once resampled.
pub const LONGEST_CLIP: f64 = 36_000.0;

/// How files are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Metres per unit of the files; `None`: found from the skeleton's stature.
    pub scale: Option<f64>,
}

/// A motion file, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedClip {
    /// Offsets in metres.
    pub skeleton: Skeleton,
    /// Named after the file, without its folder.
    pub clip: Clip,
    /// Of the file.
    pub scale: Scale,
}

/// Reads one BVH file as it is, in its own unit.
///
/// # Errors
/// What is wrong, with the file and the place in it.
pub fn read_bvh(path: &Path) -> Result<BvhFile, ReadError> {
    BvhFile::parse(&read_bytes(path)?).map_err(|error| ReadError::Bvh {
        path: path.to_owned(),
        error,
    })
}

/// Reads one BVH file, in metres.
///
/// # Errors
/// What is wrong, with the file and the place in it.
pub fn read_clip(path: &Path, options: &ReadOptions) -> Result<LoadedClip, ReadError> {
    check_scale(options)?;
    let file = read_bvh(path)?;
    let scale = options.scale.map_or_else(|| Scale::of(&file), given);
    to_metres(path, &file, scale)
}

pub(super) fn given(metres_per_unit: f64) -> Scale {
    Scale {
        metres_per_unit,
        found: ScaleSource::Given,
    }
}

pub(super) fn check_scale(options: &ReadOptions) -> Result<(), ReadError> {
    match options.scale {
        Some(scale) if !(scale.is_finite() && scale > 0.0) => Err(ReadError::Scale(scale)),
        _ => Ok(()),
    }
}

pub(super) fn to_metres(
    path: &Path,
    file: &BvhFile,
    scale: Scale,
) -> Result<LoadedClip, ReadError> {
    let seconds = (file.frames() - 1) as f64 * file.frame_time();
    if seconds > LONGEST_CLIP {
        return Err(ReadError::TooLong {
            path: path.to_owned(),
            seconds,
        });
    }
    let (skeleton, clip) = file
        .motion(&clip_name(path), scale.metres_per_unit)
        .map_err(|error| ReadError::Motion {
            path: path.to_owned(),
            error,
        })?;
    Ok(LoadedClip {
        skeleton,
        clip,
        scale,
    })
}

/// A clip is named after its file, without the folder.
pub(super) fn clip_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let io = |source| ReadError::Io {
        path: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(io)?;
    file.take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ReadError::TooLarge {
            path: path.to_owned(),
        });
    }
    Ok(bytes)
}
