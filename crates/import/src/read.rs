use sabaki::archive::LARGEST_FILE;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::bvh::BvhFile;
use super::motion_file::MotionFile;
use super::{EventEntry, ReadError, Scale, ScaleSource, Up};
use sabaki::anim::{Clip, Skeleton};

/// Seconds: ten hours. A longer clip comes of a wrong frame time, and would fill the memory once resampled.
pub const LONGEST_CLIP: f64 = 36_000.0;

/// How files are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Metres per unit of the files; `None`: of BVH files found from the skeleton's stature, of glTF files 1.
    pub scale: Option<f64>,
    /// Which way is up in the files. Default +Y.
    pub up: Up,
    /// Frames a second of AMC files, which do not say; `None`: [`AmcFile::USUAL_RATE`](super::asf::AmcFile::USUAL_RATE).
    pub amc_rate: Option<f64>,
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
    /// What the file itself says happens in it: glTF may, in its `extras`.
    pub events: Vec<EventEntry>,
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

/// Reads the only motion of a file, in metres: BVH, or glTF by its ending (`.glb`, `.gltf`), or AMC (`.amc`).
///
/// # Errors
/// What is wrong, with the file and the place in it; a file that holds several motions.
pub fn read_clip(path: &Path, options: &ReadOptions) -> Result<LoadedClip, ReadError> {
    let mut motions = read_motions(path, options)?;
    match motions.pop() {
        Some(only) if motions.is_empty() => Ok(only),
        last => Err(ReadError::Several {
            path: path.to_owned(),
            clips: { motions.into_iter().chain(last) }
                .map(|motion| motion.clip.name().to_owned())
                .collect(),
        }),
    }
}

/// Reads all motions of a file, in metres: one of a BVH file, one for each animation of a glTF file.
///
/// # Errors
/// What is wrong, with the file and the place in it.
pub fn read_motions(path: &Path, options: &ReadOptions) -> Result<Vec<LoadedClip>, ReadError> {
    check_scale(options)?;
    let file = MotionFile::read(path)?;
    file.to_metres(path, (file.scale(options), options))
}

pub(super) fn given(metres_per_unit: f64) -> Scale {
    Scale {
        metres_per_unit,
        found: ScaleSource::Given,
    }
}

pub(super) fn check_scale(options: &ReadOptions) -> Result<(), ReadError> {
    match options.scale {
        Some(scale) if !(scale.is_finite() && scale > 0.0) => return Err(ReadError::Scale(scale)),
        _ => {}
    }
    match options.amc_rate {
        Some(rate) if !(1e-3..=1e6).contains(&rate) => Err(ReadError::Rate(rate)),
        _ => Ok(()),
    }
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
