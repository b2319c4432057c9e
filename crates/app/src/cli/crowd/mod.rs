//! `sabaki crowd`: how long a crowd takes to be posed, before levels of detail and after, on every instruction set and
//! number of threads, in one run.

mod beginning;
mod budget_run;
mod busy;
mod cases;
mod held;
mod row;
mod rows;
mod scene;

use std::path::PathBuf;

use indicatif::ProgressIterator;
use sabaki::anim::{Clip, Skeleton};
use sabaki::crowd::Form;
use sabaki_fixtures::demo;
use serde_json::json;

use self::cases::CUTS;
use self::scene::Scene;
use super::bake::own_file;
use super::numbers::{check_number, whole};
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// BVH or glTF file, or a folder of them for one skeleton. Default: the embedded motions.
    #[arg(value_name = "CLIP")]
    clip: Option<PathBuf>,
    /// Number of characters.
    #[arg(long, default_value_t = 10_000, value_parser = whole::<u32>(1..=4_000_000))]
    count: u32,
    /// Largest number of threads; 0 for all of the machine. A crowd uses 64 at most.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Number of frames measured in each case; the median counts.
    #[arg(long, default_value_t = 100, value_parser = whole::<u32>(1..=100_000))]
    frames: u32,
    /// Largest error on the screen where levels depend on distance, in pixels at 1080 lines and 60 degrees.
    #[arg(long, value_name = "PIXELS", default_value_t = 2.0)]
    error: f32,
    /// Milliseconds that a frame may take while the camera runs through the crowd. Default: twice the time of a frame with levels by `--error`.
    #[arg(long, value_name = "MILLISECONDS")]
    budget: Option<f32>,
    /// Writes quaternions and positions instead of matrices.
    #[arg(long)]
    rotations: bool,
    /// Seed of the characters' phases.
    #[arg(long, default_value_t = 5, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    args.check()?;
    cancel::listen();
    let scene = Scene::new(args, None)?;
    let cut_scenes = CUTS
        .into_iter()
        .map(|clips| Scene::new(args, Some(clips)))
        .collect::<Result<Vec<_>, _>>()?;
    let cases = args.cases(scene.animations.levels());
    let bar = output::progress("posing", cases.len() as u64);
    let mut rows = Vec::with_capacity(cases.len());
    for case in cases.into_iter().progress_with(bar) {
        cancel::check()?;
        let cut = CUTS.iter().position(|&clips| Some(clips) == case.cut);
        let scene = match cut.map(|index| &cut_scenes[index]) {
            Some(cut) => cut,
            None => &scene,
        };
        rows.push(scene.measure(args, case)?);
    }
    let beginning = scene.measure_beginning(args)?;
    let budget = scene.run_in_budget(args, &rows)?;
    Ok(Done::ok(if as_json {
        Done::json(&json!({
            "rows": rows.iter().map(|row| row.to_json(args, &rows)).collect::<Vec<_>>(),
            "clips": scene.animations.clips(),
            "levels": scene.animations.levels(),
            "key_bytes": scene.animations.bytes(),
            "error_pixels": args.error,
            "beginning": beginning.to_json(),
            "budget": budget.to_json(),
        }))
    } else {
        let table = rows::describe(args, &scene, &rows);
        format!("{table}{}\n{}\n", beginning.describe(), budget.describe())
    }))
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::Usage(error.to_string())
}

impl Args {
    /// What can be refused before the clips are read.
    fn check(&self) -> Result<(), Failure> {
        if let Some(path) = &self.clip {
            own_file::check_is_none(path)?;
        }
        check_number(self.error > 0.0, || {
            format!("--error {}: must be above 0 pixels", self.error)
        })?;
        let budget = self.budget.unwrap_or_default();
        check_number(budget.is_finite() && budget >= 0.0, || {
            format!("--budget {budget}: must be 0 milliseconds or more")
        })
    }

    fn form(&self) -> Form {
        match self.rotations {
            true => Form::Rotations,
            false => Form::Matrices,
        }
    }

    fn clips(&self) -> Result<(Skeleton, Vec<Clip>), Failure> {
        match &self.clip {
            None => {
                let motions = demo::motions().map_err(sabaki::graph::GraphError::from)?;
                Ok((motions.skeleton, motions.clips))
            }
            Some(path) => {
                let paths = std::slice::from_ref(path);
                let set =
                    sabaki_import::read_clips(paths, None, &sabaki_import::ReadOptions::default())?;
                Ok((set.skeleton, set.clips))
            }
        }
    }
}
