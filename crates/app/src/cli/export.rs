//! The files of exported answers, and asking again what they were found for.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use sabaki::archive;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, QuerySettings};
use sabaki_fixtures::throw::Throw;
use sabaki_import::export::{ExportedAnswer, MotionFormat, write_answer};
use sabaki_import::{Chosen, ReadError, RecordedRequest, Recording};
use serde_json::json;

use super::output::usage;
use super::queries::Method;
use super::{Done, Failure, output};

pub(crate) fn format_parser() -> impl TypedValueParser<Value = MotionFormat> {
    PossibleValuesParser::new(["bvh", "glb"]).map(|format| match format.as_str() {
        "bvh" => MotionFormat::Bvh,
        _ => MotionFormat::Glb,
    })
}

/// A folder that answers are written to.
pub(crate) struct Export<'a> {
    folder: &'a Path,
    format: MotionFormat,
    baked: &'a BakedGraph,
    /// Digest by which the files name the graph.
    graph: u32,
}

/// Name of an answer's files, without an ending.
pub(crate) fn name(index: u64) -> String {
    format!("attack_{index:04}")
}

/// Refuses a folder that cannot be made or that holds an answer to the attack `index`, before any work is done.
pub(crate) fn check(folder: &Path, index: u64) -> Result<(), Failure> {
    let option = format!("--export {}", folder.display());
    output::check_can_be_folder(&option, folder)?;
    for ending in ["bvh", "glb", "json"] {
        let file = format!("{}.{ending}", name(index));
        if folder.join(&file).exists() {
            let what = format!("{option}: {file} is there; remove it, or choose another folder");
            return Err(Failure::Usage(what));
        }
    }
    Ok(())
}

impl<'a> Export<'a> {
    /// Makes the folder.
    pub(crate) fn new(
        folder: &'a Path,
        format: MotionFormat,
        baked: &'a BakedGraph,
    ) -> Result<Self, Failure> {
        std::fs::create_dir_all(folder).map_err(Failure::file(folder))?;
        let graph = archive::checksum(baked).map_err(usage)?;
        Ok(Self {
            folder,
            format,
            baked,
            graph,
        })
    }

    /// Writes a motion (`.bvh` or `.glb`) and `.json` of this name.
    pub(crate) fn write(
        &self,
        name: &str,
        throw: &Throw,
        settings: &QuerySettings,
        method: Method,
        answer: &Answer,
    ) -> Result<[PathBuf; 2], Failure> {
        let exported = ExportedAnswer {
            baked: self.baked,
            request: &recorded(self.graph, throw, settings, method),
            attack: &throw.attack,
            answer,
        };
        let written = write_answer(self.folder, name, self.format, exported);
        written.map_err(Failure::file(&self.folder.join(name)))
    }
}

/// A query as exported files store it.
pub(crate) fn recorded(
    graph: u32,
    throw: &Throw,
    settings: &QuerySettings,
    method: Method,
) -> RecordedRequest {
    RecordedRequest {
        graph,
        playhead: throw.playhead,
        settings: *settings,
        evaluation: method.evaluation,
    }
}

/// Asks again what an exported answer was found for.
pub(crate) fn replay(path: &Path, baked: &BakedGraph, as_json: bool) -> Result<Done, Failure> {
    let recording = Recording::read(path)?;
    let answer = recording.replay(baked).map_err(ReadError::in_file(path))?;
    let (expected, found) = (&recording.chosen, &Chosen::of(baked, &answer));
    let same = found.is_same(expected);
    let text = if as_json {
        Done::json(&json!({ "same": same, "expected": expected, "found": found }))
    } else if same {
        format!("the same answer, to the bit: {}\n", describe(found))
    } else {
        format!(
            "ANOTHER answer\nexpected: {}\nfound:    {}\n",
            describe(expected),
            describe(found)
        )
    };
    Ok(Done::answer(text, same))
}

fn describe(chosen: &Chosen) -> String {
    let edges: Vec<String> = chosen.edges.iter().map(|edge| edge.0.to_string()).collect();
    let evasion = chosen
        .evasion
        .map_or("none".to_owned(), |edge| edge.0.to_string());
    format!(
        "{}, p {}, clearance {} m, evasion's edge {evasion}, path's edges {}",
        if chosen.avoided { "avoided" } else { "hit" },
        chosen.p,
        chosen.clearance,
        edges.join(" ")
    )
}
