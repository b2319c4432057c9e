//! `sabaki bake`: in one process, or in steps that several machines share. Where a graph comes from: a baked file, or the embedded motions.

mod args;
mod bar;
mod embedded;
mod run;
mod shared;
mod statistics;
mod steps;
mod submit;

pub(crate) use args::{ReadArgs, check_is_motion, read_clips};
pub(crate) use embedded::{GraphArgs, embedded_anew};
pub(crate) use statistics::describe;
pub(crate) use statistics::{bake_statistics, headline, statistics};

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};

use crate::measure::quality::QualityMeter;
use sabaki::archive;
use serde_json::json;

use self::args::ClipArgs;
use self::run::Baked;
use super::{Done, Failure, output, quality};

/// Number of random attacks whose answers are measured.
const ANSWERS: u64 = 200;

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    step: Option<Step>,
    #[command(flatten)]
    clips: ClipArgs,
    /// Graph file to write.
    #[arg(long, value_name = "FILE", required = true)]
    out: Option<PathBuf>,
    /// What draws the maps. The file is byte-identical either way.
    #[arg(long, value_name = "WHERE", value_enum, default_value_t = MapDrawing::Cpu)]
    draw: MapDrawing,
}

/// What draws the maps of a bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MapDrawing {
    /// The CPU.
    Cpu,
    /// The stencil buffer of the most capable Vulkan device, as in the paper.
    Stencil,
}

/// A step of a bake that several processes share.
#[derive(clap::Subcommand)]
enum Step {
    /// Writes the clips and settings of a bake into a folder, in which any machines then do its work.
    Plan(Box<steps::PlanArgs>),
    /// Does the next step that a shard has to do: it searches its part of the transitions, builds the graph from all parts, or tests its part
    /// of the entries. Nothing is done twice.
    Shard(steps::ShardArgs),
    /// Finishes a bake. The file is byte-identical to that of one process.
    Join(steps::JoinArgs),
    /// Submits all steps of a plan to a queue.
    Submit(submit::Args),
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    match (&args.step, &args.out) {
        (Some(Step::Plan(args)), _) => steps::plan(args, as_json),
        (Some(Step::Shard(args)), _) => steps::shard(args, as_json),
        (Some(Step::Join(args)), _) => steps::join(args, as_json),
        (Some(Step::Submit(args)), _) => submit::run(args, as_json),
        (None, Some(out)) => in_one_process(args, out, as_json),
        (None, None) => Err(Failure::Usage("bake needs --out FILE".to_owned())),
    }
}

/// What can be refused before any work is done.
fn check(args: &Args, out: &Path) -> Result<(), Failure> {
    args.clips.check()?;
    output::check_is_no_input("--out", out, &args.clips.files())?;
    output::check_can_be_written("--out", out)
}

fn in_one_process(args: &Args, out: &Path, as_json: bool) -> Result<Done, Failure> {
    check(args, out)?;
    let baked = run::from_clips(&args.clips, args.draw)?;
    write(&baked, out, as_json)
}

/// Writes a graph while its motions are measured, and describes it.
fn write(baked: &Baked, out: &Path, as_json: bool) -> Result<Done, Failure> {
    let graph = &baked.graph;
    let (written, [of_clips, composed]) = std::thread::scope(|scope| {
        let measured = scope.spawn(|| {
            let meter = QualityMeter::new(graph);
            [meter.clips(), meter.answers(ANSWERS, 1)]
        });
        let written = archive::write_with(out, graph, &baked.mesh);
        let measured = measured.join();
        (
            written,
            measured.unwrap_or_else(|panic| resume_unwind(panic)),
        )
    });
    written?;
    let text = if as_json {
        let mut document = bake_statistics(baked);
        document["out"] = json!(out.display().to_string());
        document["quality"] = quality::document(&of_clips, &composed);
        Done::json(&document)
    } else {
        let table = quality::text(&of_clips, &composed, "answers");
        let described = statistics::describe_bake(baked);
        format!("{described}{table}wrote {}\n", out.display())
    };
    Ok(Done::without(text, &baked.left_out))
}
