//! The files of exported answers.

use std::path::Path;

use sabaki::archive;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, QuerySettings};
use sabaki_fixtures::throw::Throw;
use sabaki_import::RecordedRequest;
use sabaki_import::export::{ExportedAnswer, MotionFormat, Target, write_answer};

use super::Failure;
use super::method::Method;

/// The digest by which exported answers name the graph.
pub(super) fn graph_name(baked: &BakedGraph) -> Result<u32, Failure> {
    archive::checksum(baked).map_err(|error| Failure::Usage(error.to_string()))
}

/// The query of one throw.
#[derive(Clone, Copy)]
pub(super) struct ThrowQuery<'a> {
    /// Digest of the graph.
    pub(super) graph: u32,
    pub(super) throw: &'a Throw,
    pub(super) settings: &'a QuerySettings,
    pub(super) method: Method,
}

impl ThrowQuery<'_> {
    /// The input of the query as exported files store it.
    pub(super) fn recorded(&self) -> RecordedRequest {
        RecordedRequest {
            graph: self.graph,
            playhead: self.throw.playhead,
            attack: self.throw.attack.clone(),
            settings: *self.settings,
            evaluation: self.method.cull.evaluation(),
        }
    }
}

/// A folder of exported answers.
#[derive(Clone, Copy)]
pub(super) struct AnswerFolder<'a> {
    pub(super) path: &'a Path,
    pub(super) format: MotionFormat,
    pub(super) baked: &'a BakedGraph,
}

impl AnswerFolder<'_> {
    /// Writes an answer as `attack_0000.bvh` or `.glb`, and `.json`.
    pub(super) fn write(
        &self,
        index: u64,
        request: &RecordedRequest,
        answer: &Answer,
    ) -> Result<(), Failure> {
        let name = format!("attack_{index:04}");
        let target = Target {
            folder: self.path,
            name: &name,
            format: self.format,
        };
        let exported = ExportedAnswer {
            baked: self.baked,
            request,
            answer,
        };
        let written = write_answer(target, exported);
        let failed = |source| Failure::Write {
            path: self.path.join(&name),
            source,
        };
        written.map(|_| ()).map_err(failed)
    }
}
