//! `sabaki bake entries`: tests the entries of one share of a plan's graph.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;

use super::super::numbers::whole;
use super::super::{Done, Failure};
use super::manifest::MOST_SHARDS;
use super::shared_bake::SharedBake;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan, whose graph is built.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of the share, from 0. There are as many as shards.
    #[arg(value_name = "I", allow_negative_numbers = true, value_parser = whole::<usize>(0..=MOST_SHARDS as u64 - 1))]
    share: usize,
    /// Number of threads, or 0 for one thread per CPU core. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let started = Instant::now();
    let bake = SharedBake::open(&args.folder)?;
    bake.check_number(args.share)?;
    let was_there = bake.compute_entries(args.share, args.threads as usize)?;
    let (share, seconds) = (args.share, started.elapsed().as_secs_f64());
    let shares = bake.shards();
    Ok(Done::ok(match (as_json, was_there) {
        (true, _) => Done::json(&json!({
            "share": share, "was_there": was_there, "share_seconds": seconds,
        })),
        (false, true) => {
            format!("entries {share} of {shares} are there and sound: nothing to do\n")
        }
        (false, false) => format!("entries {share} of {shares}: {seconds:.2} s\n"),
    }))
}
