//! `sabaki bake shard`: computes one shard of a plan.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;

use super::super::numbers::whole;
use super::super::{Done, Failure};
use super::manifest::MOST_SHARDS;
use super::shared_bake::{ShardOutcome, SharedBake};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of the shard, from 0.
    #[arg(value_name = "I", allow_negative_numbers = true, value_parser = whole::<usize>(0..=MOST_SHARDS as u64 - 1))]
    shard: usize,
    /// Number of threads, or 0 for one thread per CPU core. The shard does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let started = Instant::now();
    let bake = SharedBake::open(&args.folder)?;
    let (shard, shards) = (args.shard, bake.shards());
    bake.check_number(shard)?;
    let outcome = bake.compute(shard, args.threads as usize)?;
    let seconds = started.elapsed().as_secs_f64();
    let (pairs, clips) = (bake.pairs(shard), bake.clips_of(shard).len());
    let computed = match outcome {
        ShardOutcome::WasThere => None,
        ShardOutcome::Computed { minima, distances } => Some((minima, distances)),
    };
    if as_json {
        return Ok(Done::ok(Done::json(&json!({
            "shard": shard, "was_there": computed.is_none(),
            "minima": computed.map(|(minima, _)| minima),
            "distances": computed.map(|(_, distances)| distances),
            "window_pairs": pairs, "clips_read": clips, "shard_seconds": seconds,
        }))));
    }
    Ok(Done::ok(match computed {
        None => format!("shard {shard} of {shards} is there and sound: nothing to do\n"),
        Some((minima, distances)) => format!(
            "shard {shard} of {shards}: {minima} minima in {:.1} million window pairs of {clips} clips, {:.1} million distances computed, {seconds:.2} s\n",
            pairs as f64 * 1e-6,
            distances as f64 * 1e-6
        ),
    }))
}
