//! Renders a crowd: a column of characters, posed straight into the memory that the device draws from.

use std::time::Instant;

use sabaki_app::percentile::percentile;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Formation, FormationSettings};
use serde_json::json;

use super::{FilmArgs, OutArgs, Written, draw_all, failed, is_film, paint, text_height};
use crate::cli::Failure;
use crate::cli::bake::{self, GraphArgs};
use crate::cli::mesh::{BoundOutfit, MeshArgs};
use crate::cli::numbers::whole;
use crate::cli::output::usage;
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
    #[command(flatten)]
    graph: GraphArgs,
    /// Motion of the crowd: one of the graph's clips. Default: the first; `front_kick` of the embedded ones.
    #[arg(long, value_name = "CLIP")]
    motion: Option<String>,
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
        let (skeleton, clips) = match self.graph.is_embedded() {
            true => {
                let (skeleton, clips, _) = bake::read_clips(&[], &Default::default())?;
                (skeleton, clips)
            }
            false => {
                let baked = self.graph.load_unprepared()?;
                let graph = baked.graph();
                (graph.skeleton().clone(), graph.clips().to_vec())
            }
        };
        let wanted = match (&self.motion, clips.first()) {
            (Some(motion), _) => motion.as_str(),
            (None, Some(first)) if !self.graph.is_embedded() => first.name(),
            _ => "front_kick",
        };
        let clip = clips.iter().find(|clip| clip.name() == wanted);
        let clip = clip.ok_or_else(|| {
            let names: Vec<_> = clips.iter().map(|clip| clip.name()).collect();
            usage(format!("no motion {wanted:?} among {}", names.join(", ")))
        })?;
        let settings = FormationSettings {
            count: self.count,
            ..FormationSettings::default()
        };
        let outfit = mesh.load(&self.graph, &skeleton, &clips)?;
        let outfit =
            outfit.ok_or_else(|| usage("a crowd is drawn with a mesh, not with capsules"))?;
        let formation =
            Formation::new(&skeleton, clip, &outfit.outfit.skins[0], &settings).map_err(usage)?;
        Ok((formation, outfit))
    }
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
        let poses = canvas.poses().map_err(failed)?;
        formation.pose(poses).map_err(usage)?;
        pose_ms.push(1e3 * begun.elapsed().as_secs_f64());
        let (shot, shown) = formation.shot(camera, size).map_err(usage)?;
        let begun = Instant::now();
        let mut picture = paint(&mut canvas, &shot, Some(&shown))?;
        draw_ms.push(1e3 * begun.elapsed().as_secs_f64());
        if !args.film.plain {
            picture.text((10, 8), &characters, text_height(size[0]), INK);
        }
        formation.advance(step);
        Ok(picture)
    })?;
    drop(canvas);
    let written = args.out.write(pictures, f64::from(step), Some(&outfit))?;
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
