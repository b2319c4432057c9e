//! `sabaki bake`.

use std::path::PathBuf;

use sabaki::archive;
use serde_json::json;

use super::distances::DistanceFigure;
use super::plot::Plot;
use super::{Done, Failure, output, source};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    clips: source::ClipArgs,
    /// Graph file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Plots the distances between the frames of all clips, and the transitions: to a PNG or SVG file, or with - as letters to stdout.
    #[arg(long, value_name = "FILE")]
    plot: Option<Plot>,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    if args.clips.clips.is_empty() {
        return Err(Failure::Usage(
            "bake needs --clips: BVH or glTF files, or folders of them".to_owned(),
        ));
    }
    Plot::check(args.plot.as_ref(), as_json)?;
    output::check_is_no_input("--out", &args.out, &args.clips.files())?;
    let baked = source::from_clips(&args.clips)?;
    archive::write(&args.out, &baked.graph)?;
    let out = args.out.display();
    let (graph, threshold) = (baked.graph.graph(), args.clips.threshold);
    let drawn = match &args.plot {
        None => String::new(),
        Some(plot) => plot.draw(&DistanceFigure { graph, threshold })?,
    };
    Ok(Done::ok(if as_json {
        let mut document = source::statistics(&baked);
        document["out"] = json!(args.out);
        Done::json(&document)
    } else {
        format!("{}{drawn}wrote {out}\n", source::describe(&baked))
    }))
}
