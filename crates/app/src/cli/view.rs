//! `sabaki view`: a window with a fighter who dodges what the user throws, a driven character, a duel, or a crowd.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use sabaki::maps::BakedGraph;
use sabaki::query::{CullPath, Enumerate};
use sabaki_app::window::{
    self, Click, DriveScene, DuelScene, Event, ThrowScene, ThrowSettings, WindowDesc, WindowError,
};
use sabaki_draw::scene::Outfit;

use super::bake::GraphArgs;
use super::culling::{DeviceArgs, path_parser};
use super::mesh::{BoundOutfit, MeshArgs};
use super::numbers::{number, whole};
use super::output::usage;
use super::render::{CrowdArgs, size};
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    scene: Scene,
}

#[derive(clap::Subcommand)]
enum Scene {
    /// A fighter walks; a click throws a ball, and it dodges.
    Dodge(Box<DodgeArgs>),
    /// A character driven by keys (W A S D, Shift, Q E) in a room where opponents throw from all sides. F: it dodges by itself, or when
    /// Space is pressed.
    Drive(Box<GraphScene>),
    /// Two characters attack and avoid in turn.
    Duel(Box<GraphScene>),
    /// A crowd in a column.
    Crowd(Box<CrowdScene>),
}

#[derive(clap::Args)]
struct DodgeArgs {
    #[command(flatten)]
    scene: GraphScene,
    /// Initial culling path.
    #[arg(long, value_name = "PATH", default_value = "cpu", value_parser = path_parser())]
    cull: CullPath,
    /// Starts with the whole search instead of the grid.
    #[arg(long)]
    no_grid: bool,
    /// Simulates a click: position as shares of width and height, and time in simulated seconds.
    #[arg(long, value_name = "X,Y,SECONDS", value_parser = click)]
    click: Vec<Click>,
}

/// What scenes with characters of a graph share.
#[derive(clap::Args)]
struct GraphScene {
    #[command(flatten)]
    graph: GraphArgs,
    /// Seed of the random choices.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    #[command(flatten)]
    window: WindowArgs,
}

#[derive(clap::Args)]
struct CrowdScene {
    #[command(flatten)]
    crowd: CrowdArgs,
    #[command(flatten)]
    window: WindowArgs,
}

/// Options of the window.
#[derive(clap::Args)]
#[command(next_help_heading = "Window")]
struct WindowArgs {
    /// Initial size of the window, in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Starts without panels; P shows them.
    #[arg(long)]
    plain: bool,
    /// Samples per pixel: 1, 2, 4 or 8. Default: 4, or 1 on a software device.
    #[arg(long, value_name = "N", value_parser = samples)]
    samples: Option<u32>,
    /// Draws as many pictures per second as it can, instead of 60.
    #[arg(long)]
    uncapped: bool,
    /// Closes after this number of pictures.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=u64::MAX))]
    frames: Option<u64>,
    /// Simulated seconds from one picture to the next, whatever the real time. Every run draws the same pictures.
    #[arg(long, value_name = "SECONDS", value_parser = number(0.0..=60.0))]
    step: Option<f32>,
    /// Writes the last picture to this file (.png).
    #[arg(long, value_name = "FILE", requires = "frames", value_parser = output::file_to_write(&["png"]))]
    screenshot: Option<PathBuf>,
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

fn samples(text: &str) -> Result<u32, String> {
    let samples = text.parse().ok();
    samples
        .filter(|samples| [1, 2, 4, 8].contains(samples))
        .ok_or_else(|| "not 1, 2, 4 or 8".to_owned())
}

fn click(text: &str) -> Result<Click, String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.parse().ok()).collect();
    let is_share = |share: &f32| (0.0..=1.0).contains(share);
    match numbers.as_deref() {
        Some(&[x, y, seconds]) if [x, y].iter().all(is_share) && (0.0..=1e6).contains(&seconds) => {
            Ok(Click {
                at: [x, y],
                seconds,
            })
        }
        _ => Err(
            "not X,Y,SECONDS such as 0.5,0.4,1.2, X and Y from 0 to 1, SECONDS 0 or more"
                .to_owned(),
        ),
    }
}

impl From<WindowError> for Failure {
    fn from(error: WindowError) -> Self {
        match error {
            WindowError::Write { path, source } => Self::File { path, source },
            other => Self::Device(other.to_string()),
        }
    }
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    cancel::listen();
    match &args.scene {
        Scene::Dodge(args) => dodge(args, as_json)?,
        Scene::Drive(args) => {
            let (baked, outfit) = args.load()?;
            let mut drive = DriveScene::new(&baked, outfit, args.seed).map_err(usage)?;
            args.window.show(&mut drive, &[], as_json)?;
        }
        Scene::Duel(args) => {
            let (baked, outfit) = args.load()?;
            let mut duel = DuelScene::new(Arc::new(baked), outfit, args.seed).map_err(usage)?;
            args.window.show(&mut duel, &[], as_json)?;
        }
        Scene::Crowd(args) => {
            let (formation, outfit) = args.crowd.formation(&args.window.mesh)?;
            let mut crowd = window::CrowdScene::new(formation, outfit.reported());
            (crowd.levels, crowd.tinted) = (!args.crowd.no_levels, args.crowd.levels);
            args.window.show(&mut crowd, &[], as_json)?;
        }
    }
    Ok(Done::ok(String::new()))
}

fn dodge(args: &DodgeArgs, as_json: bool) -> Result<(), Failure> {
    let (baked, outfit) = args.scene.load()?;
    let mut settings = ThrowSettings {
        culling: args.cull,
        ..ThrowSettings::default()
    };
    if args.no_grid {
        settings.query.enumerate = Enumerate::Whole;
    }
    let mut scene = ThrowScene::new(&baked, outfit, settings, args.scene.seed);
    args.scene.window.show(&mut scene, &args.click, as_json)
}

impl GraphScene {
    /// The graph, and the mesh of its characters.
    fn load(&self) -> Result<(BakedGraph, Option<Arc<Outfit>>), Failure> {
        let baked = self.graph.load()?;
        let graph = baked.graph();
        let outfit = self
            .window
            .mesh
            .load(&self.graph, graph.skeleton(), graph.clips())?;
        Ok((baked, outfit.map(BoundOutfit::reported)))
    }
}

impl WindowArgs {
    fn show(
        &self,
        scene: &mut dyn window::Scene,
        clicks: &[Click],
        as_json: bool,
    ) -> Result<(), Failure> {
        let desc = WindowDesc {
            size: self.size,
            device: self.device.choice(),
            validation: self.device.validation,
            samples: self.samples.unwrap_or(0),
            panels: !self.plain,
            in_step: !self.uncapped,
            step: self.step,
            frames: self.frames,
            screenshot: self.screenshot.clone(),
            clicks: clicks.to_vec(),
            stops: || cancel::check().is_err(),
        };
        window::show(scene, &desc, &mut |event| hear(event, as_json))?;
        Ok(())
    }
}

/// Prints one line for each event at once. A closed stdout does not close the window.
fn hear(event: &Event, as_json: bool) {
    if let (true, Ok(line)) = (as_json, serde_json::to_string(event)) {
        let mut stdout = std::io::stdout().lock();
        let _ = writeln!(stdout, "{line}").and_then(|()| stdout.flush());
        return;
    }
    if let Event::Closed { validation, .. } = event {
        for message in validation {
            eprintln!("validation: {message}");
        }
    }
}
