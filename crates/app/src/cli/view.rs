//! `sabaki view`: a window with a fighter who dodges the balls that the user throws, or with a crowd.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use sabaki::duel::DuelSettings;
use sabaki::graph::GraphError;
use sabaki::maps::{AttackGrid, AttackGridSettings, BakedGraph, Body};
use sabaki::query::{CullPath, Enumerate};
use sabaki_app::live::{
    Drive, Event, Fighter, FighterSettings, LiveCrowd, LiveDuel, MapChoices, QueryWorkerDesc,
    with_query_worker,
};
use sabaki_app::window::{
    Click, CrowdView, DriveView, DuelView, FighterView, View, WindowDesc, WindowError, run as open,
};
use sabaki_draw::scene::{Formation, FormationSettings, Outfit, Performer};
use sabaki_fixtures::demo;
use sabaki_fixtures::headless::{DeviceChoice, Message};

use super::culling::{DeviceArgs, path_parser};
use super::mesh::{BoundOutfit, MeshArgs};
use super::numbers::whole;
use super::source::GraphArgs;
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Initial size of the window, in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = super::render::size)]
    size: [u32; 2],
    /// Initial culling path [default: cpu].
    #[arg(long, value_name = "PATH", value_parser = path_parser())]
    cull: Option<CullPath>,
    /// Starts with the whole search instead of the grid.
    #[arg(long)]
    no_grid: bool,
    /// Initial walking direction of the fighter [default: 1].
    #[arg(long, value_name = "S", value_parser = whole::<u64>(0..=u64::MAX))]
    seed: Option<u64>,
    /// Starts without panels; P shows them.
    #[arg(long)]
    plain: bool,
    /// Samples per pixel: 1, 2, 4 or 8. Default: 4, or 1 on a software device.
    #[arg(long, value_name = "N", value_parser = samples)]
    samples: Option<u32>,
    /// Draws without waiting for the screen (no vertical synchronization).
    #[arg(long)]
    uncapped: bool,
    /// Closes after this number of pictures.
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=u64::MAX))]
    frames: Option<u64>,
    /// Simulated seconds from one picture to the next, whatever the real time; waits for answers. Every run draws the same
    /// pictures.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    step: Option<f32>,
    /// Writes the last picture to this file (PNG).
    #[arg(long, value_name = "FILE", requires = "frames")]
    screenshot: Option<PathBuf>,
    /// Simulates a click: position as shares of width and height, and time in simulated seconds.
    #[arg(long, value_name = "X,Y,SECONDS", value_parser = click)]
    click: Vec<Click>,
    /// Delays every answer, in seconds, as on a slow device.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    delay: Option<f32>,
    /// Drives a character with W A S D, Shift and Q E in a room, where opponents throw from all sides. F: it dodges by itself, or when
    /// Space is pressed.
    #[arg(long, conflicts_with_all = ["crowd", "duel"])]
    drive: bool,
    /// Shows two characters that attack and avoid in turn.
    #[arg(long, conflicts_with = "crowd")]
    duel: bool,
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    crowd: CrowdArgs,
}

/// Options of the crowd.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Crowd")]
struct CrowdArgs {
    /// Shows a crowd in a column instead of a fighter.
    #[arg(long)]
    crowd: bool,
    /// Number of characters in the crowd.
    #[arg(long, value_name = "N", default_value_t = 10_000, requires = "crowd", value_parser = whole::<u32>(1..=200_000))]
    count: u32,
    /// Motion of the crowd: one of the embedded clips.
    #[arg(
        long,
        value_name = "CLIP",
        default_value = "front_kick",
        requires = "crowd"
    )]
    motion: String,
    /// Starts with all joints for all characters.
    #[arg(long, requires = "crowd")]
    no_levels: bool,
    /// Starts with each character in the colour of its level of detail.
    #[arg(long, requires = "crowd")]
    levels: bool,
}

fn seconds(text: &str) -> Result<f32, String> {
    let value = text
        .parse()
        .ok()
        .filter(|value| (0.0..=60.0).contains(value));
    value.ok_or_else(|| "not seconds from 0 to 60".to_owned())
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
            WindowError::Write { path, source } => Self::Write { path, source },
            other => Self::Device(other.to_string()),
        }
    }
}

pub(crate) fn run(args: &Args, device: &DeviceArgs, as_json: bool) -> Result<Done, Failure> {
    args.check()?;
    cancel::listen();
    let display = Display {
        args,
        device,
        as_json,
    };
    if args.crowd.crowd {
        let mut view = CrowdView::new(args.crowd.live_crowd(&args.mesh)?);
        display.show(&mut view)?;
        return Ok(Done::ok(String::new()));
    }
    let baked = args.graph.load()?.graph;
    let graph = baked.graph();
    let bound_outfit = args.mesh.load(graph.skeleton(), graph.clips())?;
    let outfit = bound_outfit.map(BoundOutfit::reported);
    if args.drive {
        let drive = Drive::new(&baked, args.seed());
        let mut drive = drive.map_err(|error| Failure::Usage(error.to_string()))?;
        drive.wear(outfit);
        display.show(&mut DriveView::new(drive))?;
        return Ok(Done::ok(String::new()));
    }
    if args.duel {
        return display.duel(&baked, outfit);
    }
    let mut settings = FighterSettings {
        culling: args.cull.unwrap_or_default(),
        waits: args.step.is_some(),
        ..FighterSettings::default()
    };
    if args.no_grid {
        settings.query.enumerate = Enumerate::Whole;
    }
    let desc = QueryWorkerDesc {
        device: choice(device),
        validation: device.validation,
        delay: Duration::from_secs_f32(args.delay.unwrap_or(0.0)),
    };
    let maps = MapChoices::slabs(&baked);
    let (shown, heard) = with_query_worker(&maps, &desc, |worker| {
        let mut fighter = Fighter::new(&maps, worker, settings).with_seed(args.seed());
        fighter.wear(outfit);
        display.show(&mut FighterView::new(fighter))
    });
    heard.iter().for_each(complain);
    shown?;
    Ok(Done::ok(String::new()))
}

