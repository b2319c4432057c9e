//! What a bake leaves for later ones, beside the baked file: its record, with `.record` after the name, which `bake --onto` reads, and, if
//! it was stopped, what it had done, with `.unfinished` after the name.

use std::cell::Cell;
use std::path::{Path, PathBuf};

use super::super::{Failure, output};
use super::recorded::{BakeRecord, UnfinishedBake};
use super::sealed::{self, Kind, Seal, Unusable};

/// Version of the form of records. It changes with what is recorded.
const VERSION: u32 = 5;

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

/// The file of an unfinished bake, beside the file that it was to write: the same command goes on from it.
pub(crate) struct UnfinishedFile {
    path: PathBuf,
    /// How far the bake was whose file is there, unless it is of other clips or settings.
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

    /// Says whether the bake goes on from what an earlier run left, which is the first of those that it may take clips over from.
    pub(crate) fn tell(&self, taken_over: &[usize]) {
        if self.reached.get().is_none() {
            return;
        }
        let path = self.path.display();
        if taken_over.first().is_some_and(|&clips| clips > 0) {
            output::notice(&format!("goes on from {path}"));
        } else {
            self.reached.set(None);
            output::notice(&format!(
                "{path} is of other clips or settings; it is not used"
            ));
        }
    }

    /// Writes what a bake has done that was stopped, unless it went on from what is there and has not come farther. Returns the error of the
    /// command.
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
        let cases: [(_, &[usize], _); 5] = [
            ((3, 7), &[], (3, 7)),
            // It stopped before it had come as far.
            ((2, 9), &[5], (3, 7)),
            ((3, 8), &[5], (3, 8)),
            ((4, 0), &[5, 2], (4, 0)),
            // What was there is of other clips or settings.
            ((1, 2), &[0, 2], (1, 2)),
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
