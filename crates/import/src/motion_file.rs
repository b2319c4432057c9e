use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use glam::Quat;

use super::asf::{AmcClipDesc, AmcFile, AsfFile};
use super::bvh::{BvhFile, MotionError};
use super::file::{clip_name, read_bytes};
use super::gltf::{GltfFile, SkinnedMesh};
use super::{
    LONGEST_CLIP, LengthUnit, LoadedClip, ReadError, ReadOptions, Scale, ScaleSource, Up, stature,
};
use sabaki::anim::{Clip, Pose, Skeleton};

/// File extensions of motion files.
pub(super) const ENDINGS: [&str; 4] = ["bvh", "amc", "glb", "gltf"];

/// A parsed motion file, in its own unit.
pub(super) enum MotionFile {
    Bvh(BvhFile),
    Gltf(Box<GltfFile>),
    Amc(AsfFile, AmcFile),
}

/// Whether a path has one of the extensions, ignoring case.
pub(super) fn ends_with(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default();
    endings
        .iter()
        .any(|known| ending.eq_ignore_ascii_case(known))
}

/// Whether a path has the extension of a glTF file.
#[must_use]
pub fn is_gltf(path: &Path) -> bool {
    ends_with(path, &["glb", "gltf"])
}

/// Whether a file's name ends as those of motion files do. Of a folder, these files are read.
#[must_use]
pub fn is_motion_file(path: &Path) -> bool {
    ends_with(path, &ENDINGS)
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

/// Reads a glTF file in its own unit. External buffers are read from its folder.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_gltf(path: &Path) -> Result<GltfFile, ReadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |file: &Path| read_bytes(&folder.join(file)).map_err(|error| error.to_string());
    GltfFile::parse(&read_bytes(path)?, load).map_err(|error| ReadError::Gltf {
        path: path.to_owned(),
        error: Box::new(error),
    })
}

/// Reads the skinned mesh of a glTF file in its own unit. External files are read from its folder.
///
/// # Errors
/// The first error, with the file and the position in it.
pub fn read_mesh(path: &Path) -> Result<SkinnedMesh, ReadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |file: &Path| read_bytes(&folder.join(file)).map_err(|error| error.to_string());
    SkinnedMesh::parse(&read_bytes(path)?, load).map_err(|error| ReadError::Gltf {
        path: path.to_owned(),
        error: Box::new(error),
    })
}

pub(super) fn given(metres_per_unit: f64) -> Scale {
    Scale {
        metres_per_unit,
        found: ScaleSource::Given,
    }
}

/// Path of an AMC file's skeleton: the ASF file of the same name, of the part of the name before
/// the first `_` (`02_01.amc` has `02.asf`), or the only ASF file of the folder.
fn skeleton_of(path: &Path) -> Result<PathBuf, ReadError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let subject = stem.split('_').next().unwrap_or(&stem);
    let names: Vec<String> = match stem == subject {
        true => vec![format!("{stem}.asf")],
        false => vec![format!("{stem}.asf"), format!("{subject}.asf")],
    };
    let mut beside = names.iter().map(|name| path.with_file_name(name));
    if let Some(found) = beside.find(|file| file.is_file()) {
        return Ok(found);
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new(".")))
        .into_iter()
        .flatten();
    let files = entries.flatten().map(|entry| entry.path());
    let mut all = files.filter(|file| ends_with(file, &["asf"]) && file.is_file());
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only),
        _ => Err(ReadError::NoSkeleton {
            path: path.to_owned(),
            names,
        }),
    }
}

/// A note on a figure that is far from any person's height, as with a wrong scale.
fn doubtful_stature(skeleton: &Skeleton, clip: &Clip) -> Option<String> {
    /// Range of plausible heights, in metres: from a hand-sized creature to one as high as a house.
    const USUAL: RangeInclusive<f64> = 0.1..=20.0;
    let mut pose = Pose::default();
    clip.pose(0, &mut pose);
    let metres = stature(skeleton, &pose);
    let doubtful = metres > 0.0 && !USUAL.contains(&metres);
    doubtful.then(|| {
        format!(
            "the figure is {metres:.2} m high: say the metres per unit (--scale) if that is wrong"
        )
    })
}

