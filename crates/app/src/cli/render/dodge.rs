//! Renders a dodge: a film, one moment, or eight moments on a sheet.

use std::fmt::Write;
use std::path::PathBuf;

use glam::Vec2;
use plotters::style::RGBColor;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings};
use sabaki_app::film::{Delay, Film};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{AnsweredAttack, Camera, Dodge, DodgeSettings, MapStyle};
use sabaki_fixtures::balls::{BallSettings, BallThrower};
use sabaki_fixtures::throw::{RandomDraw, Throw, ThrowSettings, throw};
use serde_json::json;

use super::canvas::Canvas;
use super::file::{self, Kind};
use super::{Args, Written, first_given, text_height};
use crate::cli::culling::DeviceArgs;
use crate::cli::numbers::whole;
use crate::cli::picture::{Picture, TextLook};
use crate::cli::plot::INK;
use crate::cli::{Failure, cancel, output};

/// Options of the dodge.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Dodge")]
pub(crate) struct DodgeArgs {
    /// Seed of the random attacks; `sabaki dodge` throws the same balls [default: 1].
    #[arg(long, value_name = "S", value_parser = whole::<u64>(0..=u64::MAX))]
    seed: Option<u64>,
    /// Index of the attack [default: 2; with --attack 0].
    #[arg(long, value_name = "INDEX", value_parser = whole::<u64>(0..=u64::MAX))]
    index: Option<u64>,
    /// Throws the balls of `sabaki coverage --by-time` instead, which hit so long after the query.
    #[arg(long, value_name = "SECONDS", value_parser = contact_parser, conflicts_with = "attack")]
    contact: Option<f32>,
    /// Attack file (JSON) instead of random attacks; the character stands in the graph's first pose.
    #[arg(long, value_name = "FILE", conflicts_with = "seed")]
    attack: Option<PathBuf>,
    /// Moment of the picture, in seconds since the query. Default: when the attack is nearest.
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, value_parser = moment_parser)]
    at: Option<f32>,
    /// Draws eight moments on one sheet, with the clearance at each.
    #[arg(long, conflicts_with = "at")]
    storyboard: bool,
    /// Draws the slabs' maps at their heights: body green, attack red, evasion blue.
    #[arg(long)]
    maps: bool,
    /// Draws the maps of all slabs together on the ground.
    #[arg(long, conflicts_with = "maps")]
    regions: bool,
    /// Leaves out the ghost of the character that does not dodge.
    #[arg(long)]
    no_ghost: bool,
}

fn contact_parser(text: &str) -> Result<f32, String> {
    let seconds: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    match (0.1..=10.0).contains(&seconds) {
        true => Ok(seconds),
        false => Err("must be 0.1 to 10 s".to_owned()),
    }
}

fn moment_parser(text: &str) -> Result<f32, String> {
    let seconds: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    match seconds.abs() <= 600.0 {
        true => Ok(seconds),
        false => Err("must be -600 to 600 s".to_owned()),
    }
}

/// Moments in a row of a storyboard.
const ABREAST: u32 = 4;
/// Pixels between pictures.
const GAP: u32 = 6;

const NEAR: RGBColor = RGBColor(176, 34, 18);

