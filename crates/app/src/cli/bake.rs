//! `sabaki bake`.

use std::path::PathBuf;

use sabaki::archive;
use sabaki_app::demo::quality::QualityMeter;
use serde_json::json;

use super::distances::DistanceFigure;
use super::plot::Plot;
use super::{Done, Failure, output, quality, source};

/// Number of random attacks whose answers are measured.
const ANSWERS: u64 = 200;

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
    let meter = QualityMeter::new(&baked.graph);
    let (clips, composed) = (meter.clips(), meter.answers(ANSWERS, 1));
    let out = args.out.display();
    let (graph, threshold) = (baked.graph.graph(), args.clips.threshold);
    let drawn = match &args.plot {
        None => String::new(),
        Some(plot) => plot.draw(&DistanceFigure { graph, threshold })?,
    };
    let left_out = baked
        .made
        .as_ref()
        .is_some_and(|made| !made.left_out.is_empty());
    let text = if as_json {
        let mut document = source::statistics(&baked);
        document["out"] = json!(args.out);
        document["quality"] = quality::document(&clips, &composed);
        Done::json(&document)
    } else {
        let table = quality::text(&clips, &composed, "answers");
        format!("{}{table}{drawn}wrote {out}\n", source::describe(&baked))
    };
    Ok(Done {
        incomplete: left_out,
        ..Done::ok(text)
    })
}
