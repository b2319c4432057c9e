//! The manifest of a bake that is divided into shards: `plan.json`.

use std::io::Read;
use std::path::{Path, PathBuf};

use sabaki::archive::open_regular;
use sabaki::internal::{GraphBuilder, SearchSettings};
use serde::{Deserialize, Serialize};

use super::super::{Failure, source};
use super::sealed;

/// Largest number of shards.
pub(super) const MOST_SHARDS: usize = 100_000;

/// Version of the manifest and of the files beside it.
const FORMAT: u32 = 1;

/// The input that all shards and the join must share.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub(super) format: u32,
    /// Version of the program that made the plan.
    pub(super) sabaki: String,
    /// Folder in which the plan was made: relative paths of the arguments start there.
    pub(super) folder: PathBuf,
    /// Arguments of the command that made the plan. The join reads the clips by them.
    pub(super) arguments: Vec<String>,
    pub(super) inputs: Vec<InputFile>,
    pub(super) search: SearchSettings,
    pub(super) clips: Vec<PlannedClip>,
    /// Number of shards.
    pub(super) shards: usize,
}

/// The input of a plan.
#[derive(Clone, Copy)]
pub(super) struct PlanInput<'a> {
    pub(super) clips: &'a source::ClipArgs,
    /// Number of shards that are wanted.
    pub(super) shards: usize,
}

/// A file that was read for the plan.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct InputFile {
    pub(super) path: PathBuf,
    pub(super) bytes: u64,
    pub(super) crc32: u32,
}

/// A clip whose points are stored beside the manifest.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlannedClip {
    /// Number of frames at the graph's frame rate.
    pub(super) frames: usize,
    /// Checksum of the points.
    pub(super) crc32: u32,
}

impl Manifest {
    /// Largest number of frames of all clips: 25 days at 120 frames a second.
    const MOST_FRAMES: usize = 1 << 28;
    /// Largest number of bands of the distance maps, which are kept in memory.
    const MOST_BANDS: usize = 1 << 26;

    pub(super) fn new(input: PlanInput<'_>, builder: &GraphBuilder<'_>) -> Result<Self, Failure> {
        let PlanInput { clips, shards } = input;
        let arguments = std::env::args_os()
            .skip(1)
            .map(|word| word.into_string())
            .collect::<Result<_, _>>()
            .map_err(|word| Failure::Usage(format!("{}: not UTF-8", word.display())))?;
        let folder = std::env::current_dir().map_err(|source| Failure::Open {
            path: PathBuf::from("."),
            source,
        })?;
        let planned = builder.clouds().iter().map(|cloud| {
            Ok(PlannedClip {
                frames: cloud.frames(),
                crc32: crc32fast::hash(&sealed::encode(cloud)?),
            })
        });
        let search = builder.search();
        let manifest = Self {
            format: FORMAT,
            sabaki: env!("CARGO_PKG_VERSION").to_owned(),
            folder,
            arguments,
            inputs: InputFile::read_all(clips)?,
            search,
            clips: planned.collect::<Result<_, Failure>>()?,
            shards,
        };
        match manifest.is_too_large() {
            None => Ok(manifest),
            Some(why) => Err(Failure::Usage(format!("the plan would have {why}"))),
        }
    }

    /// Reads a manifest from the bytes of its file.
    pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Self, Failure> {
        let wrong = |why: String| Failure::Usage(format!("{}: {why}", path.display()));
        let document: serde_json::Value =
            serde_json::from_slice(bytes).map_err(|error| wrong(error.to_string()))?;
        if document["format"] != FORMAT || document["sabaki"] != env!("CARGO_PKG_VERSION") {
            return Err(wrong(format!(
                "sabaki {} made this plan, and this is sabaki {}; run bake plan again",
                document["sabaki"]
                    .as_str()
                    .unwrap_or("of an unknown version"),
                env!("CARGO_PKG_VERSION"),
            )));
        }
        let manifest: Self =
            serde_json::from_value(document).map_err(|error| wrong(error.to_string()))?;
        if manifest.shards == 0 || manifest.search.window == 0 {
            return Err(wrong("no window or no shard".to_owned()));
        }
        match manifest.is_too_large() {
            None => Ok(manifest),
            Some(why) => Err(wrong(why)),
        }
    }

    /// What of the plan is more than a plan can have; `None` if all of it can be.
    fn is_too_large(&self) -> Option<String> {
        let mut clips = self.clips.iter();
        let frames = clips.try_fold(0usize, |sum, clip| sum.checked_add(clip.frames));
        let frames = frames.unwrap_or(usize::MAX);
        let bands = match frames <= Self::MOST_FRAMES {
            true => self
                .search
                .count_bands(self.clips.iter().map(|clip| clip.frames)),
            false => 0,
        };
        let counts = [
            ("shards", self.shards, MOST_SHARDS),
            ("frames", frames, Self::MOST_FRAMES),
            ("frames of a window", self.search.window, Self::MOST_FRAMES),
            (
                "frames of separation",
                self.search.separation,
                Self::MOST_FRAMES,
            ),
            ("bands", bands, Self::MOST_BANDS),
        ];
        let (what, count, most) = counts.into_iter().find(|(_, count, most)| count > most)?;
        Some(format!("{count} {what}; {most} are the most"))
    }

    /// The contents of `plan.json`.
    ///
    /// # Errors
    /// A path that is not UTF-8, which JSON cannot hold.
    pub(super) fn to_json(&self) -> Result<serde_json::Value, Failure> {
        let mut paths = self
            .inputs
            .iter()
            .map(|input| &input.path)
            .chain([&self.folder]);
        serde_json::to_value(self).map_err(|error| {
            let path = paths.find(|path| path.to_str().is_none());
            Failure::Usage(match path {
                Some(path) => format!(
                    "{}: this name is not UTF-8, and plan.json cannot hold it",
                    path.display()
                ),
                None => error.to_string(),
            })
        })
    }

    /// Checks that no input has changed since the plan was made.
    pub(super) fn check_inputs(&self) -> Result<(), Failure> {
        for input in &self.inputs {
            if InputFile::read(&input.path)? != *input {
                return Err(Failure::Usage(format!(
                    "{}: changed since the plan was made; run bake plan again",
                    input.path.display()
                )));
            }
        }
        Ok(())
    }
}

impl InputFile {
    /// Reads all files of a plan but those that cannot be read, if these are left out.
    fn read_all(clips: &source::ClipArgs) -> Result<Vec<Self>, Failure> {
        let files = clips.input_files()?;
        let read = files.iter().map(|file| Self::read(file));
        read.filter(|file| !clips.keep_going || file.is_ok())
            .collect()
    }

    fn read(path: &Path) -> Result<Self, Failure> {
        let wrong = |source| Failure::Open {
            path: path.to_owned(),
            source,
        };
        let mut file = open_regular(path).map_err(wrong)?;
        let (mut hasher, mut bytes) = (crc32fast::Hasher::new(), 0);
        let mut part = vec![0; 1 << 20];
        loop {
            match file.read(&mut part).map_err(wrong)? {
                0 => break,
                count => {
                    hasher.update(&part[..count]);
                    bytes += count as u64;
                }
            }
        }
        Ok(Self {
            path: std::path::absolute(path).map_err(wrong)?,
            bytes,
            crc32: hasher.finalize(),
        })
    }
}
