//! `sabaki render`: draws scenes to files, without a window.

mod crowd;
mod dodge;
mod duel;

use std::path::{Path, PathBuf};

use sabaki::gpu::{Context, Culler, CullerDesc, GpuError, Memory};
use sabaki::maps::{BakedGraph, Baker};
use sabaki::query::cull::Overlap;
use sabaki::query::{Answer, CullPath};
use sabaki_app::Painter;
use sabaki_app::film::{Film, FilmError, png};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{CrowdShot, Shot};
use sabaki_fixtures::headless::Headless;
use sabaki_fixtures::throw::Throw;
use serde_json::{Value, json};

#[cfg(feature = "window")]
pub(crate) use crowd::CrowdArgs;

use super::culling::{self, DeviceArgs};
use super::mesh::{BoundOutfit, MeshArgs};
use super::numbers::whole;
use super::plot::Picture;
use super::{Done, Failure, cancel, output, sheet};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    scene: Scene,
}

#[derive(clap::Subcommand)]
enum Scene {
    /// A character that avoids an attack.
    Dodge(Box<dodge::Args>),
    /// Two characters that attack and avoid in turn.
    Duel(Box<duel::Args>),
    /// A column of ten thousand characters.
    Crowd(Box<crowd::Args>),
    /// The maps of the chosen evasion and of the attack, slab by slab: the device draws them with its stencil buffer, and its occlusion
    /// queries count what they share.
    Maps(Box<MapsArgs>),
}

/// The file and what is drawn into it.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Picture")]
struct OutArgs {
    /// File to write: a picture (.png) or a film (.gif, .apng).
    #[arg(long, value_name = "FILE", value_parser = output::file_to_write(&["png", "gif", "apng"]))]
    out: PathBuf,
    /// Size of a picture, in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x400", value_parser = size)]
    size: [u32; 2],
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Options of films.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Picture")]
struct FilmArgs {
    /// Pictures per second of a film.
    #[arg(long, value_name = "N", default_value_t = 25, value_parser = whole::<u16>(1..=50))]
    rate: u16,
    /// Leaves out the text.
    #[arg(long)]
    plain: bool,
}

#[derive(clap::Args)]
struct MapsArgs {
    #[command(flatten)]
    throw: dodge::ThrowArgs,
    /// File to write (.png).
    #[arg(long, value_name = "FILE", value_parser = output::file_to_write(&["png"]))]
    out: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Largest width and height of a picture, in pixels.
const MOST_PIXELS: u32 = 4096;
/// Pixels between the pictures of a sheet.
const GAP: u32 = 6;

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x');
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let fits = |sides: &[u32; 2]| sides.iter().all(|side| (16..=MOST_PIXELS).contains(side));
    sides
        .filter(fits)
        .ok_or_else(|| format!("not a size such as 640x400, each 16 to {MOST_PIXELS}"))
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    let written = match &args.scene {
        Scene::Dodge(args) => dodge::run(args),
        Scene::Duel(args) => duel::run(args),
        Scene::Crowd(args) => crowd::run(args),
        Scene::Maps(args) => maps(args),
    }?;
    Ok(Done::ok(match as_json {
        true => Done::json(&written.document),
        false => written.text,
    }))
}

/// The report on a written file.
struct Written {
    text: String,
    document: Value,
}

impl Written {
    /// Adds a line to the text, and the values to the document.
    fn with(mut self, line: &str, values: Value) -> Self {
        self.text += &format!("{line}\n");
        if let (Some(all), Value::Object(values)) = (self.document.as_object_mut(), values) {
            all.extend(values);
        }
        self
    }
}

fn maps(args: &MapsArgs) -> Result<Written, Failure> {
    let (baked, throw) = args.throw.load()?;
    let answer = dodge::answer(&baked, &throw);
    let (sheet, line, values) = match culling::open(&args.device)? {
        Ok(mut device) => {
            let drawn = maps_by_device(&mut device, &baked, &throw, &answer);
            let name = device.device_name().to_owned();
            culling::destroy(device);
            let (sheet, Overlap { body, evasion, .. }) = drawn?;
            let line = format!(
                "drawn by {name}, whose queries count {body} texels of body and attack, {evasion} of evasion and attack"
            );
            let values = json!({ "device": name, "body": body, "evasion": evasion });
            (sheet, line, values)
        }
        Err(why) => {
            let sheet = sheet::draw_answer(&baked, &throw, &answer, sheet::on_cpu)?;
            (sheet, format!("drawn on the CPU: {why}"), json!({}))
        }
    };
    let none = || Failure::Usage("no candidate for this attack has maps".to_owned());
    let (picture, shown) = sheet.ok_or_else(none)?;
    let of = match shown == answer.chosen {
        true => "the chosen motion".to_owned(),
        false => format!("candidate {shown}: the chosen motion has no maps"),
    };
    let written = write(&args.out, vec![picture], 0.0)?;
    let candidate = json!({ "candidate": shown, "is_chosen": shown == answer.chosen });
    Ok(written
        .with(&format!("maps of {of}"), candidate)
        .with(&line, values))
}

/// The sheet of the answer's maps, drawn by the device, and what its occlusion queries count.
fn maps_by_device(
    device: &mut Headless,
    baked: &BakedGraph,
    throw: &Throw,
    answer: &Answer,
) -> Result<(Option<(Picture, usize)>, Overlap), Failure> {
    let grid = baked.atlas().grid();
    let draw = |baker: &Baker| device.draw_maps(baker).map_err(failed);
    let baked = &baked.with_drawn_maps(grid, draw)?;
    let mut counts = Overlap::default();
    let sheet = sheet::draw_answer(baked, throw, answer, |input, drawings| {
        let desc = CullerDesc::new(CullPath::Stencil, baked.atlas());
        let make = |context: &Context, memory: &mut dyn Memory| Culler::new(context, memory, &desc);
        let mut culler = device.make(make).map_err(failed)?;
        let counted = device.cull(&mut culler, input);
        culler.destroy(device.memory().map_err(failed)?);
        counts = counted
            .map_err(failed)?
            .first()
            .copied()
            .unwrap_or_default();
        let attack =
            device.with_rasterizer(|device, rasterizer| device.any_frame(rasterizer, drawings));
        attack.map_err(failed)
    })?;
    Ok((sheet, counts))
}

impl OutArgs {
    /// Creates the device and what draws characters in an outfit, or of capsules.
    fn canvas_of(&self, outfit: Option<&BoundOutfit>) -> Result<Painter, Failure> {
        self.canvas(&StageDesc {
            meshes: outfit.map_or(&[], |bound| &bound.outfit.meshes),
            ..StageDesc::default()
        })
    }

