//! The results that a bake hands on to a later one.

use sabaki::internal::{GraphRecord, TableRecord};
use serde::{Deserialize, Serialize};

/// Results that a later bake takes over.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct BakeRecord {
    pub(crate) graph: GraphRecord,
    pub(crate) tables: TableRecord,
}

/// The results of a bake that was stopped.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct UnfinishedBake {
    pub(crate) record: BakeRecord,
    /// Number of the stage that it was in, and the pieces of it that were done.
    pub(crate) reached: (u8, u64),
}