pub(super) fn run(args: &Args, kind: Kind, device: &DeviceArgs) -> Result<Written, Failure> {
    let baked = args.graph.load()?;
    let thrown = args.dodge.throw(&baked.graph)?;
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let settings = QuerySettings::default();
    let query = Query::new(&baked.graph, &settings);
    query.answer(thrown.request(), &mut context, &mut answer);
    let settings = DodgeSettings {
        ghost: !args.dodge.no_ghost,
        ..DodgeSettings::default()
    };
    let answered = AnsweredAttack {
        playhead: thrown.playhead,
        attack: &thrown.attack,
        answer: &answer,
    };
    let graph = baked.graph.graph();
    let bound_outfit = args.mesh.load(graph.skeleton(), graph.clips())?;
    let skin = bound_outfit
        .as_ref()
        .map(|bound_outfit| bound_outfit.outfit.skins[0].clone());
    let dodge = Dodge::new(&baked.graph, answered, &settings).with_skin(skin);
    let [width, height] = args.size;
    let show = Show {
        camera: dodge.camera(width as f32 / height as f32),
        dodge,
        args,
    };
    let desc = StageDesc {
        meshes: bound_outfit
            .as_ref()
            .map_or(&[], |bound_outfit| &bound_outfit.outfit.meshes),
        ..StageDesc::default()
    };
    let mut canvas = Canvas::new(device, args.size, &desc)?;
    let film = match kind.is_film() {
        true => show.film(&mut canvas)?,
        false if args.dodge.storyboard => show.storyboard(&mut canvas)?,
        false => show.still(&mut canvas)?,
    };
    drop(canvas);
    let bytes = file::write(&args.out, kind, &film)?;
    let clearance = show.dodge.clearance();
    let (mut text, mesh) = match bound_outfit {
        Some(bound_outfit) => (bound_outfit.report, bound_outfit.document),
        None => Default::default(),
    };
    let evasion = evasion(&answer);
    let _ = writeln!(
        text,
        "the attack is {} ({evasion}); nearest at {:.2} s: {:.1} cm",
        if answer.avoided {
            "avoided"
        } else {
            "NOT avoided"
        },
        clearance.time,
        clearance.metres * 100.0
    );
    Ok(Written {
        bytes,
        pictures: film.pictures.len(),
        text,
        more: vec![
            ("avoided", json!(answer.avoided)),
            ("evasion", json!(evasion)),
            ("clearance", json!(clearance.metres)),
            ("nearest_at", json!(clearance.time)),
            ("mesh", mesh),
        ],
    })
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

impl DodgeArgs {
    /// The first option of the dodge that is given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--seed", self.seed.is_some()),
            ("--index", self.index.is_some()),
            ("--contact", self.contact.is_some()),
            ("--attack", self.attack.is_some()),
            ("--maps", self.maps),
            ("--regions", self.regions),
            ("--no-ghost", self.no_ghost),
        ];
        first_given(&options).or(self.of_a_picture())
    }

    /// The first option that is given of those that a film does not take.
    pub(super) fn of_a_picture(&self) -> Option<&'static str> {
        first_given(&[
            ("--at", self.at.is_some()),
            ("--storyboard", self.storyboard),
        ])
    }

    fn draw(&self) -> RandomDraw {
        let index = if self.attack.is_some() { 0 } else { 2 };
        RandomDraw {
            seed: self.seed.unwrap_or(1),
            index: self.index.unwrap_or(index),
        }
    }

    fn throw(&self, baked: &BakedGraph) -> Result<Throw, Failure> {
        let draw = self.draw();
        let index = draw.index as usize;
        let wrong = |error| Failure::Attack { index, error };
        if let Some(contact) = self.contact {
            let thrower = BallThrower::new(baked, BallSettings::default());
            let thrown = thrower.throw(contact, draw).map_err(wrong)?;
            let none = || Failure::Usage(format!("no ball {index} would hit"));
            return thrown.map(|thrown| thrown.throw).ok_or_else(none);
        }
        let Some(path) = &self.attack else {
            let settings = ThrowSettings::default();
            return throw(baked, &settings, draw.seed, draw.index).map_err(wrong);
        };
        let mut attacks = sabaki_import::AttackFile::read(path)?.attacks;
        if index >= attacks.len() {
            let what = format!("there is no attack {index} among {}", attacks.len());
            return Err(Failure::Usage(what).within(path));
        }
        let spheres = attacks.swap_remove(index).spheres;
        Ok(Throw {
            playhead: Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY),
            attack: Attack::new(spheres).map_err(|error| wrong(error).within(path))?,
        })
    }
}

/// A dodge and how it is drawn.
struct Show<'a> {
    dodge: Dodge<'a>,
    args: &'a Args,
    camera: Camera,
}

