use std::path::Path;

use super::bvh::{BvhFile, MotionError};
use super::gltf::GltfFile;
use super::read::{clip_name, given, read_bvh, read_bytes};
use super::{LONGEST_CLIP, LengthUnit, LoadedClip, ReadError, ReadOptions, Scale, ScaleSource};
use crate::anim::{Clip, Skeleton};

/// What the names of motion files end with.
pub(super) const ENDINGS: [&str; 3] = ["bvh", "glb", "gltf"];

/// A motion file as it is, in its own unit.
pub(super) enum MotionFile {
    Bvh(BvhFile),
    Gltf(Box<GltfFile>),
}

/// Whether a name ends so, in small letters or capitals.
pub(super) fn ends_with(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default();
    endings
        .iter()
        .any(|known| ending.eq_ignore_ascii_case(known))
}

/// Whether a file's name says that it is glTF.
#[must_use]
pub fn is_gltf(path: &Path) -> bool {
    ends_with(path, &ENDINGS[1..])
}

/// Reads one glTF file as it is, in its own unit; buffers of their own are looked for in its folder.
///
/// # Errors
/// What is wrong, with the file and the place in it.
pub fn read_gltf(path: &Path) -> Result<GltfFile, ReadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |file: &Path| read_bytes(&folder.join(file)).map_err(|error| error.to_string());
    GltfFile::parse(&read_bytes(path)?, load).map_err(|error| ReadError::Gltf {
        path: path.to_owned(),
        error: Box::new(error),
    })
}

impl MotionFile {
    /// A file's ending says what it is; what has none of them is taken for BVH.
    pub(super) fn read(path: &Path) -> Result<Self, ReadError> {
        if is_gltf(path) {
            return Ok(Self::Gltf(Box::new(read_gltf(path)?)));
        }
        Ok(Self::Bvh(read_bvh(path)?))
    }

    pub(super) fn scale(&self, options: &ReadOptions) -> Scale {
        match (self, options.scale) {
            (_, Some(scale)) => given(scale),
            (Self::Bvh(file), None) => Scale::of(file),
            (Self::Gltf(_), None) => Scale {
                metres_per_unit: LengthUnit::Metre.metres(),
                found: ScaleSource::Format,
            },
        }
    }

    /// In the file's own unit.
    pub(super) fn skeleton(&self) -> Option<Skeleton> {
        match self {
            Self::Bvh(file) => file.skeleton(1.0).ok(),
            Self::Gltf(file) => Some(file.skeleton().clone()),
        }
    }

    /// All motions of the file in metres. A lone one is named after the file, one of several after the file and itself:
    /// `fox.glb:Walk`.
    pub(super) fn to_metres(
        &self,
        path: &Path,
        scale: Scale,
    ) -> Result<Vec<LoadedClip>, ReadError> {
        let name = clip_name(path);
        let loaded = |seconds: f64, motion: &dyn Fn() -> Result<(Skeleton, Clip), MotionError>| {
            if seconds > LONGEST_CLIP {
                return Err(ReadError::TooLong {
                    path: path.to_owned(),
                    seconds,
                });
            }
            let (skeleton, clip) = motion().map_err(|error| ReadError::Motion {
                path: path.to_owned(),
                error,
            })?;
            Ok(LoadedClip {
                skeleton,
                clip,
                scale,
            })
        };
        let metres = scale.metres_per_unit;
        match self {
            Self::Bvh(file) => {
                let seconds = (file.frames() - 1) as f64 * file.frame_time();
                Ok(vec![loaded(seconds, &|| file.motion(&name, metres))?])
            }
            Self::Gltf(file) => {
                let load = |animation: &super::gltf::GltfAnimation| {
                    let name = match file.animations() {
                        [_] => name.clone(),
                        _ => format!("{name}:{}", animation.name),
                    };
                    let motion = || file.motion(animation, (&name, metres));
                    loaded(animation.clip.duration(), &motion)
                };
                file.animations().iter().map(load).collect()
            }
        }
    }
}
