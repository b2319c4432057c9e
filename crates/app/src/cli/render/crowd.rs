//! Renders a crowd: a column of characters, posed straight into the memory that the device draws from.

use std::fmt::Write;
use std::time::Instant;

use sabaki::graph::GraphError;
use sabaki::maps::Body;
use sabaki_app::film::{Delay, Film};
use sabaki_app::percentile::percentile;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Formation, FormationSettings, Performer};
use sabaki_fixtures::demo::{self, Motions};
use serde_json::json;

use super::canvas::Canvas;
use super::file::{self, Kind};
use super::{Args, Written, first_given, text_height};
use crate::cli::culling::DeviceArgs;
use crate::cli::mesh::BoundOutfit;
use crate::cli::numbers::whole;
use crate::cli::picture::{Picture, TextLook};
use crate::cli::plot::INK;
use crate::cli::{Failure, cancel, output};

/// Options of the crowd.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Crowd")]
pub(crate) struct CrowdArgs {
    /// Number of characters in the crowd [default: 10000].
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=200_000))]
    count: Option<u32>,
    /// Motion of the crowd: one of the embedded clips [default: front_kick].
    #[arg(long, value_name = "CLIP")]
    motion: Option<String>,
    /// Draws all characters with all joints.
    #[arg(long)]
    no_levels: bool,
    /// Draws each character in the colour of its level of detail.
    #[arg(long)]
    levels: bool,
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::Usage(error.to_string())
}

pub(super) fn run(args: &Args, kind: Kind, device: &DeviceArgs) -> Result<Written, Failure> {
    let motions = demo::motions().map_err(GraphError::from)?;
    let bound_outfit = args.mesh.load(&motions.skeleton, &motions.clips)?;
    let mut formation = args.crowd.formation(&motions, bound_outfit.as_ref())?;
    let desc = StageDesc {
        meshes: bound_outfit
            .as_ref()
            .map_or(&[], |bound_outfit| &bound_outfit.outfit.meshes),
        shadow_side: 4096,
        max_members: args.crowd.count(),
        max_crowd_len: formation.max_output_len() as u32,
        max_parts: formation.parts() as u32,
        ..StageDesc::default()
    };
    let mut canvas = Canvas::new(device, args.size, &desc)?;
    let pictures = match kind.is_film() {
        true => (formation.period() * f32::from(args.rate()))
            .round()
            .max(1.0) as u32,
        false => 1,
    };
    let step = formation.period() / pictures as f32;
    let bar = output::progress("drawing", u64::from(pictures));
    let mut film = Film {
        size: args.size,
        delay: Delay::of_seconds(step),
        pictures: Vec::new(),
    };
    let mut times = Times::default();
    for _ in 0..pictures {
        cancel::check()?;
        let picture = times.picture(args, &mut formation, &mut canvas)?;
        film.pictures.push(picture.into_pixels());
        formation.advance(step);
        bar.inc(1);
    }
    bar.finish_and_clear();
    drop(canvas);
    let bytes = file::write(&args.out, kind, &film)?;
    let census = formation.census();
    let mut text = bound_outfit.map_or_else(String::new, |bound_outfit| bound_outfit.report);
    let _ = writeln!(
        text,
        "{}; on each of {} levels: {census:?}",
        characters(formation.len()),
        formation.levels()
    );
    let [pose, draw] = [times.pose, times.draw].map(|times| percentile(times, 0.5));
    let _ = writeln!(
        text,
        "a picture, median: {pose:.2} ms to pose, {draw:.1} ms until it is drawn and read back"
    );
    Ok(Written {
        bytes,
        pictures: film.pictures.len(),
        text,
        more: vec![
            ("pose_ms", json!(pose)),
            ("draw_ms", json!(draw)),
            ("characters", json!(formation.len())),
            ("levels", json!(census)),
        ],
    })
}

impl CrowdArgs {
    /// The first option of the crowd that is given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--count", self.count.is_some()),
            ("--motion", self.motion.is_some()),
            ("--no-levels", self.no_levels),
            ("--levels", self.levels),
        ];
        first_given(&options)
    }

    fn count(&self) -> u32 {
        self.count.unwrap_or(10_000)
    }

    fn formation(
        &self,
        motions: &Motions,
        bound_outfit: Option<&BoundOutfit>,
    ) -> Result<Formation, Failure> {
        let name = self.motion.as_deref().unwrap_or("front_kick");
        let clip = motions.clips.iter().find(|clip| clip.name() == name);
        let clip = clip.ok_or_else(|| {
            let names: Vec<_> = motions.clips.iter().map(|clip| clip.name()).collect();
            usage(format!("no motion {name:?} among {}", names.join(", ")))
        })?;
        let settings = FormationSettings {
            count: self.count(),
            ..FormationSettings::default()
        };
        let body = Body::from_bones(&motions.skeleton);
        let performer = Performer {
            skeleton: &motions.skeleton,
            body: &body,
            clip,
            skin: bound_outfit.map(|bound_outfit| &*bound_outfit.outfit.skins[0]),
        };
        let mut formation = Formation::new(performer, &settings).map_err(usage)?;
        formation.use_levels(!self.no_levels);
        formation.show_levels(self.levels);
        Ok(formation)
    }
}

fn characters(count: usize) -> String {
    match count {
        1 => "1 character".to_owned(),
        count => format!("{count} characters"),
    }
}

/// Milliseconds that each picture took.
#[derive(Default)]
struct Times {
    pose: Vec<f64>,
    draw: Vec<f64>,
}

impl Times {
    /// Draws a picture and adds how long it took.
    fn picture(
        &mut self,
        args: &Args,
        formation: &mut Formation,
        canvas: &mut Canvas,
    ) -> Result<Picture, Failure> {
        let camera = formation.camera();
        let begun = Instant::now();
        formation.look_from(&camera, args.size).map_err(usage)?;
        formation.pose(canvas.poses()?).map_err(usage)?;
        self.pose.push(1e3 * begun.elapsed().as_secs_f64());
        let (shot, shown) = formation.shot(camera, args.size).map_err(usage)?;
        let begun = Instant::now();
        let mut picture = canvas.paint(&shot, Some(&shown))?;
        self.draw.push(1e3 * begun.elapsed().as_secs_f64());
        if !args.plain {
            let look = TextLook {
                height: text_height(args.size[0]),
                colour: INK,
            };
            picture.text((10, 8), &characters(formation.len()), look);
        }
        Ok(picture)
    }
}
