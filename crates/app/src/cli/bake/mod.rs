//! `sabaki bake`: in one process, or in steps that several machines share.

mod join;
mod manifest;
mod partition;
mod plan;
mod sealed;
mod shard;
mod shared_bake;
mod submit;

use std::path::{Path, PathBuf};

use sabaki::archive;
use sabaki_app::demo::quality::QualityMeter;
use serde_json::json;

use super::distances::DistanceFigure;
use super::plot::Plot;
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
    /// Plots the distances between the frames of all clips, and the transitions: to a PNG or SVG file, or with - as letters to stdout.
    #[arg(long, value_name = "FILE")]
    plot: Option<Plot>,
}

/// A step of a bake that several processes share.
#[derive(clap::Subcommand)]
enum Step {
    /// Divides the search for transitions into shards, which any machines compute.
    Plan(Box<plan::Args>),
    /// Computes one shard of a plan; does nothing if it is there and sound.
    Shard(shard::Args),
    /// Finishes a bake whose shards are computed. The file equals that of one process to the byte.
    Join(join::Args),
    /// Submits the shards of a plan, and the join, to a queue.
    Submit(submit::Args),
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    match (&args.step, &args.out) {
        (Some(Step::Plan(args)), _) => plan::run(args, as_json),
        (Some(Step::Shard(args)), _) => shard::run(args, as_json),
        (Some(Step::Join(args)), _) => join::run(args, as_json),
        (Some(Step::Submit(args)), _) => submit::run(args, as_json),
        (None, Some(out)) => in_one_process(args, out, as_json),
        (None, None) => Err(Failure::Usage("bake needs --out FILE".to_owned())),
    }
}

fn in_one_process(args: &Args, out: &Path, as_json: bool) -> Result<Done, Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    Plot::check(args.plot.as_ref(), as_json)?;
    output::check_is_no_input("--out", out, &args.clips.files())?;
    let baked = source::from_clips(&args.clips)?;
    Report {
        baked: &baked,
        out,
        as_json,
    }
    .done(&args.clips, args.plot.as_ref())
}

/// A finished bake, which is written and described.
struct Report<'a> {
    baked: &'a source::Baked,
    out: &'a Path,
    as_json: bool,
}

impl Report<'_> {
    fn done(&self, clips: &source::ClipArgs, plot: Option<&Plot>) -> Result<Done, Failure> {
        let Self { baked, out, .. } = *self;
        archive::write(out, &baked.graph)?;
        let meter = QualityMeter::new(&baked.graph);
        let (of_clips, composed) = (meter.clips(), meter.answers(ANSWERS, 1));
        let (graph, threshold) = (baked.graph.graph(), clips.threshold);
        let drawn = match plot {
            None => String::new(),
            Some(plot) => plot.draw(&DistanceFigure { graph, threshold })?,
        };
        let left_out = baked
            .made
            .as_ref()
            .is_some_and(|made| !made.left_out.is_empty());
        let text = if self.as_json {
            let mut document = source::statistics(baked);
            document["out"] = json!(out);
            document["quality"] = quality::document(&of_clips, &composed);
            Done::json(&document)
        } else {
            let table = quality::text(&of_clips, &composed, "answers");
            let described = source::describe(baked);
            format!("{described}{table}{drawn}wrote {}\n", out.display())
        };
        Ok(Done {
            incomplete: left_out,
            ..Done::ok(text)
        })
    }
}
