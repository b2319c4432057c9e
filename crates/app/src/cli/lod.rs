//! `sabaki lod`: joint energies, levels of detail, their errors, and the distances at which they are drawn.
//!
//! Source: Hasegawa, Nishio & Kobori; the columns beyond the energy are not in the paper.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use sabaki::anim::{Clip, JointId, Pose, Skeleton};
use sabaki::archive;
use sabaki::lod::{
    Level, LevelSettings, Levels, LodError, Masses, Measure, Order, Rule, SwitchSettings,
    Switching, View,
};
use serde_json::{Value, json};

use super::bake::{self, ReadArgs};
use super::numbers::number;
use super::output::usage;
use super::plot::{Chart, write_figure};
use super::{Done, Failure, cancel, output};

#[derive(Clone, clap::Args)]
pub(crate) struct Args {
    /// BVH, AMC, glTF or FBX files of one skeleton, or folders of them. Default: the embedded motions.
    #[arg(value_name = "CLIP")]
    clips: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Order in which joints are removed: by energy (as in the paper), or by the displacement of the body
    /// that the removal causes.
    #[arg(long, default_value = "energy", value_parser = order_parser())]
    order: Order,
    /// Masses of the joints (JSON). Default: 70 kg in all, by the lengths of the bones.
    #[arg(long, value_name = "FILE")]
    masses: Option<PathBuf>,
    /// Joint that is never removed; several with commas between them.
    #[arg(long, value_name = "JOINT", value_delimiter = ',')]
    lock: Vec<String>,
    /// Vertical field of view, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0, value_parser = number(0.1..=179.0))]
    fov: f32,
    /// Height of the screen, in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 1080.0, value_parser = number(1.0..=1e6))]
    screen: f32,
    /// Height of the character on the screen, in pixels, at which its motion can no longer be seen. Distances are linear in the
    /// energy up to there (as in the paper).
    #[arg(long, value_name = "PIXELS", default_value_t = 20.0, value_parser = number(0.01..=1e6))]
    vanish: f32,
    /// Chooses the distances by the greatest error on the screen instead, in pixels.
    #[arg(long, value_name = "PIXELS", conflicts_with = "vanish", value_parser = number(1e-3..=1e6))]
    error: Option<f32>,
    /// Writes the first clip as each level draws it, as animations of one file (.glb).
    #[arg(long, value_name = "FILE", value_parser = output::file_to_write(&["glb"]))]
    export: Option<PathBuf>,
    /// Draws the levels' errors (.png).
    #[arg(long, value_name = "FILE", value_parser = output::file_to_write(&["png"]))]
    plot: Option<PathBuf>,
}

fn order_parser() -> impl TypedValueParser<Value = Order> {
    PossibleValuesParser::new(["energy", "error"]).map(|order| match order.as_str() {
        "energy" => Order::Energy,
        _ => Order::Error,
    })
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    args.check()?;
    let own = args.clone();
    let (report, clips) = cancel::detached(move || {
        let report = own.report()?;
        let clips = own.export.is_some().then(|| report.drawn()).transpose();
        Ok((report, clips.map_err(usage)?))
    })?;
    if let (Some(path), Some(clips)) = (&args.export, clips) {
        let skeleton = &report.skeleton;
        archive::write_atomically(path, |file| {
            sabaki_import::gltf::write(file, skeleton, &clips, &[])
        })
        .map_err(Failure::file(path))?;
    }
    if let Some(path) = &args.plot {
        write_figure(path, [720, 460], |area| report.errors().draw(area))?;
    }
    Ok(Done::ok(if as_json {
        Done::json(&report.to_json())
    } else {
        report.describe()
    }))
}

impl Args {
    /// What can be refused before the clips are read.
    fn check(&self) -> Result<(), Failure> {
        self.clips
            .iter()
            .try_for_each(|path| bake::check_is_motion(path))?;
        let Some(path) = &self.export else {
            return Ok(());
        };
        let inputs = self.clips.iter().chain(&self.masses).map(PathBuf::as_path);
        output::check_is_no_input("--export", path, &inputs.collect::<Vec<&Path>>())
    }