impl Args {
    fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    /// What can be refused before the window opens: options of another scene, and a file that cannot be written.
    fn check(&self) -> Result<(), Failure> {
        self.mesh.check()?;
        if let Some(path) = &self.screenshot {
            output::check_can_be_written("--screenshot", path)?;
            let ending = path.extension().unwrap_or_default();
            if !ending.eq_ignore_ascii_case("png") {
                let path = path.display();
                let what = format!("--screenshot {path}: its name must end in .png");
                return Err(Failure::Usage(what));
            }
        }
        let scene = match (self.crowd.crowd, self.duel, self.drive) {
            (true, _, _) => "view --crowd",
            (_, true, _) => "view --duel",
            (_, _, true) => "view --drive",
            _ => return Ok(()),
        };
        if self.crowd.crowd {
            self.graph.check_unused(scene)?;
        }
        let of_others = [
            ("--cull", self.cull.is_some()),
            ("--no-grid", self.no_grid),
            ("--click", !self.click.is_empty()),
            ("--delay", self.delay.is_some()),
            ("--seed", self.crowd.crowd && self.seed.is_some()),
        ];
        match of_others.iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(Failure::Usage(format!("{scene} takes no {option}"))),
            None => Ok(()),
        }
    }
}

fn choice(device: &DeviceArgs) -> DeviceChoice {
    let name = device.device.clone();
    name.map_or(DeviceChoice::Best, DeviceChoice::Named)
}

fn complain(message: &Message) {
    eprintln!("validation: {message:?}");
}

/// How the window is opened, and what is printed.
struct Display<'a> {
    args: &'a Args,
    device: &'a DeviceArgs,
    as_json: bool,
}

impl Display<'_> {
    fn duel(&self, baked: &BakedGraph, outfit: Option<Arc<Outfit>>) -> Result<Done, Failure> {
        let grid = AttackGrid::new(baked, &AttackGridSettings::default());
        let settings = DuelSettings {
            seed: self.args.seed(),
            ..DuelSettings::default()
        };
        let live_duel = LiveDuel::new(baked, &grid, &settings);
        let mut live_duel = live_duel.map_err(|error| Failure::Usage(error.to_string()))?;
        live_duel.wear(outfit);
        self.show(&mut DuelView::new(live_duel))?;
        Ok(Done::ok(String::new()))
    }

    fn show(&self, view: &mut dyn View) -> Result<(), Failure> {
        let args = self.args;
        let desc = WindowDesc {
            size: args.size,
            device: choice(self.device),
            validation: self.device.validation,
            samples: args.samples.unwrap_or(0),
            panels: !args.plain,
            in_step: !args.uncapped,
            step: args.step,
            frames: args.frames,
            screenshot: args.screenshot.clone(),
            clicks: args.click.clone(),
            stops: || cancel::check().is_err(),
            ..WindowDesc::default()
        };
        let mut hear = |event: &Event| hear(event, self.as_json);
        Ok(open(view, &desc, &mut hear)?)
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

impl CrowdArgs {
    fn live_crowd(&self, mesh: &MeshArgs) -> Result<LiveCrowd, Failure> {
        let motions = demo::motions().map_err(GraphError::from)?;
        let usage = |error: &dyn std::fmt::Display| Failure::Usage(error.to_string());
        let clip = motions.clips.iter().find(|clip| clip.name() == self.motion);
        let clip = clip.ok_or_else(|| {
            let names: Vec<_> = motions.clips.iter().map(|clip| clip.name()).collect();
            let names = names.join(", ");
            Failure::Usage(format!("no motion {:?} among {names}", self.motion))
        })?;
        let settings = FormationSettings {
            count: self.count,
            ..FormationSettings::default()
        };
        let body = Body::from_bones(&motions.skeleton);
        let bound_outfit = mesh.load(&motions.skeleton, &motions.clips)?;
        let outfit = bound_outfit.map(BoundOutfit::reported);
        let performer = Performer {
            skeleton: &motions.skeleton,
            body: &body,
            clip,
            skin: outfit.as_ref().map(|outfit| &*outfit.skins[0]),
        };
        let formation = Formation::new(performer, &settings);
        let mut live_crowd = LiveCrowd::new(formation.map_err(|error| usage(&error))?);
        live_crowd.wear(outfit);
        (live_crowd.levels, live_crowd.tinted) = (!self.no_levels, self.levels);
        Ok(live_crowd)
    }
}
