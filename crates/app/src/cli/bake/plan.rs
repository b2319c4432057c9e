//! `sabaki bake plan`: divides a bake into shards.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::super::numbers::whole;
use super::super::{Done, Failure, source};
use super::manifest::{MOST_SHARDS, PlanInput};
use super::shared_bake::{SharedBake, command};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    clips: source::ClipArgs,
    /// Folder of the plan, which is created. All processes that compute shards must see it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of shards of about equal cost.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = whole::<usize>(1..=MOST_SHARDS as u64))]
    shards: usize,
}

impl Args {
    /// The clips, with paths as seen from the folder in which the plan was made.
    pub(super) fn into_clips(mut self, folder: &Path) -> source::ClipArgs {
        self.clips.start_in(folder);
        self.clips
    }
}

pub(super) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake plan needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    let input = source::BakeInput::read(&args.clips)?;
    let settings = input.graph_settings();
    let builder = input.builder(&settings)?;
    let planned = PlanInput {
        clips: &args.clips,
        shards: args.shards,
    };
    let bake = SharedBake::create(&args.out, planned, &builder)?;
    let shards = bake.shards();
    let pairs: Vec<u64> = (0..shards).map(|shard| bake.pairs(shard)).collect();
    let (least, most) = (
        pairs.iter().min().copied().unwrap_or(0),
        pairs.iter().max().copied().unwrap_or(0),
    );
    let clips = builder.clouds().len();
    let (left_out, notes) = (input.left_out(), input.notes());
    let text = if as_json {
        let read: Vec<usize> = (0..shards)
            .map(|shard| bake.clips_of(shard).len())
            .collect();
        Done::json(&json!({
            "out": args.out.display().to_string(), "clips": clips, "shards": shards, "window_pairs": pairs, "clips_read": read,
            "left_out": left_out, "warnings": notes,
        }))
    } else {
        let shards_text = format!(
            "{clips} clips; {shards} shards of {:.1} to {:.1} million window pairs\n",
            least as f64 * 1e-6,
            most as f64 * 1e-6,
        );
        shards_text + &next_commands(args, shards) + &source::left_out_and_notes(left_out, &notes)
    };
    Ok(Done {
        incomplete: !left_out.is_empty(),
        ..Done::ok(text)
    })
}

/// What to run after the plan is made.
fn next_commands(args: &Args, shards: usize) -> String {
    let shard = format!("0 (to {})", shards - 1);
    format!(
        "compute each:   {}\n\
         then join them: {}\n\
         or, to share the tests of entries before that: {}\n",
        command(&["bake", "shard"], &args.out, &[&shard]),
        command(&["bake", "join"], &args.out, &["--out", "FILE"]),
        command(&["bake", "graph"], &args.out, &[]),
    )
}
