//! A window that shows an interactive simulation, with mouse, keyboard and panels.
//!
//! ```no_run
//! # fn show(baked: &sabaki::maps::BakedGraph) -> Result<(), Box<dyn std::error::Error>> {
//! use sabaki_app::live::{QueryWorkerDesc, Fighter, FighterSettings, MapChoices, with_query_worker};
//! use sabaki_app::window::{FighterView, WindowDesc, run};
//!
//! let maps = MapChoices::slabs(baked);
//! let (shown, _) = with_query_worker(&maps, &QueryWorkerDesc::default(), |worker| {
//!     let fighter = Fighter::new(&maps, worker, (FighterSettings::default(), 1));
//!     run(&mut FighterView::new(fighter), &WindowDesc::default(), &mut |_| {})
//! });
//! shown?;
//! # Ok(())
//! # }
//! ```
//!
//! Architecture invariant: only the implementations of [`View`] know what is shown, and nothing here draws.

mod app;
mod crowd;
mod duel;
mod error;
mod fighter;
mod gui;
mod input;
mod panels;
mod times;
mod view;

use std::path::PathBuf;
use std::time::Duration;

use winit::event_loop::{ControlFlow, EventLoop};

use super::live::Event;
use crate::headless::DeviceChoice;
use app::App;

pub use crowd::CrowdView;
pub use duel::DuelView;
pub use error::WindowError;
pub use fighter::FighterView;
pub use view::{Seen, View};

/// The version of egui that [`View`] uses.
pub use egui;

/// Settings of a window.
#[derive(Clone, Debug)]
pub struct WindowDesc {
    /// Title.
    pub title: String,
    /// Initial size, in pixels. Default: 1,280 × 720.
    pub size: [u32; 2],
    /// Device that draws.
    pub device: DeviceChoice,
    /// Enables validation.
    pub validation: bool,
    /// Samples per pixel. Default: 0, which means 4, or 1 on a software device.
    pub samples: u32,
    /// Starts with panels. Default: true.
    pub panels: bool,
    /// Waits for the screen (vertical synchronization). Default: true.
    pub in_step: bool,
    /// Simulated seconds from one picture to the next. Default: `None`, the real time.
    pub step: Option<f32>,
    /// Closes the window after this number of pictures. Default: never.
    pub frames: Option<u64>,
    /// File for the last picture (PNG). Default: none.
    pub screenshot: Option<PathBuf>,
    /// Simulated clicks.
    pub clicks: Vec<Click>,
    /// Called before each picture; the window closes if it returns true. For programs that stop on a signal.
    pub stops: fn() -> bool,
}

/// A simulated click.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Click {
    /// Position as shares of the window's width and height, from the upper left corner.
    pub at: [f32; 2],
    /// Time, in simulated seconds.
    pub seconds: f32,
}

impl Default for WindowDesc {
    fn default() -> Self {
        Self {
            title: "sabaki".to_owned(),
            size: [1280, 720],
            device: DeviceChoice::default(),
            validation: false,
            samples: 0,
            panels: true,
            in_step: true,
            step: None,
            frames: None,
            screenshot: None,
            clicks: Vec::new(),
            stops: || false,
        }
    }
}

/// Time from one picture to the next if neither the screen nor the caller sets the pace.
const PACE: Duration = Duration::from_micros(8000);

/// Opens a window and returns when it is closed. `hear` is called with each event; the last one is the closing.
///
/// May be called once in a process, on its main thread, as window systems require.
///
/// # Errors
/// [`WindowError::NoWindowSystem`] without a window system; an error of the device; a screenshot that cannot be written.
pub fn run(
    view: &mut dyn View,
    desc: &WindowDesc,
    hear: &mut dyn FnMut(&Event),
) -> Result<(), WindowError> {
    let events = EventLoop::new().map_err(WindowError::of_loop)?;
    events.set_control_flow(ControlFlow::Poll);
    let mut app = App::new(view, desc, hear);
    let ran = events.run_app(&mut app);
    app.end()?;
    ran.map_err(WindowError::of_loop)
}
