//! `sabaki lod`: joint energies, levels of detail, their errors, and the distances at which they are drawn.
//!
//! Source: Hasegawa, Nishio & Kobori; the columns beyond the energy are not in the paper.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use sabaki::anim::{JointId, Pose, Skeleton};
use sabaki::archive;
use sabaki::lod::{
    Carrier, Flexion, Inertia, LevelSettings, Levels, LodError, Masses, Measure, Order, Rule,
    SwitchSettings, Switching, View,
};
use sabaki_fixtures::demo;

use super::bake::own_file;
use super::lod_report::{Report, Source};
use super::numbers::check_number;
use super::plot::Plot;
use super::source::ReadArgs;
use super::{Done, Failure, cancel, lod_report, output};

#[derive(Clone, clap::Args)]
pub(crate) struct Args {
    /// BVH, AMC or glTF files of one skeleton, or folders of them. Default: the embedded motions.
    #[arg(value_name = "CLIP")]
    clips: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// Order in which joints are removed: by energy (as in the paper), or by the displacement of the body
    /// that the removal causes.
    #[arg(long, value_enum, default_value = "energy")]
    order: OrderArg,
    /// What determines the distance of a level: its energy (as in the paper), or its error on the screen.
    #[arg(long, value_enum, default_value = "energy")]
    switch: OrderArg,
    /// Weight of flexed joints: raised above the threshold, the paper's equation to the letter, or ignored.
    #[arg(long, value_enum, default_value = "raised")]
    flexion: FlexionArg,
    /// Moment of inertia: about the joint, or about its axis of rotation.
    #[arg(long, value_enum, default_value = "joint")]
    inertia: InertiaArg,
    /// Joint that carries the points of a removed joint: the nearest kept one, or always the parent.
    #[arg(long, value_enum, default_value = "nearest")]
    carrier: CarrierArg,
    /// Masses of the joints (JSON). Default: 70 kg in all, by the lengths of the bones.
    #[arg(long, value_name = "FILE")]
    masses: Option<PathBuf>,
    /// Joint that is never removed; several with commas between them.
    #[arg(long, value_name = "JOINT", value_delimiter = ',')]
    lock: Vec<String>,
    /// Vertical field of view, in degrees, above 0 and below 180.
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0)]
    fov: f32,
    /// Height of the screen, in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 1080.0)]
    screen: f32,
    /// Height of the character on the screen, in pixels, at which its motion can no longer be seen; for --switch energy [default: 20].
    #[arg(long, value_name = "PIXELS")]
    vanish: Option<f32>,
    /// Largest error on the screen, in pixels; for --switch error [default: 1].
    #[arg(long, value_name = "PIXELS")]
    error: Option<f32>,
    /// Whether --error limits the greatest error of all points and frames, or the mean; for --switch error [default: greatest].
    #[arg(long, value_enum)]
    measure: Option<MeasureArg>,
    /// Writes the first clip as each level draws it, as animations of one GLB file (.glb).
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
    /// Plots the joints' energies, the levels' errors and their distances: to a PNG or SVG file, or with - as letters to stdout.
    #[arg(long, value_name = "FILE")]
    plot: Option<Plot>,
}

#[derive(Clone, Copy, ValueEnum)]
enum OrderArg {
    Energy,
    Error,
}

#[derive(Clone, Copy, ValueEnum)]
enum MeasureArg {
    Greatest,
    Mean,
}

#[derive(Clone, Copy, ValueEnum)]
enum FlexionArg {
    Raised,
    Literal,
    Ignored,
}

#[derive(Clone, Copy, ValueEnum)]
enum InertiaArg {
    Joint,
    Axis,
}

#[derive(Clone, Copy, ValueEnum)]
enum CarrierArg {
    Nearest,
    Parent,
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    Plot::check(args.plot.as_ref(), as_json)?;
    args.check()?;
    let own = args.clone();
    let (report, clips) = cancel::detached(move || {
        let report = own.report()?;
        let clips = own.export.is_some().then(|| report.drawn()).transpose();
        Ok((report, clips.map_err(usage)?))
    })?;
    if let (Some(path), Some(clips)) = (&args.export, clips) {
        let skeleton = &report.source.skeleton;
        archive::write_atomically(path, |file| {
            sabaki_import::gltf::write(file, skeleton, &clips)
        })
        .map_err(|source| Failure::Write {
            path: path.clone(),
            source,
        })?;
    }
    let drawn = match &args.plot {
        None => String::new(),
        Some(plot) => plot.draw(&report)?,
    };
    Ok(Done::ok(if as_json {
        Done::json(&report.to_json())
    } else {
        report.describe() + &drawn
    }))
}

fn usage(error: LodError) -> Failure {
    Failure::Usage(error.to_string())
}

