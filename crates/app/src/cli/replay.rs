//! `sabaki dodge --replay`: asks again what an exported answer was found for.

use std::path::Path;

use sabaki::maps::BakedGraph;
use sabaki_import::{Chosen, ReadError, Recording};
use serde_json::json;

use super::{Done, Failure};

pub(crate) fn run(path: &Path, baked: &BakedGraph, as_json: bool) -> Result<Done, Failure> {
    let recording = Recording::read(path)?;
    let answer = recording
        .replay(baked)
        .map_err(|error| ReadError::Recording {
            path: path.to_owned(),
            error,
        })?;
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
