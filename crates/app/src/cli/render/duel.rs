//! Renders a duel: a film of its exchanges, or moments of each on a sheet.

use std::path::PathBuf;

use plotters::style::RGBColor;
use sabaki::anim::Clip;
use sabaki::duel::Exchange;
use sabaki::maps::BakedGraph;
use sabaki_app::film::{Delay, Film};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Cut, DuelPlayback, DuelPlaybackSettings, RecordedDuel};
use serde_json::{Value, json};

use super::canvas::Canvas;
use super::file::{self, Kind};
use super::{Written, size, text_height};
use crate::cli::culling::DeviceArgs;
use crate::cli::duel::{DuelRun, clip_of};
use crate::cli::mesh::MeshArgs;
use crate::cli::numbers::whole;
use crate::cli::picture::{Picture, TextLook};
use crate::cli::plot::INK;
use crate::cli::{Failure, cancel, output};

/// Options of the duel's pictures.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Film")]
pub(crate) struct DuelArgs {
    /// Draws the duel: a film of all exchanges (.gif, .apng), or a sheet with four moments of each of the first four (.png).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Size of a picture, in pixels.
    #[arg(long, value_name = "WxH", requires = "out", default_value = "480x300", value_parser = size)]
    size: [u32; 2],
    /// Pictures per second of a film [default: 20].
    #[arg(long, value_name = "N", requires = "out", value_parser = whole::<u16>(1..=50))]
    rate: Option<u16>,
    /// First exchange to draw, counted from 1.
    #[arg(long, value_name = "ROUND", requires = "out", default_value_t = 1, value_parser = whole::<u32>(1..=10_000))]
    from: u32,
    /// Leaves out the text.
    #[arg(long, requires = "out")]
    plain: bool,
    #[command(flatten)]
    mesh: MeshArgs,
}

const STRUCK: RGBColor = RGBColor(176, 34, 18);
const AVOIDED: RGBColor = RGBColor(20, 104, 52);
/// Number of exchanges on a sheet, and of moments of each.
const ROWS: u32 = 4;
const MOMENTS: u32 = 4;
/// Pixels between pictures.
const GAP: u32 = 6;

impl DuelArgs {
    /// Checks the file and the options of a duel of `rounds` rounds, before it starts.
    pub(crate) fn check(&self, rounds: u32) -> Result<(), Failure> {
        self.mesh.check()?;
        let from = self.from;
        match &self.out {
            None if self.mesh.is_given() => Err(Failure::Usage("--mesh needs --out".to_owned())),
            None => Ok(()),
            Some(_) if from > rounds => Err(Failure::Usage(format!(
                "--from {from}: there is no such exchange; --rounds is {rounds}"
            ))),
            Some(path) => {
                let kind = Kind::of(path)?;
                if self.rate.is_some() {
                    kind.check_rate(path)?;
                }
                output::check_can_be_written("--out", path)
            }
        }
    }

    /// Whether the duel is drawn.
    pub(crate) fn draws(&self) -> bool {
        self.out.is_some()
    }

    fn rate(&self) -> u16 {
        self.rate.unwrap_or(20)
    }

    /// Draws the duel if that is asked for. Returns the report as JSON and as text.
    pub(crate) fn draw(
        &self,
        baked: &BakedGraph,
        fought: &DuelRun,
        device: &DeviceArgs,
    ) -> Result<Option<(Value, String)>, Failure> {
        let Some(path) = &self.out else {
            return Ok(None);
        };
        let kind = Kind::of(path)?;
        let settings = DuelPlaybackSettings::default();
        let exchanges = &fought.exchanges;
        let graph = baked.graph();
        let bound_outfit = self.mesh.load(graph.skeleton(), graph.clips())?;
        let skins = bound_outfit
            .as_ref()
            .map(|bound_outfit| bound_outfit.outfit.skins.clone());
        let duel = RecordedDuel {
            baked,
            fighters: &fought.fighters,
            exchanges,
        };
        let playback = DuelPlayback::new(duel, &settings).with_skins(skins);
        let mut cuts = playback.cuts(self.size[0] as f32 / self.size[1] as f32);
        cuts.drain(..cuts.len().min(self.from as usize - 1));
        if cuts.is_empty() {
            let what = format!("there is no exchange {} to draw", self.from);
            return Err(Failure::Usage(what));
        }
        let show = Show {
            args: self,
            baked,
            exchanges,
            playback,
            cuts,
        };
        let desc = StageDesc {
            meshes: bound_outfit
                .as_ref()
                .map_or(&[], |bound_outfit| &bound_outfit.outfit.meshes),
            ..StageDesc::default()
        };
        let mut canvas = Canvas::new(device, self.size, &desc)?;
        let film = match kind.is_film() {
            true => show.film(&mut canvas)?,
            false => show.sheet(&mut canvas)?,
        };
        drop(canvas);
        let written = Written {
            bytes: file::write(path, kind, &film)?,
            pictures: film.pictures.len(),
            text: String::new(),
            more: Vec::new(),
        };
        let file = path.display();
        let document = json!({ "file": file.to_string(), "bytes": written.bytes, "pictures": written.pictures });
        Ok(Some((
            document,
            format!(
                "{}{file}: {}\n",
                bound_outfit.map_or_else(String::new, |bound_outfit| bound_outfit.report),
                written.describe()
            ),
        )))
    }
}