    /// Reads the clips, builds the levels and measures them.
    fn report(&self) -> Result<Report, Failure> {
        let options = self.read.options();
        let (skeleton, clips, warnings) = bake::read_clips(&self.clips, &options)?;
        let settings = self.level_settings(&skeleton)?;
        let levels = Levels::build(&skeleton, &clips, &settings).map_err(usage)?;
        let mut pose = Pose::default();
        clips[0].pose(0, &mut pose);
        let stature = sabaki_import::stature(&skeleton, &pose) as f32;
        // A figure without height in its first frame: its reach serves as its height.
        let stature = if stature > 0.0 { stature } else { levels.reach };
        let view = View {
            fov: self.fov.to_radians(),
            height: self.screen,
        };
        let switching = SwitchSettings {
            view,
            rule: match self.error {
                None => Rule::Energy {
                    furthest: view.distance(stature, self.vanish),
                },
                Some(pixels) => Rule::ScreenError {
                    pixels,
                    measure: Measure::Greatest,
                },
            },
            ..SwitchSettings::default()
        };
        let bands = Switching::new(&levels, &switching).map_err(usage)?;
        Ok(Report {
            skeleton,
            clips,
            warnings,
            levels,
            stature,
            order: settings.order,
            bands,
            settings: switching,
        })
    }

    fn level_settings(&self, skeleton: &Skeleton) -> Result<LevelSettings, Failure> {
        let locked: Result<Vec<JointId>, Failure> = self
            .lock
            .iter()
            .map(|name| {
                let unknown = || Failure::Usage(format!("the skeleton has no joint \"{name}\""));
                skeleton.find(name).ok_or_else(unknown)
            })
            .collect();
        let masses = match &self.masses {
            None => Masses::default(),
            Some(path) => {
                let masses = sabaki_import::MassFile::read(path)?.resolve(skeleton);
                masses.map_err(sabaki_import::ReadError::in_file(path))?
            }
        };
        Ok(LevelSettings {
            order: self.order,
            masses,
            locked: locked?,
            ..LevelSettings::default()
        })
    }
}

/// Levels of detail of clips, with the distances at which they are drawn.
struct Report {
    skeleton: Skeleton,
    clips: Vec<Clip>,
    warnings: Vec<String>,
    levels: Levels,
    /// Height of the character, in metres.
    stature: f32,
    order: Order,
    settings: SwitchSettings,
    bands: Switching,
}

impl Report {
    fn name(&self, level: &Level) -> &str {
        let joint = level.removed.map(|id| self.skeleton.joint(id));
        joint.map_or("", |joint| joint.name.as_str())
    }

    /// The first clip as each level draws it.
    fn drawn(&self) -> Result<Vec<Clip>, LodError> {
        let (skeleton, clip) = (&self.skeleton, &self.clips[0]);
        let levels = self.levels.levels.iter().enumerate();
        levels
            .map(|(index, level)| {
                let mut desc = level.drawn(skeleton, clip)?.desc();
                desc.name = match level.removed {
                    Some(_) => format!("level {index}, without {}", self.name(level)),
                    None => "level 0".to_owned(),
                };
                Ok(Clip::new(skeleton, desc)?)
            })
            .collect()
    }

    fn seconds(&self) -> f64 {
        self.clips.iter().map(|clip| clip.duration()).sum()
    }

    /// The level's largest error at the distance where it is first drawn, in pixels, for the point of the body nearest to the camera.
    fn pixels(&self, index: usize) -> Option<f32> {
        let band = self.bands.bands().get(index.checked_sub(1)?)?;
        let near = band.full - self.levels.reach;
        let error = self.levels.levels[index].error.max;
        (near > 0.0).then(|| self.settings.view.pixels(error, near))
    }

