use std::io::Read;
use std::ops::RangeInclusive;
use std::path::Path;

use super::bvh::BvhFile;
use super::motion_file::MotionFile;
use super::{EventEntry, ReadError, Scale, ScaleSource, Up};
use sabaki::anim::{Clip, Skeleton};
use sabaki::archive::{LARGEST_FILE, open_regular};

/// Maximum duration of a clip, in seconds: ten hours. Longer clips come from wrong frame times and
/// would exhaust memory.
pub const LONGEST_CLIP: f64 = 36_000.0;

/// Metres per unit that may be given: from a millionth of a millimetre to a thousand kilometres.
pub const SCALES: RangeInclusive<f64> = 1e-9..=1e6;

/// Options for reading files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Scale of the files, in metres per unit. Default `None`: BVH files are scaled by the
    /// skeleton's stature, glTF files by 1.
    pub scale: Option<f64>,
    /// Axis that points up in the files. Default +Y.
    pub up: Up,
    /// Frame rate of AMC files, which do not contain it, in frames per second. Default `None`:
    /// [`AmcFile::USUAL_RATE`](super::asf::AmcFile::USUAL_RATE).
    pub amc_rate: Option<f64>,
}

/// A motion from a file, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedClip {
    /// Skeleton, in metres.
    pub skeleton: Skeleton,
    /// Motion, named after the file without its folder.
    pub clip: Clip,
    /// Scale of the file.
    pub scale: Scale,
    /// Events in the file itself. Only glTF files can contain them, in their `extras`.
    pub events: Vec<EventEntry>,
    /// Names that several joints have in the file. The first joint keeps the name, the others have a number behind it.
    pub repeated_names: Vec<String>,
    /// What was read although it is doubtful, one line each.
    pub notes: Vec<String>,
}

/// Reads a BVH file in its own unit.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_bvh(path: &Path) -> Result<BvhFile, ReadError> {
    BvhFile::parse(&read_bytes(path)?).map_err(|error| ReadError::Bvh {
        path: path.to_owned(),
        error,
    })
}

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
            clips: { motions.into_iter().chain(last) }
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
        Some(scale) if !SCALES.contains(&scale) => return Err(ReadError::Scale(scale)),
        _ => {}
    }
    match options.amc_rate {
        Some(rate) if !(1e-3..=1e6).contains(&rate) => Err(ReadError::Rate(rate)),
        _ => Ok(()),
    }
}

/// Name of a clip: its file's name without the folder.
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
    let file = open_regular(path).map_err(io)?;
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