/// A duel and how it is drawn.
struct Show<'a> {
    args: &'a DuelArgs,
    baked: &'a BakedGraph,
    exchanges: &'a [Exchange],
    playback: DuelPlayback<'a>,
    cuts: Vec<Cut>,
}

impl Show<'_> {
    fn film(&self, canvas: &mut Canvas) -> Result<Film, Failure> {
        let rate = f32::from(self.args.rate());
        let moments = self.cuts.iter().flat_map(|cut| {
            let moments = self.playback.moments(cut, rate);
            moments.into_iter().map(move |t| (cut, t))
        });
        let moments: Vec<(&Cut, f32)> = moments.collect();
        let bar = output::progress("drawing", moments.len() as u64);
        let mut pictures = Vec::with_capacity(moments.len());
        for (cut, t) in moments {
            cancel::check()?;
            pictures.push(self.picture(cut, t, canvas)?.into_pixels());
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(Film {
            size: self.args.size,
            delay: Delay::of_rate(self.args.rate()),
            pictures,
        })
    }

    /// Draws a row for each exchange: before the attack, on its way, when it is nearest, and after it.
    fn sheet(&self, canvas: &mut Canvas) -> Result<Film, Failure> {
        let size = self.args.size;
        let rows = (self.cuts.len() as u32).min(ROWS);
        let whole = [
            MOMENTS * (size[0] + GAP) + GAP,
            rows * (size[1] + GAP) + GAP,
        ];
        let mut sheet = Picture::new(whole);
        for (row, cut) in (0..rows).zip(&self.cuts) {
            cancel::check()?;
            let exchange = &self.exchanges[cut.exchange];
            let near = self.playback.nearest_at(cut);
            let start = exchange.announced + exchange.attack.start();
            let moments = [
                0.5 * (cut.span[0] + start),
                start.max(near - 0.12),
                near,
                0.5 * (near + cut.span[1]),
            ];
            for (column, t) in (0..).zip(moments) {
                let picture = self.picture(cut, t, canvas)?;
                let at = [GAP + column * (size[0] + GAP), GAP + row * (size[1] + GAP)];
                sheet.place(at, &picture);
            }
        }
        Ok(Film {
            size: whole,
            delay: Delay::default(),
            pictures: vec![sheet.into_pixels()],
        })
    }

    fn picture(&self, cut: &Cut, t: f32, canvas: &mut Canvas) -> Result<Picture, Failure> {
        let mut picture = canvas.paint(&self.playback.shot(cut, t), None)?;
        if !self.args.plain {
            self.write_on(&mut picture, cut, t);
        }
        Ok(picture)
    }

    /// Writes the score, the attacker with the attack, and the outcome once the attack is over.
    fn write_on(&self, picture: &mut Picture, cut: &Cut, t: f32) {
        let height = text_height(self.args.size[0]);
        let exchange = &self.exchanges[cut.exchange];
        let is_over = t >= self.playback.nearest_at(cut);
        let mut hits = [0; 2];
        let over = self.exchanges[..cut.exchange + usize::from(is_over)].iter();
        for landed in over.filter(|exchange| !exchange.avoided) {
            hits[landed.attacker.index()] += 1;
        }
        let mut write = |line: u32, text: &str, colour| {
            let at = (10, (8 + line * height) as i32);
            picture.text(at, text, TextLook { height, colour });
        };
        write(0, &format!("white {} : {} blue", hits[0], hits[1]), INK);
        let attack = Clip::title(clip_of(self.baked, exchange.strike));
        let written = (t - exchange.announced >= 0.0).then_some(attack);
        if let Some(attack) = written {
            write(1, &format!("{}: {attack}", exchange.attacker.name()), INK);
        }
        if is_over {
            let centimetres = 100.0 * exchange.clearance.metres;
            match exchange.avoided {
                true => write(2, &format!("avoided by {centimetres:.1} cm"), AVOIDED),
                false => write(2, "hit", STRUCK),
            }
        }
    }
}
