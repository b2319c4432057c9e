//! Renders a dodge: a film, one moment, or eight moments on a sheet.

use std::path::PathBuf;

use glam::Vec2;
use plotters::style::RGBColor;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings};
use sabaki_app::Painter;
use sabaki_draw::scene::{Camera, Dodge, DodgeSettings};
use sabaki_fixtures::throw::Throw;
use serde_json::json;

use super::{FilmArgs, OutArgs, Written, draw_all, is_film, on_a_sheet, paint, text_height};
use crate::cli::Failure;
use crate::cli::bake::GraphArgs;
use crate::cli::numbers::{number, whole};
use crate::cli::plot::{INK, Picture};
use crate::cli::queries::{file_throw, random_throws};

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    throw: ThrowArgs,
    #[command(flatten)]
    out: OutArgs,
    #[command(flatten)]
    film: FilmArgs,
    /// Draws one moment, in seconds since the query. Default of a .png: when the attack is nearest.
    #[arg(long, value_name = "SECONDS", value_parser = number(-600.0..=600.0))]
    at: Option<f32>,
    /// Draws eight moments on one sheet, with the clearance at each.
    #[arg(long, conflicts_with = "at")]
    storyboard: bool,
    /// Draws the slabs' maps at their heights: body green, attack red, evasion blue.
    #[arg(long)]
    maps: bool,
    /// Leaves out the ghost of the character that does not dodge.
    #[arg(long)]
    no_ghost: bool,
}

/// One attack on a character of a graph.
#[derive(clap::Args)]
pub(super) struct ThrowArgs {
    #[command(flatten)]
    graph: GraphArgs,
    /// Seed of the random attacks; `sabaki dodge` throws the same balls.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Index of the attack [default: 2; with --attack 0].
    #[arg(long, value_name = "INDEX", value_parser = whole::<u64>(0..=1_000_000_000))]
    index: Option<u64>,
    /// Attack file (JSON) instead of random attacks. The character stands in the graph's first pose.
    #[arg(long, value_name = "FILE", conflicts_with = "seed")]
    attack: Option<PathBuf>,
}

impl ThrowArgs {
    pub(super) fn load(&self) -> Result<(BakedGraph, Throw), Failure> {
        let baked = self.graph.load()?;
        let throw = match &self.attack {
            Some(path) => file_throw(&baked, path, self.index.unwrap_or(0))?,
            None => {
                let index = self.index.unwrap_or(2);
                random_throws(&baked, self.seed, index..index + 1)?.swap_remove(0)
            }
        };
        Ok((baked, throw))
    }
}

/// Answers an attack with the default settings.
pub(super) fn answer(baked: &BakedGraph, throw: &Throw) -> Answer {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let settings = QuerySettings::default();
    Query::new(baked, &settings).answer(throw.request(), &mut context, &mut answer);
    answer
}

/// Moments in a row of a storyboard.
const ABREAST: u32 = 4;

const NEAR: RGBColor = RGBColor(176, 34, 18);

pub(super) fn run(args: &Args) -> Result<Written, Failure> {
    let (baked, throw) = args.throw.load()?;
    let answer = answer(&baked, &throw);
    let settings = DodgeSettings {
        ghost: !args.no_ghost,
        ..DodgeSettings::default()
    };
    let graph = baked.graph();
    let outfit = args
        .out
        .mesh
        .load(&args.throw.graph, graph.skeleton(), graph.clips())?;
    let skin = outfit.as_ref().map(|bound| bound.outfit.skins[0].clone());
    let dodge =
        Dodge::new(&baked, throw.playhead, &throw.attack, &answer, &settings).with_skin(skin);
    let [width, height] = args.out.size;
    let camera = dodge.camera(width as f32 / height as f32);
    let mut canvas = args.out.canvas_of(outfit.as_ref())?;
    let near = dodge.clearance();
    let moments = match args.at {
        _ if args.storyboard => storyboard(near.time, &throw.attack),
        Some(at) => vec![at],
        None if is_film(&args.out.out) => dodge.moments(f32::from(args.film.rate)),
        None => vec![near.time],
    };
    let mut pictures = draw_all(moments, |t| picture(args, &dodge, camera, t, &mut canvas))?;
    drop(canvas);
    if args.storyboard {
        pictures = vec![on_a_sheet(&pictures, ABREAST)];
    }
    let delay = 1.0 / f64::from(args.film.rate);
    let written = args.out.write(pictures, delay, outfit.as_ref())?;
    let evasion = evasion(&answer);
    let line = format!(
        "the attack is {}avoided ({evasion}); nearest at {:.2} s: {:.1} cm",
        if answer.avoided { "" } else { "NOT " },
        near.time,
        near.metres * 100.0
    );
    let values = json!({
        "avoided": answer.avoided,
        "evasion": evasion,
        "clearance": near.metres,
        "nearest_at": near.time,
    });
    Ok(written.with(&line, values))
}

/// How the chosen motion comes to its evasion.
fn evasion(answer: &Answer) -> &'static str {
    match answer.candidates.get(answer.chosen) {
        Some(chosen) if chosen.layer.is_some() => "layered evasion",
        Some(chosen) if chosen.entry.is_some() => "entered evasion",
        Some(chosen) if chosen.evasion.is_some() => "evasion by a path",
        _ => "no evasion",
    }
}

/// Eight moments from the throw to the end of the flight, denser around the nearest one.
fn storyboard(near: f32, attack: &Attack) -> Vec<f32> {
    let (start, end) = (attack.start(), attack.end());
    let (before, after) = (near - start, end - near);
    let shares = [-1.0, -0.62, -0.34, -0.14, 0.0, 0.22, 0.55, 1.0];
    let moments = shares.map(|share| near + share * if share < 0.0 { before } else { after });
    moments.map(|t| t.clamp(start, end)).to_vec()
}

fn picture(
    args: &Args,
    dodge: &Dodge<'_>,
    camera: Camera,
    t: f32,
    canvas: &mut Painter,
) -> Result<Picture, Failure> {
    let mut shot = dodge.shot(t, camera);
    if args.maps {
        dodge.add_maps(t, &mut shot);
    }
    let mut picture = paint(canvas, &shot, None)?;
    if args.film.plain {
        return Ok(picture);
    }
    // The time, and the clearance when the attack is near.
    let height = text_height(args.out.size[0]);
    picture.text((10, 8), &format!("{t:+.2} s"), height, INK);
    // In a film a number that changes too fast to read would only flicker.
    let shown = |metres: f32| metres < 0.6 || args.storyboard;
    let nearest = dodge.nearest(t);
    if let Some(nearest) = nearest.filter(|nearest| shown(nearest.metres)) {
        let text = format!("{:.1} cm", nearest.metres * 100.0);
        let colour = if nearest.metres < 0.1 { NEAR } else { INK };
        picture.text((10, 8 + height as i32), &text, height, colour);
        let seen = |place| camera.pixel(place, args.out.size);
        if let (Some(from), Some(to)) = (seen(nearest.body), seen(nearest.attack)) {
            let point = |at: Vec2| (at.x as i32, at.y as i32);
            picture.line(point(from), point(to), colour);
        }
    }
    Ok(picture)
}
