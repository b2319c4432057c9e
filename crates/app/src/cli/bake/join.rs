//! `sabaki bake join`: finishes a bake whose shards are computed.

use std::path::PathBuf;

use clap::Parser;
use sabaki::archive;

use super::super::source::{self, ClipArgs};
use super::super::{Cli, Command, Done, Failure, output};
use super::shared_bake::SharedBake;
use super::{Report, Step, while_measured};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the plan.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Graph file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    output::check_can_be_written("--out", &args.out)?;
    let bake = SharedBake::open(&args.folder)?;
    let clips = planned_clips(&bake)?;
    output::check_is_no_input("--out", &args.out, &clips.files())?;
    bake.manifest().check_inputs()?;
    let baked = match bake.shared_entries()? {
        Some((built, entries)) => source::from_graph(&clips, built, entries)?,
        None => source::from_clips_with(&clips, |builder| {
            bake.check_points(builder)?;
            bake.transitions(builder)
        })?,
    };
    let write = || archive::write(&args.out, &baked.graph);
    let (written, measured) = while_measured(&baked.graph, write);
    written?;
    Ok(Report {
        baked: &baked,
        measured,
        out: &args.out,
        as_json,
    }
    .done())
}

/// The clips that the arguments of the plan name.
pub(super) fn planned_clips(bake: &SharedBake) -> Result<ClipArgs, Failure> {
    let manifest = bake.manifest();
    let words = ["sabaki"]
        .into_iter()
        .chain(manifest.arguments.iter().map(String::as_str));
    match Cli::try_parse_from(words) {
        Ok(Cli {
            command:
                Some(Command::Bake(super::Args {
                    step: Some(Step::Plan(plan)),
                    ..
                })),
            ..
        }) => Ok(plan.into_clips(&manifest.folder)),
        _ => Err(Failure::Usage(
            "plan.json: its arguments are not those of bake plan; run bake plan again".to_owned(),
        )),
    }
}
