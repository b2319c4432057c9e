//! `sabaki bake`.

use std::path::PathBuf;

use sabaki::io;
use serde_json::json;

use super::{Done, Failure, source};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    clips: source::ClipArgs,
    /// The baked graph to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    let baked = source::from_clips(&args.clips)?;
    io::archive::write(&args.out, &baked.graph)?;
    let out = args.out.display();
    Ok(Done::ok(if as_json {
        let mut document = source::statistics(&baked);
        document["out"] = json!(args.out);
        Done::json(&document)
    } else {
        format!("{}wrote {out}\n", source::describe(&baked))
    }))
}
