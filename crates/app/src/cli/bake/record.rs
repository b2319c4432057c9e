//! What a bake leaves for later ones, beside the baked file: its record, with `.record` after the name, which `bake --onto` reads, and, if
//! it was stopped, what it had done, with `.unfinished` after the name.

use std::cell::Cell;
use std::path::{Path, PathBuf};

use super::super::{Failure, output};
use super::recorded::{BakeRecord, UnfinishedBake};
use super::sealed::{self, Kind, Seal, Unusable};
use sabaki::internal::ClipMatch;

/// Version of the format of records. It changes with their contents.
const VERSION: u32 = 6;

/// Seal of records.
const SEAL: Seal = Seal {
    kind: Kind::Record,
    plan: VERSION,
};

/// Seal of unfinished bakes.
const UNFINISHED: Seal = Seal {
    kind: Kind::Unfinished,
    plan: VERSION,
};

impl BakeRecord {
    /// Path of the record of a baked file.
    pub(crate) fn path(baked: &Path) -> PathBuf {
        with_ending(baked, ".record")
    }

    /// Reads the record of a baked file. Where there is none that can be used, it returns the reason, too.
    pub(crate) fn read(baked: &Path) -> (Self, Option<String>) {
        let path = Self::path(baked);
        match sealed::read(&path, SEAL) {
            Ok((record, _)) => (record, None),
            Err(why) => (Self::default(), Some(anew(&path, &why))),
        }
    }

    /// Writes the record of a baked file, and returns its path and size in bytes.
    pub(crate) fn write(&self, baked: &Path) -> Result<(PathBuf, usize), Failure> {
        let (path, bytes) = (Self::path(baked), sealed::encode(self)?);
        sealed::write(&path, SEAL, &bytes)?;
        Ok((path, bytes.len()))
    }
}

/// The results that a bake takes over from an unfinished one.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum TakenOver {
    /// None: the unfinished bake is of other clips or settings.
    Nothing,
    /// The results of some clips: one of the two has clips that the other lacks.
    SomeClips,
    /// The results of all clips, which are the same.
    AllClips,
}

impl TakenOver {
    /// The results that a bake takes over, from the clips that it has in common with the unfinished one.
    pub(crate) fn of(clips: Option<&ClipMatch>) -> Self {
        match clips {
            Some(clips) if clips.count() > 0 && clips.is_whole() => Self::AllClips,
            Some(clips) if clips.count() > 0 => Self::SomeClips,
            _ => Self::Nothing,
        }
    }
}

/// The file of an unfinished bake, beside the file that it was to write: the same command goes on from it.
pub(crate) struct UnfinishedFile {
    path: PathBuf,
    /// Progress of the unfinished bake whose file exists, if it is of the same clips and settings.
    reached: Cell<Option<(u8, u64)>>,
}

impl UnfinishedFile {
    /// Reads what an earlier run left. The first value is `None` where there is nothing that can be read, which is said.
    pub(crate) fn open(baked: &Path) -> (Option<BakeRecord>, Self) {
        let path = with_ending(baked, ".unfinished");
        let found = sealed::read::<UnfinishedBake>(&path, UNFINISHED);
        let (record, reached) = match found {
            Ok((UnfinishedBake { record, reached }, _)) => (Some(record), Some(reached)),
            // Where nothing can be written, nothing is said of it here.
            Err(_) if !path.exists() => (None, None),
            Err(why) => {
                output::notice(&anew(&path, &why));
                (None, None)
            }
        };
        let reached = Cell::new(reached);
        (record, Self { path, reached })
    }

    /// Says whether the bake goes on from what an earlier run left.
    pub(crate) fn tell(&self, taken_over: TakenOver) {
        if self.reached.get().is_none() {
            return;
        }
        let path = self.path.display();
        if taken_over != TakenOver::AllClips {
            self.reached.set(None);
        }
        output::notice(&match taken_over {
            TakenOver::Nothing => format!("{path} is of other clips or settings; it is not used"),
            TakenOver::SomeClips | TakenOver::AllClips => format!("goes on from {path}"),
        });
    }

    /// Writes the results of a stopped bake, unless it continued an unfinished bake of the same clips and has not advanced.
    /// Returns the error of the command.
    pub(crate) fn keep(&self, bake: &UnfinishedBake) -> Failure {
        let reached = self.reached.get();
        let is_new = reached.is_none_or(|reached| reached <= bake.reached);
        let written = match is_new {
            true => sealed::encode(bake).and_then(|it| sealed::write(&self.path, UNFINISHED, &it)),
            false => Ok(()),
        };
        match written {
            Ok(()) => Failure::Unfinished(self.path.clone()),
            Err(failure) => failure,
        }
    }

    /// Keeps the whole of a bake whose file could not be written. Returns the error of the command.
    pub(crate) fn keep_whole(&self, record: BakeRecord, failure: Failure) -> Failure {
        let bake = UnfinishedBake {
            record,
            reached: (u8::MAX, u64::MAX),
        };
        match self.keep(&bake) {
            Failure::Unfinished(kept) => Failure::Unwritten {
                failure: Box::new(failure),
                kept,
            },
            // The disk may be full: the first error is the one to tell.
            _ => failure,
        }
    }

    /// Removes the file after the bake is finished.
    pub(crate) fn remove(&self) {
        // Mostly there is none.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The path with an ending after its name.
fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut path = path.as_os_str().to_owned();
    path.push(ending);
    path.into()
}

fn anew(path: &Path, why: &Unusable) -> String {
    format!("{}: {why}; all is computed anew", path.display())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_was_done_is_kept_unless_more_of_the_same_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let baked = folder.path().join("out.sabaki");
        let cases = [
            ((3, 7), TakenOver::Nothing, (3, 7)),
            // It stopped before it had come as far.
            ((2, 9), TakenOver::AllClips, (3, 7)),
            ((3, 8), TakenOver::AllClips, (3, 8)),
            ((4, 0), TakenOver::AllClips, (4, 0)),
            // How far a bake of other clips came says nothing of these.
            ((3, 9), TakenOver::SomeClips, (3, 9)),
            ((2, 1), TakenOver::SomeClips, (2, 1)),
            // What was there is of other clips or settings.
            ((1, 2), TakenOver::Nothing, (1, 2)),
        ];
        for (reached, taken_over, kept) in cases {
            let (_, file) = UnfinishedFile::open(&baked);
            file.tell(taken_over);
            let bake = UnfinishedBake {
                record: BakeRecord::default(),
                reached,
            };
            assert!(matches!(file.keep(&bake), Failure::Unfinished(_)));
            let (found, file) = UnfinishedFile::open(&baked);
            assert!(found.is_some());
            assert_eq!(file.reached.get(), Some(kept));
        }
        UnfinishedFile::open(&baked).1.remove();
        assert!(UnfinishedFile::open(&baked).0.is_none());
    }
}
