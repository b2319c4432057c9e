//! The record of a bake, which `bake --onto` reads: beside the baked file, with `.record` after its name.

use std::path::{Path, PathBuf};

use sabaki::internal::{GraphRecord, TableRecord};
use serde::{Deserialize, Serialize};

use super::super::Failure;
use super::sealed::{self, Kind, Seal};

/// Version of the form of records. It changes with what is recorded.
const VERSION: u32 = 4;

/// Seal of the file.
const SEAL: Seal = Seal {
    kind: Kind::Record,
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
        let mut path = baked.as_os_str().to_owned();
        path.push(".record");
        path.into()
    }

    /// Reads the record of a baked file. Where there is none that can be used, it returns an empty one and the reason.
    pub(crate) fn read(baked: &Path) -> (Self, Option<String>) {
        let path = Self::path(baked);
        match sealed::read(&path, SEAL) {
            Ok((record, _)) => (record, None),
            Err(why) => {
                let why = format!("{}: {why}; all is computed anew", path.display());
                (Self::default(), Some(why))
            }
        }
    }

    /// Writes the record of a baked file, and returns its path and size in bytes.
    pub(crate) fn write(&self, baked: &Path) -> Result<(PathBuf, usize), Failure> {
        let (path, bytes) = (Self::path(baked), sealed::encode(self)?);
        sealed::write(&path, SEAL, &bytes)?;
        Ok((path, bytes.len()))
    }
}