impl Show<'_> {
    fn still(&self, canvas: &mut Canvas) -> Result<Film, Failure> {
        let t = self.args.dodge.at.unwrap_or(self.dodge.clearance().time);
        let picture = self.picture(t, canvas)?;
        Ok(self.film_of(vec![picture.into_pixels()]))
    }

    fn film(&self, canvas: &mut Canvas) -> Result<Film, Failure> {
        let moments = self.dodge.moments(f32::from(self.args.rate()));
        let bar = output::progress("drawing", moments.len() as u64);
        let mut pictures = Vec::with_capacity(moments.len());
        for t in moments {
            cancel::check()?;
            pictures.push(self.picture(t, canvas)?.into_pixels());
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(self.film_of(pictures))
    }

    fn film_of(&self, pictures: Vec<Vec<u8>>) -> Film {
        Film {
            size: self.args.size,
            delay: Delay::of_rate(self.args.rate()),
            pictures,
        }
    }

    /// Eight moments from the throw to the end of the flight, denser around the nearest one.
    fn storyboard(&self, canvas: &mut Canvas) -> Result<Film, Failure> {
        let (near, [start, end]) = (self.dodge.clearance().time, self.dodge.flight());
        let (before, after) = (near - start, end - near);
        let shares = [-1.0, -0.62, -0.34, -0.14, 0.0, 0.22, 0.55, 1.0];
        let size = self.args.size;
        let rows = (shares.len() as u32).div_ceil(ABREAST);
        let whole = [
            ABREAST * (size[0] + GAP) + GAP,
            rows * (size[1] + GAP) + GAP,
        ];
        let mut sheet = Picture::new(whole);
        let bar = output::progress("drawing", shares.len() as u64);
        for (index, share) in (0..).zip(shares) {
            cancel::check()?;
            let t = near + share * if share < 0.0 { before } else { after };
            let picture = self.picture(t.clamp(start, end), canvas)?;
            let (column, row) = (index % ABREAST, index / ABREAST);
            let at = [GAP + column * (size[0] + GAP), GAP + row * (size[1] + GAP)];
            sheet.place(at, &picture);
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(Film {
            size: whole,
            ..self.film_of(vec![sheet.into_pixels()])
        })
    }

    fn picture(&self, t: f32, canvas: &mut Canvas) -> Result<Picture, Failure> {
        let mut shot = self.dodge.shot(t, self.camera);
        let DodgeArgs { maps, regions, .. } = self.args.dodge;
        if maps {
            self.dodge.add_maps(t, MapStyle::Heights, &mut shot);
        }
        if regions {
            self.dodge.add_maps(t, MapStyle::Ground, &mut shot);
        }
        let mut picture = canvas.paint(&shot, None)?;
        if !self.args.plain {
            self.write_on(&mut picture, t);
        }
        Ok(picture)
    }

    /// Writes the time, and the clearance when the attack is near.
    fn write_on(&self, picture: &mut Picture, t: f32) {
        let height = text_height(self.args.size[0]);
        let look = |colour| TextLook { height, colour };
        picture.text((10, 8), &format!("{t:+.2} s"), look(INK));
        // In a film a number that changes too fast to read would only flicker.
        let shown = |metres: f32| metres < 0.6 || self.args.dodge.storyboard;
        let Some(nearest) = self
            .dodge
            .nearest(t)
            .filter(|nearest| shown(nearest.metres))
        else {
            return;
        };
        let text = format!("{:.1} cm", nearest.metres * 100.0);
        let colour = if nearest.metres < 0.1 { NEAR } else { INK };
        picture.text((10, 8 + height as i32), &text, look(colour));
        let seen = |place| self.camera.pixel(place, self.args.size);
        if let (Some(from), Some(to)) = (seen(nearest.body), seen(nearest.attack)) {
            let point = |at: Vec2| (at.x as i32, at.y as i32);
            picture.line(point(from), point(to), colour);
        }
    }
}