    /// Creates the device and what draws.
    fn canvas(&self, desc: &StageDesc<'_>) -> Result<Painter, Failure> {
        let device = self.device.headless().map_err(failed)?;
        Painter::new(device, self.size, desc).map_err(failed)
    }

    /// Writes pictures as a film, or the only one; reports on the mesh and the file.
    fn write(
        &self,
        pictures: Vec<Picture>,
        delay: f64,
        outfit: Option<&BoundOutfit>,
    ) -> Result<Written, Failure> {
        let mut written = write(&self.out, pictures, delay)?;
        if let Some(outfit) = outfit {
            written.text.insert_str(0, &outfit.report);
            written.document["mesh"] = outfit.document.clone();
        }
        Ok(written)
    }
}

/// Writes pictures as a film, or the only one, by the ending of the file's name.
fn write(path: &Path, pictures: Vec<Picture>, delay: f64) -> Result<Written, Failure> {
    let count = pictures.len();
    let film = Film {
        size: pictures.first().map_or([0; 2], Picture::size),
        delay,
        pictures: pictures.into_iter().map(Picture::into_pixels).collect(),
    };
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    let encoded = match ending.as_ref().and_then(|ending| ending.to_str()) {
        Some("gif") => film.gif(),
        Some("apng") => film.apng(),
        _ => match film.pictures.first() {
            Some(picture) => png(film.size, picture),
            None => Err(FilmError::Empty),
        },
    };
    let bytes = encoded.map_err(std::io::Error::other);
    let bytes = bytes.map_err(Failure::file(path))?;
    cancel::check()?;
    output::write_file(path, &bytes)?;
    let file = path.display().to_string();
    Ok(Written {
        text: format!(
            "{file}: {}, {:.2} MB\n",
            output::counted(count, "picture"),
            bytes.len() as f64 * 1e-6
        ),
        document: json!({ "file": file, "bytes": bytes.len(), "pictures": count }),
    })
}

/// Whether a file is a film by the ending of its name.
fn is_film(path: &std::path::Path) -> bool {
    let ending = path.extension();
    !ending.is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}

/// Height of a line of text, in pixels, in pictures of this width.
fn text_height(width: u32) -> u32 {
    (width / 26).clamp(14, 32)
}

/// Draws a picture of each moment.
fn draw_all<T>(
    moments: Vec<T>,
    mut draw: impl FnMut(T) -> Result<Picture, Failure>,
) -> Result<Vec<Picture>, Failure> {
    let bar = output::progress("drawing", moments.len() as u64);
    let pictures = moments.into_iter().map(|moment| {
        cancel::check()?;
        let picture = draw(moment);
        bar.inc(1);
        picture
    });
    let pictures = pictures.collect();
    bar.finish_and_clear();
    pictures
}

/// Pictures of one size side by side, row by row.
fn on_a_sheet(pictures: &[Picture], columns: u32) -> Picture {
    let [width, height] = pictures.first().map_or([0; 2], Picture::size);
    let (width, height) = (width + GAP, height + GAP);
    let rows = (pictures.len() as u32).div_ceil(columns);
    let mut sheet = Picture::new([columns * width + GAP, rows * height + GAP]);
    for (index, picture) in (0..).zip(pictures) {
        let (column, row) = (index % columns, index / columns);
        sheet.place([GAP + column * width, GAP + row * height], picture);
    }
    sheet
}

fn paint(canvas: &mut Painter, shot: &Shot, crowd: Option<&CrowdShot>) -> Result<Picture, Failure> {
    let pixels = canvas.paint(shot, crowd).map_err(failed)?;
    Ok(Picture::from_rgba(canvas.size(), &pixels))
}

fn failed(error: GpuError) -> Failure {
    Failure::Device(format!("no picture can be drawn: {error}"))
}
