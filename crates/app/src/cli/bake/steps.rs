//! `sabaki bake plan`, `shard` and `join`: the steps of a bake that several machines share.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;

use super::super::numbers::whole;
use super::super::{Done, Failure, output};
use super::args::ClipArgs;
use super::run::BakeInput;
use super::shared::{MOST_SHARDS, SharedBake};
use super::statistics::left_out_and_notes;
use super::write;

#[derive(clap::Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    clips: ClipArgs,
    /// Folder of the plan, which is created. All processes that do steps must see it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of shards of about equal cost.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = whole::<usize>(1..=MOST_SHARDS as u64))]
    shards: usize,
}

#[derive(clap::Args)]
pub(crate) struct ShardArgs {
    /// Folder of the plan.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of the shard, from 0.
    #[arg(value_name = "I", allow_negative_numbers = true, value_parser = whole::<usize>(0..=MOST_SHARDS as u64 - 1))]
    shard: usize,
    /// Number of threads, or 0 for one thread per CPU core. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
}

#[derive(clap::Args)]
pub(crate) struct JoinArgs {
    /// Folder of the plan.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Graph file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn plan(args: &PlanArgs, as_json: bool) -> Result<Done, Failure> {
    let input = BakeInput::read(&args.clips)?;
    let (bake, pairs) = SharedBake::create(&args.out, &input, args.shards)?;
    let (shards, clips) = (bake.plan.shards, input.set.clips.len());
    let (left_out, notes) = (&bake.plan.left_out, &bake.plan.notes);
    let text = match as_json {
        true => Done::json(&json!({
            "out": args.out.display().to_string(), "clips": clips, "shards": shards, "window_pairs": pairs, "left_out": left_out,
            "warnings": notes,
        })),
        false => format!(
            "{clips} clips; {shards} shards of about {:.1} million window pairs\n\
             search each, build the graph from all, and test the entries of each: {}\n\
             then join them: {}\n{}",
            1e-6 * pairs.iter().sum::<u64>() as f64 / shards as f64,
            bake.command("shard", &format!("0 (to {})", shards - 1)),
            bake.command("join", "--out FILE"),
            left_out_and_notes(left_out, notes),
        ),
    };
    Ok(Done::without(text, left_out))
}

pub(super) fn shard(args: &ShardArgs, as_json: bool) -> Result<Done, Failure> {
    let started = Instant::now();
    let bake = SharedBake::open(&args.folder)?;
    let (shard, shards) = (args.shard, bake.plan.shards);
    if shard >= shards {
        return Err(Failure::Usage(format!(
            "shard {shard}: the plan has the shards 0 to {}",
            shards - 1
        )));
    }
    let (step, told, mut document) = bake.step(shard, args.threads as usize)?;
    let seconds = started.elapsed().as_secs_f64();
    document["shard"] = json!(shard);
    document["step"] = json!(step);
    document["seconds"] = json!(seconds);
    Ok(Done::ok(match as_json {
        true => Done::json(&document),
        false => format!("shard {shard} of {shards}: {told} ({seconds:.2} s)\n"),
    }))
}

pub(super) fn join(args: &JoinArgs, as_json: bool) -> Result<Done, Failure> {
    output::check_can_be_written("--out", &args.out)?;
    let baked = SharedBake::open(&args.folder)?.join()?;
    write(&baked, &args.out, as_json)
}
