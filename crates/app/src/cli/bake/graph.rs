//! `sabaki bake graph`: builds the graph of a plan from its shards, so that the tests of entries can be shared among machines, too.

use std::path::PathBuf;

use serde_json::json;

use super::super::{Done, Failure, source};
use super::join::planned_clips;
use super::shared_bake::SharedBake;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan, whose shards are computed.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let bake = SharedBake::open(&args.folder)?;
    let was_there = bake.read_graph().is_ok();
    if !was_there {
        let clips = planned_clips(&bake)?;
        bake.manifest().check_inputs()?;
        let graph = source::graph_of_clips(&clips, |builder| {
            bake.check_points(builder)?;
            bake.transitions(builder)
        })?;
        bake.write_graph(&graph)?;
    }
    Ok(Done::ok(match (as_json, was_there) {
        (true, _) => Done::json(&json!({ "was_there": was_there })),
        (false, true) => "the graph is there and sound: nothing to do\n".to_owned(),
        (false, false) => format!("the graph is built\n{}\n", bake.entries_commands()),
    }))
}
