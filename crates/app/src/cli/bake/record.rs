//! What a bake leaves for later ones, beside the baked file: its record, with `.record` after the name, which `bake --onto` reads, and, if
//! it was stopped, what it had done, with `.unfinished` after the name.

use std::path::{Path, PathBuf};

use sabaki::internal::{GraphRecord, TableRecord};
use serde::{Deserialize, Serialize};

use super::super::{Failure, output};
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

/// Results that a later bake takes over.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct BakeRecord {
    pub(crate) graph: GraphRecord,
    pub(crate) tables: TableRecord,
}

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

/// What a bake that was stopped had done.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct UnfinishedBake {
    pub(crate) record: BakeRecord,
    /// Number of the stage that it was in, and the pieces of it that were done.
    pub(crate) reached: (u8, u64),
}

/// The file of an unfinished bake, beside the file that it was to write: the same command goes on from it.
pub(crate) struct UnfinishedFile {
    path: PathBuf,
    /// How far the bake was whose file is there.
    reached: Option<(u8, u64)>,
}

impl UnfinishedFile {
    /// Reads what an earlier run left, and says so. The first value is `None` where there is nothing that can be used.
    pub(crate) fn open(baked: &Path) -> (Option<BakeRecord>, Self) {
        let path = with_ending(baked, ".unfinished");
        let found = sealed::read::<UnfinishedBake>(&path, UNFINISHED);
        let (record, reached) = match found {
            Ok((UnfinishedBake { record, reached }, _)) => {
                output::notice(&format!("goes on from {}", path.display()));
                (Some(record), Some(reached))
            }
            Err(Unusable::Missing) => (None, None),
            Err(why) => {
                output::notice(&anew(&path, &why));
                (None, None)
            }
        };
        (record, Self { path, reached })
    }

    /// Writes what a bake has done that was stopped, unless what is there came farther. Returns the error of the command.
    pub(crate) fn keep(&self, bake: &UnfinishedBake) -> Failure {
        let is_farther = self.reached.is_none_or(|reached| reached <= bake.reached);
        let written = match is_farther {
            true => sealed::encode(bake).and_then(|it| sealed::write(&self.path, UNFINISHED, &it)),
            false => Ok(()),
        };
        match written {
            Ok(()) => Failure::Unfinished(self.path.clone()),
            Err(failure) => failure,
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
