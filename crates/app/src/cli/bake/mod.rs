//! `sabaki bake`: in one process, or in steps that several machines share.

mod entries;
mod graph;
mod join;
mod manifest;
pub(super) mod own_file;
mod partition;
mod plan;
mod sealed;
mod shard;
mod shared_bake;
mod shared_entries;
mod submit;

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};

use crate::measure::quality::{Quality, QualityMeter};
use sabaki::archive;
use sabaki::maps::BakedGraph;
use serde_json::json;

use super::{Done, Failure, output, quality, source};

/// Number of random attacks whose answers are measured.
const ANSWERS: u64 = 200;

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    step: Option<Step>,
    #[command(flatten)]
    clips: source::ClipArgs,
    /// Graph file to write.
    #[arg(long, value_name = "FILE", required = true)]
    out: Option<PathBuf>,
}

/// A step of a bake that several processes share.
#[derive(clap::Subcommand)]
enum Step {
    /// Divides the search for transitions into shards, which any machines compute.
    Plan(Box<plan::Args>),
    /// Computes one shard of a plan; does nothing if it is there and sound.
    Shard(shard::Args),
    /// Builds the graph from all shards, so that the tests of its entries can be shared, too.
    Graph(graph::Args),
    /// Tests the entries of one share of the graph; does nothing if they are there and sound.
    Entries(entries::Args),
    /// Finishes a bake whose shards are computed. The file is byte-identical to that of one process.
    Join(join::Args),
    /// Submits all steps of a plan to a queue.
    Submit(submit::Args),
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    match (&args.step, &args.out) {
        (Some(Step::Plan(args)), _) => plan::run(args, as_json),
        (Some(Step::Shard(args)), _) => shard::run(args, as_json),
        (Some(Step::Graph(args)), _) => graph::run(args, as_json),
        (Some(Step::Entries(args)), _) => entries::run(args, as_json),
        (Some(Step::Join(args)), _) => join::run(args, as_json),
        (Some(Step::Submit(args)), _) => submit::run(args, as_json),
        (None, Some(out)) => in_one_process(args, out, as_json),
        (None, None) => Err(Failure::Usage("bake needs --out FILE".to_owned())),
    }
}

/// What can be refused before any work is done.
fn check(args: &Args, out: &Path) -> Result<(), Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    output::check_is_no_input("--out", out, &args.clips.files())?;
    output::check_can_be_written("--out", out)
}

fn in_one_process(args: &Args, out: &Path, as_json: bool) -> Result<Done, Failure> {
    check(args, out)?;
    let baked = source::from_clips(&args.clips)?;
    let (written, measured) = while_measured(&baked.graph, || archive::write(out, &baked.graph));
    written?;
    Ok(Report {
        baked: &baked,
        measured,
        out,
        as_json,
    }
    .done())
}

/// Quality of a graph's motions.
struct Measured {
    of_clips: Quality,
    composed: Quality,
}

impl Measured {
    fn new(baked: &BakedGraph) -> Self {
        let meter = QualityMeter::new(baked);
        Self {
            of_clips: meter.clips(),
            composed: meter.answers(ANSWERS, 1),
        }
    }
}

/// Runs `work`, which writes a graph, while its motions are measured on another thread.
fn while_measured<T>(baked: &BakedGraph, work: impl FnOnce() -> T) -> (T, Measured) {
    std::thread::scope(|scope| {
        let measured = scope.spawn(|| Measured::new(baked));
        let done = work();
        let measured = measured.join();
        (done, measured.unwrap_or_else(|panic| resume_unwind(panic)))
    })
}

/// A finished bake, which is described.
struct Report<'a> {
    baked: &'a source::Baked,
    measured: Measured,
    out: &'a Path,
    as_json: bool,
}

impl Report<'_> {
    fn done(self) -> Done {
        let Self {
            baked,
            measured,
            out,
            ..
        } = self;
        let Measured { of_clips, composed } = measured;
        let left_out = baked
            .made
            .as_ref()
            .is_some_and(|made| !made.left_out.is_empty());
        let text = if self.as_json {
            let mut document = source::bake_statistics(baked);
            document["out"] = json!(out.display().to_string());
            document["quality"] = quality::document(&of_clips, &composed);
            Done::json(&document)
        } else {
            let table = quality::text(&of_clips, &composed, "answers");
            let described = source::describe_bake(baked);
            format!("{described}{table}wrote {}\n", out.display())
        };
        Done {
            incomplete: left_out,
            ..Done::ok(text)
        }
    }
}
