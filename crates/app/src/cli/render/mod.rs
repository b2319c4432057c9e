//! `sabaki render`: draws scenes to files, without a window.

mod body;
mod canvas;
mod crowd;
mod dodge;
mod duel;
mod file;

use std::path::PathBuf;

use clap::ValueEnum;
pub(crate) use duel::DuelArgs;
use serde_json::json;

use super::culling::DeviceArgs;
use super::mesh::MeshArgs;
use super::numbers::whole;
use super::source::GraphArgs;
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene to draw.
    #[arg(value_enum)]
    scene: Scene,
    #[command(flatten)]
    graph: GraphArgs,
    /// File to write: a picture (.png) or a film (.gif, .apng).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Size of a picture, in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x400", value_parser = size)]
    size: [u32; 2],
    /// Pictures per second of a film [default: 25].
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=50))]
    rate: Option<u16>,
    /// Leaves out the text.
    #[arg(long)]
    plain: bool,
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    dodge: dodge::DodgeArgs,
    #[command(flatten)]
    crowd: crowd::CrowdArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scene {
    /// A character that avoids an attack.
    Dodge,
    /// A column of ten thousand characters.
    Crowd,
    /// The mesh of the characters from four sides, in three poses of the clips.
    Body,
}

/// Largest width and height of a picture, in pixels.
const MOST_PIXELS: u32 = 4096;

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x');
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let fits = |sides: &[u32; 2]| sides.iter().all(|side| (16..=MOST_PIXELS).contains(side));
    sides
        .filter(fits)
        .ok_or_else(|| format!("not a size such as 640x400, each 16 to {MOST_PIXELS}"))
}

/// The first option that is given, of options by their names.
fn first_given(options: &[(&'static str, bool)]) -> Option<&'static str> {
    let given = options.iter().find(|(_, is_given)| *is_given);
    given.map(|(option, _)| *option)
}

/// Height of a line of text, in pixels, in pictures of this width.
fn text_height(width: u32) -> u32 {
    (width / 26).clamp(14, 32)
}

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let kind = file::Kind::of(&args.out)?;
    args.check(kind)?;
    let written = match args.scene {
        Scene::Dodge => dodge::run(args, kind, device)?,
        Scene::Crowd => crowd::run(args, kind, device)?,
        Scene::Body => body::run(args, kind, device)?,
    };
    let path = args.out.display().to_string();
    Ok(Done::ok(if as_json {
        let mut document =
            json!({ "file": path, "bytes": written.bytes, "pictures": written.pictures });
        for (key, value) in written.more {
            document[key] = value;
        }
        Done::json(&document)
    } else {
        format!("{}{path}: {}\n", written.text, written.describe())
    }))
}

impl Args {
    fn rate(&self) -> u16 {
        self.rate.unwrap_or(25)
    }

    /// What can be refused before the graph is read: options of another scene or of another kind of file, and a file that cannot be written.
    fn check(&self, kind: file::Kind) -> Result<(), Failure> {
        output::check_can_be_written("--out", &self.out)?;
        self.mesh.check()?;
        if let Scene::Crowd = self.scene {
            self.graph.check_unused("render crowd")?;
        }
        let (of_dodge, of_crowd) = (self.dodge.given(), self.crowd.given());
        let of_dodge = of_dodge.map(|option| (option, "render dodge"));
        let of_crowd = of_crowd.map(|option| (option, "render crowd"));
        let (scene, wrong) = match self.scene {
            Scene::Dodge => ("dodge", of_crowd),
            Scene::Crowd => ("crowd", of_dodge),
            Scene::Body => {
                let own = [("--rate", self.rate.is_some()), ("--plain", self.plain)];
                let own = first_given(&own).map(|option| (option, "render dodge and render crowd"));
                ("body", of_dodge.or(of_crowd).or(own))
            }
        };
        if let Some((option, others)) = wrong {
            let what = format!("render {scene} takes no {option}; it is only for {others}");
            return Err(Failure::Usage(what));
        }
        if self.rate.is_some() {
            kind.check_rate(&self.out)?;
        }
        match self.dodge.of_a_picture() {
            Some(option) if kind.is_film() => Err(Failure::Usage(format!(
                "{option} draws a picture (.png); {} is a film",
                self.out.display()
            ))),
            _ => Ok(()),
        }
    }
}

/// A written file, for the report.
struct Written {
    bytes: usize,
    pictures: usize,
    /// Text of the report; each line ends with a line feed.
    text: String,
    more: Vec<(&'static str, serde_json::Value)>,
}

impl Written {
    fn describe(&self) -> String {
        let size = match self.bytes {
            few if few < 1_000_000 => format!("{:.0} kB", few as f64 / 1e3),
            many => format!("{:.2} MB", many as f64 / 1e6),
        };
        match self.pictures {
            1 => size,
            pictures => format!("{pictures} pictures, {size}"),
        }
    }
}
