//! `sabaki bake`: in one process, or in steps that several machines share.

mod entries;
mod graph;
mod join;
mod manifest;
pub(super) mod own_file;
mod partition;
mod plan;
mod record;
pub(super) mod recorded;
mod sealed;
mod shard;
mod shared_bake;
mod shared_entries;
mod submit;

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};

use crate::measure::quality::{Quality, QualityMeter};
use sabaki::archive::{self, ArchiveError};
use sabaki::maps::BakedGraph;
use serde_json::json;

use super::distances::DistanceFigure;
use super::plot::Plot;
use super::{Done, Failure, output, quality, source};
use record::{TakenOver, UnfinishedFile};
use recorded::BakeRecord;
use sabaki::internal::ClipMatch;

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
    /// Takes over what an earlier bake, whose graph file this is, computed of the same clips. The file that is written is the same as
    /// without. It reads the record beside the file (FILE.record).
    #[arg(long, value_name = "FILE")]
    onto: Option<PathBuf>,
    /// Writes no record for --onto beside the graph file.
    #[arg(long)]
    no_record: bool,
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
    /// Finishes a bake whose shards are computed. The file equals that of one process to the byte.
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
fn check(args: &Args, out: &Path, as_json: bool) -> Result<(), Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    Plot::check(args.plot.as_ref(), as_json)?;
    output::check_is_no_input("--out", out, &args.clips.files())?;
    output::check_can_be_written("--out", out)
}

fn in_one_process(args: &Args, out: &Path, as_json: bool) -> Result<Done, Failure> {
    check(args, out, as_json)?;
    if let Some(onto) = &args.onto {
        check_is_there(onto)?;
    }
    let (left, unfinished) = UnfinishedFile::open(out);
    let mut why = None;
    let matched = |clips: Option<&ClipMatch>| unfinished.tell(TakenOver::of(clips));
    // The record is read while the clips are.
    let baked = std::thread::scope(|scope| {
        let onto = args.onto.as_ref();
        let onto = onto.map(|onto| scope.spawn(|| BakeRecord::read(onto)));
        let earlier = || {
            let onto = onto.map(|onto| onto.join().unwrap_or_else(|panic| resume_unwind(panic)));
            let (onto, reason) = onto.unzip();
            why = reason.flatten();
            left.into_iter().chain(onto).collect()
        };
        source::from_clips_onto(&args.clips, earlier, matched)
    });
    let mut baked = baked.map_err(|failure| match failure {
        Failure::Stopped(bake) if has_neighbours(out) => unfinished.keep(&bake),
        failure => failure,
    })?;
    if let Some(made) = &mut baked.made {
        made.warnings.extend(why);
    }
    let (written, measured) = while_measured(&baked.graph, || {
        archive::write(out, &baked.graph)?;
        let records = !args.no_record && out.is_file();
        let made = baked.made.as_ref().filter(|_| records);
        Ok(made.map(|made| made.record.write(out)))
    });
    let record = match written {
        Ok(record) => record.transpose()?,
        Err(error) => {
            let failure = ArchiveError::into(error);
            return Err(match baked.made {
                Some(made) if has_neighbours(out) => unfinished.keep_whole(made.record, failure),
                _ => failure,
            });
        }
    };
    unfinished.remove();
    let report = Report {
        baked: &baked,
        measured,
        out,
        as_json,
    };
    let mut done = report.done(&args.clips, args.plot.as_ref())?;
    if let (Some((path, bytes)), false) = (record, as_json) {
        let megabytes = bytes as f64 * 1e-6;
        done.text += &format!(
            "wrote {}, {megabytes:.1} MB, for bake --onto\n",
            path.display()
        );
    }
    Ok(done)
}

/// Whether other files can lie beside a file to write. A pipe has no neighbour.
fn has_neighbours(out: &Path) -> bool {
    !out.exists() || out.is_file() || out.is_dir()
}

/// Checks that a file can be opened.
fn check_is_there(path: &Path) -> Result<(), Failure> {
    archive::open_regular(path)
        .map(drop)
        .map_err(|source| Failure::Open {
            path: path.to_owned(),
            source,
        })
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
    fn done(self, clips: &source::ClipArgs, plot: Option<&Plot>) -> Result<Done, Failure> {
        let Self {
            baked,
            measured,
            out,
            ..
        } = self;
        let Measured { of_clips, composed } = measured;
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
            document["out"] = json!(out.display().to_string());
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