impl Args {
    /// What can be refused before the clips are read.
    fn check(&self) -> Result<(), Failure> {
        if !(self.fov > 0.0 && self.fov < 180.0) {
            let what = "must be above 0 and below 180 degrees";
            return Err(Failure::Usage(format!("--fov {}: {what}", self.fov)));
        }
        let (other, unused): (_, &[(&str, bool)]) = match self.switch {
            OrderArg::Energy => (
                "error",
                &[
                    ("--error", self.error.is_some()),
                    ("--measure", self.measure.is_some()),
                ],
            ),
            OrderArg::Error => ("energy", &[("--vanish", self.vanish.is_some())]),
        };
        if let Some((option, _)) = unused.iter().find(|(_, is_given)| *is_given) {
            return Err(Failure::Usage(format!("{option} needs --switch {other}")));
        }
        let pixels = [
            ("--screen", Some(self.screen)),
            ("--vanish", self.vanish),
            ("--error", self.error),
        ];
        for (option, pixels) in pixels {
            let Some(pixels) = pixels else { continue };
            // An infinite error allows every level.
            let is_allowed = pixels > 0.0 && (pixels.is_finite() || option == "--error");
            check_number(is_allowed, || {
                format!("{option} {pixels}: must be above 0 pixels")
            })?;
        }
        self.clips
            .iter()
            .try_for_each(|path| own_file::check_is_none(path))?;
        self.read.check_paths(&self.clips)?;
        let Some(path) = &self.export else {
            return Ok(());
        };
        let inputs = self.clips.iter().chain(&self.masses).map(PathBuf::as_path);
        output::check_is_no_input("--export", path, &inputs.collect::<Vec<&Path>>())?;
        let ending = path.extension();
        if !ending.is_some_and(|ending| ending.eq_ignore_ascii_case("glb")) {
            let what = "its name must end in .glb";
            return Err(Failure::Usage(format!(
                "--export {}: {what}",
                path.display()
            )));
        }
        output::check_can_be_written("--export", path)
    }

    /// Reads the clips, builds the levels and measures them.
    fn report(&self) -> Result<Report, Failure> {
        let source = self.source()?;
        let settings = self.level_settings(&source.skeleton)?;
        let levels = Levels::build(&source.skeleton, &source.clips, &settings).map_err(usage)?;
        let mut pose = Pose::default();
        source.clips[0].pose(0, &mut pose);
        let stature = sabaki_import::stature(&source.skeleton, &pose) as f32;
        // A figure without height in its first frame: its reach serves as its height.
        let stature = if stature > 0.0 { stature } else { levels.reach };
        let switching = self.switch_settings(stature);
        let bands = Switching::new(&levels, &switching).map_err(usage)?;
        let report = Report {
            source,
            levels,
            stature,
            order: settings.order,
            bands,
            steps: lod_report::Steps::default(),
            settings: switching,
        };
        report.measured().map_err(usage)
    }

    fn source(&self) -> Result<Source, Failure> {
        if self.clips.is_empty() {
            self.read.check_unused("a CLIP")?;
            let motions = demo::motions().map_err(sabaki::graph::GraphError::from)?;
            return Ok(Source {
                skeleton: motions.skeleton,
                clips: motions.clips,
                warnings: Vec::new(),
            });
        }
        let set = sabaki_import::read_clips(&self.clips, None, &self.read.options())?;
        Ok(Source {
            skeleton: set.skeleton,
            clips: set.clips,
            warnings: set.warnings,
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
                let path = path.clone();
                masses.map_err(|error| sabaki_import::ReadError::Masses { path, error })?
            }
        };
        Ok(LevelSettings {
            order: match self.order {
                OrderArg::Energy => Order::Energy,
                OrderArg::Error => Order::Error,
            },
            masses,
            flexion: match self.flexion {
                FlexionArg::Raised => Flexion::Raised,
                FlexionArg::Literal => Flexion::Literal,
                FlexionArg::Ignored => Flexion::Ignored,
            },
            inertia: match self.inertia {
                InertiaArg::Joint => Inertia::Joint,
                InertiaArg::Axis => Inertia::Axis,
            },
            locked: locked?,
            carrier: match self.carrier {
                CarrierArg::Nearest => Carrier::Nearest,
                CarrierArg::Parent => Carrier::Parent,
            },
            ..LevelSettings::default()
        })
    }

    fn switch_settings(&self, stature: f32) -> SwitchSettings {
        let view = View {
            fov: self.fov.to_radians(),
            height: self.screen,
        };
        SwitchSettings {
            view,
            rule: match self.switch {
                OrderArg::Energy => Rule::Energy {
                    furthest: view.distance(stature, self.vanish.unwrap_or(20.0)),
                },
                OrderArg::Error => Rule::ScreenError {
                    pixels: self.error.unwrap_or(1.0),
                    measure: match self.measure {
                        None | Some(MeasureArg::Greatest) => Measure::Greatest,
                        Some(MeasureArg::Mean) => Measure::Mean,
                    },
                },
            },
            ..SwitchSettings::default()
        }
    }
}
