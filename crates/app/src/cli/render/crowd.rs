//! Renders a crowd: a column of characters, posed straight into the memory that the device draws from.

use std::time::Instant;

use sabaki::graph::GraphError;
use sabaki_app::film::Delay;
use sabaki_app::percentile::percentile;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Formation, FormationSettings};
use sabaki_fixtures::demo;
use serde_json::json;

use super::{FilmArgs, OutArgs, Written, draw_all, is_film, text_height};
use crate::cli::Failure;
use crate::cli::mesh::{BoundOutfit, MeshArgs};
use crate::cli::numbers::whole;
use crate::cli::plot::INK;

#[derive(clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    out: OutArgs,
    #[command(flatten)]
    film: FilmArgs,
    #[command(flatten)]
    crowd: CrowdArgs,
}

/// A column of characters.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Crowd")]
pub(crate) struct CrowdArgs {
    /// Number of characters.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = whole::<u32>(1..=200_000))]
    count: u32,
    /// Motion of the crowd: one of the embedded clips.
    #[arg(long, value_name = "CLIP", default_value = "front_kick")]
    motion: String,
    /// Draws all characters with all joints.
    #[arg(long)]
    pub(crate) no_levels: bool,
    /// Draws each character in the colour of its level of detail.
    #[arg(long)]
    pub(crate) levels: bool,
}

impl CrowdArgs {
    /// The column, and the mesh of its characters.
    pub(crate) fn formation(&self, mesh: &MeshArgs) -> Result<(Formation, BoundOutfit), Failure> {
        let motions = demo::motions().map_err(GraphError::from)?;
        let clip = motions.clips.iter().find(|clip| clip.name() == self.motion);
        let clip = clip.ok_or_else(|| {
            let names: Vec<_> = motions.clips.iter().map(|clip| clip.name()).collect();
            usage(format!(
                "no motion {:?} among {}",
                self.motion,
                names.join(", ")
            ))
        })?;
        let settings = FormationSettings {
            count: self.count,
            ..FormationSettings::default()
        };
        let outfit = mesh.load(&motions.skeleton, &motions.clips)?;
        let outfit =
            outfit.ok_or_else(|| usage("a crowd is drawn with a mesh, not with capsules"))?;
        let formation = Formation::new(&motions.skeleton, clip, &outfit.outfit.skins[0], &settings)
            .map_err(usage)?;
        Ok((formation, outfit))
    }
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::Usage(error.to_string())
}

pub(super) fn run(args: &Args) -> Result<Written, Failure> {
    let (mut formation, outfit) = args.crowd.formation(&args.out.mesh)?;
    formation.use_levels(!args.crowd.no_levels);
    formation.show_levels(args.crowd.levels);
    let desc = StageDesc::for_crowd(&formation, &outfit.outfit.meshes);
    let mut canvas = args.out.canvas(&desc)?;
    let count = match is_film(&args.out.out) {
        true => (formation.period() * f32::from(args.film.rate))
            .round()
            .max(1.0) as usize,
        false => 1,
    };
    let (step, size) = (formation.period() / count as f32, args.out.size);
    let characters = match formation.len() {
        1 => "1 character".to_owned(),
        count => format!("{count} characters"),
    };
    // Milliseconds of each picture.
    let (mut pose_ms, mut draw_ms) = (Vec::new(), Vec::new());
    let pictures = draw_all(vec![(); count], |()| {
        let camera = formation.camera();
        let begun = Instant::now();
        formation.look_from(&camera, size).map_err(usage)?;
        formation.pose(canvas.poses()?).map_err(usage)?;
        pose_ms.push(1e3 * begun.elapsed().as_secs_f64());
        let (shot, shown) = formation.shot(camera, size).map_err(usage)?;
        let begun = Instant::now();
        let mut picture = canvas.paint(&shot, Some(&shown))?;
        draw_ms.push(1e3 * begun.elapsed().as_secs_f64());
        if !args.film.plain {
            picture.text((10, 8), &characters, text_height(size[0]), INK);
        }
        formation.advance(step);
        Ok(picture)
    })?;
    drop(canvas);
    let delay = Delay::of_seconds(step);
    let written = args.out.write(pictures, delay, Some(&outfit))?;
    let census = formation.census();
    let [pose, draw] = [pose_ms, draw_ms].map(|times| percentile(times, 0.5));
    let line = format!(
        "{characters}; on each of {} levels: {census:?}\n\
         a picture, median: {pose:.2} ms to pose, {draw:.1} ms until it is drawn and read back",
        formation.levels()
    );
    let values = json!({
        "pose_ms": pose,
        "draw_ms": draw,
        "characters": formation.len(),
        "levels": census,
    });
    Ok(written.with(&line, values))
}
