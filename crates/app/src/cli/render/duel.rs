//! Renders a duel: a film of its exchanges, or moments of each on a sheet.

use std::sync::Arc;

use plotters::style::RGBColor;
use sabaki::anim::Clip;
use sabaki::maps::BakedGraph;
use sabaki_app::Painter;
use sabaki_app::play::{clip_of, score};
use sabaki_draw::scene::{Cut, DuelPlayback, Exchange};
use serde_json::json;

use super::{FilmArgs, OutArgs, Written, draw_all, is_film, on_a_sheet, paint, text_height};
use crate::cli::Failure;
use crate::cli::duel::{self, FightArgs};
use crate::cli::numbers::whole;
use crate::cli::plot::{INK, Picture};

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    fight: FightArgs,
    #[command(flatten)]
    out: OutArgs,
    #[command(flatten)]
    film: FilmArgs,
    /// First exchange to draw, counted from 1.
    #[arg(long, value_name = "ROUND", default_value_t = 1, value_parser = whole::<u32>(1..=10_000))]
    from: u32,
}

const STRUCK: RGBColor = RGBColor(176, 34, 18);
const AVOIDED: RGBColor = RGBColor(20, 104, 52);
/// Number of exchanges on a sheet, and of moments of each.
const ROWS: usize = 4;
const MOMENTS: u32 = 4;

pub(super) fn run(args: &Args) -> Result<Written, Failure> {
    let baked = Arc::new(args.fight.graph.load()?);
    let fought = duel::fight(&baked, &args.fight)?;
    let exchanges = &fought.fight.exchanges;
    let graph = baked.graph();
    let outfit = args
        .out
        .mesh
        .load(&args.fight.graph, graph.skeleton(), graph.clips())?;
    let playback = DuelPlayback::new(&baked, &fought.fight.played, exchanges)
        .with_skins(outfit.as_ref().map(|bound| bound.outfit.skins.clone()));
    let [width, height] = args.out.size;
    let mut cuts = playback.cuts(width as f32 / height as f32);
    cuts.drain(..cuts.len().min(args.from as usize - 1));
    if cuts.is_empty() {
        let what = format!("there is no exchange {} to draw", args.from);
        return Err(Failure::Usage(what));
    }
    let is_film = is_film(&args.out.out);
    let rate = f32::from(args.film.rate);
    let moments: Vec<(&Cut, f32)> = match is_film {
        true => {
            let all = cuts.iter().map(|cut| (cut, playback.moments(cut, rate)));
            all.flat_map(|(cut, moments)| moments.into_iter().map(move |t| (cut, t)))
                .collect()
        }
        false => {
            let shown = cuts.iter().take(ROWS);
            let moments = |cut: &Cut| sheet_moments(&playback, &exchanges[cut.exchange], cut);
            shown
                .flat_map(|cut| moments(cut).map(|t| (cut, t)))
                .collect()
        }
    };
    let mut canvas = args.out.canvas_of(outfit.as_ref())?;
    let mut pictures = draw_all(moments, |(cut, t)| {
        picture(args, &baked, exchanges, &playback, cut, t, &mut canvas)
    })?;
    drop(canvas);
    if !is_film {
        pictures = vec![on_a_sheet(&pictures, MOMENTS)];
    }
    let delay = 1.0 / f64::from(args.film.rate);
    let written = args.out.write(pictures, delay, outfit.as_ref())?;
    let values = json!({ "duel": duel::document(&baked, &fought) });
    Ok(written.with(&duel::score_line(&fought), values))
}

/// Before the attack, on its way, when it is nearest, and after it.
fn sheet_moments(playback: &DuelPlayback<'_>, exchange: &Exchange, cut: &Cut) -> [f32; 4] {
    let near = playback.nearest_at(cut);
    let start = exchange.span[0];
    [
        0.5 * (cut.span[0] + start),
        start.max(near - 0.12),
        near,
        0.5 * (near + cut.span[1]),
    ]
}

/// A picture with the score, the attacker with the attack, and the outcome once the attack is over.
fn picture(
    args: &Args,
    baked: &BakedGraph,
    exchanges: &[Exchange],
    playback: &DuelPlayback<'_>,
    cut: &Cut,
    t: f32,
    canvas: &mut Painter,
) -> Result<Picture, Failure> {
    let mut picture = paint(canvas, &playback.shot(cut, t), None)?;
    if args.film.plain {
        return Ok(picture);
    }
    let height = text_height(args.out.size[0]);
    let exchange = &exchanges[cut.exchange];
    let is_over = t >= playback.nearest_at(cut);
    let over = &exchanges[..cut.exchange + usize::from(is_over)];
    let [hits, _] = score(over);
    let mut write = |line: u32, text: &str, colour| {
        picture.text((10, (8 + line * height) as i32), text, height, colour);
    };
    write(0, &format!("white {} : {} blue", hits[0], hits[1]), INK);
    if t >= exchange.announced {
        let attack = Clip::title(clip_of(baked, exchange.attack));
        write(1, &format!("{}: {attack}", exchange.attacker_name()), INK);
    }
    if is_over {
        match exchange.clearance {
            Some(metres) if metres < 0.0 => write(2, "hit", STRUCK),
            Some(metres) => write(2, &format!("avoided by {:.1} cm", 100.0 * metres), AVOIDED),
            None => write(2, "avoided", AVOIDED),
        }
    }
    Ok(picture)
}