impl MotionFile {
    /// Reads a file whose extension determines its format. Files with other extensions are read as
    /// BVH.
    pub(super) fn read(path: &Path) -> Result<Self, ReadError> {
        if is_gltf(path) {
            return Ok(Self::Gltf(Box::new(read_gltf(path)?)));
        }
        if ends_with(path, &["amc"]) {
            let damaged = |path: &Path, error| ReadError::Asf {
                path: path.to_owned(),
                error,
            };
            let skeleton = skeleton_of(path)?;
            let asf = AsfFile::parse(&read_bytes(&skeleton)?);
            let asf = asf.map_err(|error| damaged(&skeleton, error))?;
            let amc = AmcFile::parse(&asf, &read_bytes(path)?);
            let amc = amc.map_err(|error| damaged(path, error))?;
            return Ok(Self::Amc(asf, amc));
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
            (Self::Amc(asf, amc), None) => {
                let mut pose = Pose::default();
                amc.frame(0).pose(asf, 1.0, &mut pose);
                Scale::of_stature(asf.skeleton(1.0).map_or(0.0, |skeleton| {
                    pose.rotations.resize(skeleton.len(), Quat::IDENTITY);
                    stature(&skeleton, &pose)
                }))
            }
        }
    }

    fn repeated_names(&self) -> &[String] {
        match self {
            Self::Bvh(file) => file.repeated_names(),
            Self::Gltf(file) => file.repeated_names(),
            // Two bones of one name are an error there.
            Self::Amc(..) => &[],
        }
    }

    /// Doubtful contents of the file and of the motion that was read, one line each.
    fn notes(&self, skeleton: &Skeleton, clip: &Clip) -> Vec<String> {
        let mut notes = match self {
            Self::Bvh(file) => file.notes(),
            Self::Gltf(_) | Self::Amc(..) => Vec::new(),
        };
        notes.extend(self.repeated_names().iter().map(|name| {
            format!("several joints are called \"{name}\": the later ones are read as \"{name}_2\" and so on")
        }));
        notes.extend(doubtful_stature(skeleton, clip));
        notes
    }

    /// Skeleton, in the file's unit.
    pub(super) fn skeleton(&self) -> Option<Skeleton> {
        match self {
            Self::Bvh(file) => file.skeleton(1.0).ok(),
            Self::Gltf(file) => Some(file.skeleton().clone()),
            Self::Amc(asf, _) => asf.skeleton(1.0).ok(),
        }
    }

    /// All motions of the file, in metres. A single motion is named after the file, one of several
    /// after the file and itself: `fox.glb:Walk`.
    pub(super) fn to_metres(
        &self,
        path: &Path,
        scale: Scale,
        options: &ReadOptions,
    ) -> Result<Vec<LoadedClip>, ReadError> {
        let name = clip_name(path);
        let up = |(skeleton, clip): (Skeleton, Clip)| match options.up {
            Up::Y => Ok((skeleton, clip)),
            up => Ok(up.stood(&skeleton, &clip)?),
        };
        let loaded = |seconds: f64, motion: &dyn Fn() -> Result<(Skeleton, Clip), MotionError>| {
            if seconds > LONGEST_CLIP {
                return Err(ReadError::TooLong {
                    path: path.to_owned(),
                    seconds,
                });
            }
            let standing = motion().and_then(up);
            let (skeleton, clip) = standing.map_err(|error| ReadError::Motion {
                path: path.to_owned(),
                error,
            })?;
            Ok(LoadedClip {
                notes: self.notes(&skeleton, &clip),
                skeleton,
                clip,
                scale,
                events: Vec::new(),
                repeated_names: self.repeated_names().to_vec(),
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
                    let motion = || file.motion(animation, &name, metres);
                    let mut loaded = loaded(animation.clip.duration(), &motion)?;
                    loaded.events.clone_from(&animation.events);
                    Ok(loaded)
                };
                file.animations().iter().map(load).collect()
            }
            Self::Amc(asf, amc) => {
                let rate = options.amc_rate.unwrap_or(AmcFile::USUAL_RATE);
                let seconds = (amc.frames() - 1) as f64 / rate;
                let desc = AmcClipDesc {
                    name: &name,
                    metres_per_unit: metres,
                    frame_rate: rate,
                };
                let motion = || amc.motion(asf, &desc);
                Ok(vec![loaded(seconds, &motion)?])
            }
        }
    }
}