    /// The report as JSON, with stable keys.
    fn to_json(&self) -> Value {
        let removed_at = |joint| {
            let mut levels = self.levels.levels.iter();
            levels.position(|level| level.removed == Some(joint))
        };
        let energies = self.skeleton.ids().zip(&self.levels.energies);
        let energies: Vec<Value> = energies
            .map(|(id, energy)| {
                let name = &self.skeleton.joint(id).name;
                json!({ "joint": name, "energy": energy, "removed_at_level": removed_at(id) })
            })
            .collect();
        let levels = self.levels.levels.iter().enumerate();
        let levels: Vec<Value> = levels
            .map(|(index, level)| {
                let removed = level.removed.map(|_| self.name(level));
                let band = index.checked_sub(1).map(|band| self.bands.bands()[band]);
                json!({
                    "level": index,
                    "joints": level.kept.len(),
                    "removed": removed,
                    "energy": level.energy,
                    "position_error_mean": level.error.mean,
                    "position_error_max": level.error.max,
                    "body_error_mean": level.error.body_mean,
                    "step": level.error.step,
                    "band": band,
                    "error_pixels": self.pixels(index),
                })
            })
            .collect();
        json!({
            "clips": self.clips.len(),
            "seconds": self.seconds(),
            "joints": self.skeleton.len(),
            "order": self.order,
            "switching": self.settings,
            "stature": self.stature,
            "reach": self.levels.reach,
            "furthest": self.bands.furthest(),
            "energies": energies,
            "levels": levels,
            "warnings": self.warnings,
        })
    }

    /// The report as text.
    fn describe(&self) -> String {
        let mut text = format!(
            "{}, {:.1} s; {} joints, {:.2} m high\n",
            output::counted(self.clips.len(), "clip"),
            self.seconds(),
            self.skeleton.len(),
            self.stature
        );
        let head = [
            "level", "removed", "joints", "energy J", "mean", "max", "step", "blended", "drawn",
            "there",
        ];
        let mut table = output::table(&head, 2);
        for (index, level) in self.levels.levels.iter().enumerate() {
            let millimetres = |metres: f32| format!("{:.1} mm", metres * 1e3);
            let band = index.checked_sub(1).map(|band| self.bands.bands()[band]);
            let metres = |metres: Option<f32>| {
                metres.map_or(String::new(), |metres| format!("{metres:.1} m"))
            };
            let energy = (index > 0).then(|| format!("{:.4}", level.energy));
            let pixels = self.pixels(index);
            table.add_row([
                index.to_string(),
                self.name(level).to_owned(),
                level.kept.len().to_string(),
                energy.unwrap_or_default(),
                millimetres(level.error.mean),
                millimetres(level.error.max),
                millimetres(level.error.step),
                metres(band.map(|band| band.start)),
                metres(band.map(|band| band.end)),
                pixels.map_or(String::new(), |pixels| format!("{pixels:.1} px")),
            ]);
        }
        let _ = writeln!(text, "{table}");
        let rule = match self.settings.rule {
            Rule::Energy { furthest } => {
                format!("The distances are linear in the energy, up to L = {furthest:.1} m")
            }
            Rule::ScreenError { pixels, measure } => {
                let measure = format!("{measure:?}").to_lowercase();
                format!("The distances limit the {measure} error to {pixels} pixels")
            }
        };
        let _ = writeln!(
            text,
            "mean, max: distance of the removed joints' points from where they are with all joints.\n\
             step: distance from the previous level. blended, drawn: distances from which on.\n\
             there: the largest error on the screen, for a point {:.2} m nearer to the camera than the root.\n\
             {rule}.\n\
             Bands that would overlap are moved outwards.\n\
             The last level begins at {:.1} m.",
            self.levels.reach,
            self.bands.furthest(),
        );
        for warning in &self.warnings {
            let _ = writeln!(text, "note: {warning}");
        }
        text
    }
}

impl Report {
    fn errors(&self) -> Chart<'static> {
        let of_levels = |value: &dyn Fn(&Level) -> f32| {
            let levels = self.levels.levels.iter().enumerate();
            levels
                .map(|(index, level)| (index as f64, 1e3 * f64::from(value(level))))
                .collect()
        };
        Chart {
            title: "Position error of each level",
            x: "level",
            y: "error, mm",
            log: false,
            lines: vec![
                ("greatest", of_levels(&|level| level.error.max)),
                (
                    "mean of removed joints",
                    of_levels(&|level| level.error.mean),
                ),
                (
                    "mean of the body",
                    of_levels(&|level| level.error.body_mean),
                ),
            ],
        }
    }
}
