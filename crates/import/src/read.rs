use std::path::Path;

use super::error::ReadError;
use super::loaded_clip::LoadedClip;
use super::motion_file::MotionFile;
use super::options::{ReadOptions, SCALES};

/// Reads the only motion of a file, in metres. The extension determines the format: glTF (`.glb`,
/// `.gltf`), AMC (`.amc`), otherwise BVH.
///
/// # Errors
/// The first error, with the file and the position in it. A file with several motions is an error.
pub fn read_clip(path: &Path, options: &ReadOptions) -> Result<LoadedClip, ReadError> {
    let mut motions = read_motions(path, options)?;
    match motions.pop() {
        Some(only) if motions.is_empty() => Ok(only),
        last => Err(ReadError::Several {
            path: path.to_owned(),
            clips: motions
                .into_iter()
                .chain(last)
                .map(|motion| motion.clip.name().to_owned())
                .collect(),
        }),
    }
}

/// Reads all motions of a file, in metres: one of a BVH or AMC file, one for each animation of a
/// glTF file.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_motions(path: &Path, options: &ReadOptions) -> Result<Vec<LoadedClip>, ReadError> {
    check(options)?;
    let file = MotionFile::read(path)?;
    file.to_metres(path, file.scale(options), options)
}

/// Checks that scale and frame rate are within their ranges.
pub(super) fn check(options: &ReadOptions) -> Result<(), ReadError> {
    match options.scale {
        Some(scale) if !SCALES.contains(&scale) => return Err(ReadError::Scale(scale)),
        _ => {}
    }
    match options.amc_rate {
        Some(rate) if !(1e-3..=1e6).contains(&rate) => Err(ReadError::Rate(rate)),
        _ => Ok(()),
    }
}
