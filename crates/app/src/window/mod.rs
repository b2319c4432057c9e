//! A window: what is live on the stage, with mouse, keyboard and panels.
//!
//! ```no_run
//! # fn show(baked: &sabaki::maps::BakedGraph) -> Result<(), Box<dyn std::error::Error>> {
//! use crate::live::{AskerDesc, Fighter, FighterSettings, MapChoices, with_asker};
//! use crate::window::{FighterExhibit, WindowDesc, run};
//!
//! let maps = MapChoices::slabs(baked);
//! let (shown, _) = with_asker(&maps, &AskerDesc::default(), |asker| {
//!     let fighter = Fighter::new(&maps, asker, (FighterSettings::default(), 1));
//!     run(&mut FighterExhibit::new(fighter), &WindowDesc::default(), &mut |_| {})
//! });
//! shown?;
//! # Ok(())
//! # }
//! ```
//!
//! Architecture invariant: nothing here knows what is shown, but for the exhibits themselves ([`Exhibit`]), and nothing here draws.

mod app;
mod duel;
mod error;
mod exhibit;
mod fighter;
mod gui;
mod input;
mod march;
mod panels;
mod times;

use std::path::PathBuf;
use std::time::Duration;

use winit::event_loop::{ControlFlow, EventLoop};

use super::live::Event;
use crate::headless::DeviceChoice;
use app::App;

pub use duel::DuelExhibit;
pub use error::WindowError;
pub use exhibit::{Exhibit, Seen};
pub use fighter::FighterExhibit;
pub use march::MarchExhibit;

/// The version that [`Exhibit`] speaks of.
pub use egui;

/// How a window is opened.
#[derive(Clone, Debug)]
pub struct WindowDesc {
    /// In its head.
    pub title: String,
    /// Columns and rows at first. Default 1,280 × 720.
    pub size: [u32; 2],
    /// Which device draws.
    pub device: DeviceChoice,
    /// Whether validation is listened to.
    pub validation: bool,
    /// Samples a pixel; 0, the default, for 4, or 1 where the processor draws.
    pub samples: u32,
    /// Whether panels are shown at first. Default yes.
    pub panels: bool,
    /// Whether pictures wait for the screen's own pace. Default yes.
    pub in_step: bool,
    /// Seconds on the stage from one picture to the next, however long that takes. Default as long as it takes.
    pub step: Option<f32>,
    /// The window closes after so many pictures. Default never.
    pub frames: Option<u64>,
    /// Where the last of these is written to, as PNG.
    pub screenshot: Option<PathBuf>,
    /// Clicks that come by themselves.
    pub clicks: Vec<Click>,
    /// Asked before each picture: whether to close. For a program that is told to stop by a signal.
    pub stops: fn() -> bool,
}

/// A click that comes by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Click {
    /// Where, as shares of the window's width and height, from its left upper corner.
    pub at: [f32; 2],
    /// When, seconds on the stage.
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

/// From one picture to the next where nobody else sets the pace.
const PACE: Duration = Duration::from_micros(8000);

/// Opens a window, and returns when it is closed. `hear` is told what happens, the closing last.
///
/// Only once in a process, and on its main thread: so window systems want it.
///
/// # Errors
/// [`WindowError::NoWindowSystem`] where there is none; a device that cannot draw; a screenshot that was not written.
pub fn run(
    exhibit: &mut dyn Exhibit,
    desc: &WindowDesc,
    hear: &mut dyn FnMut(&Event),
) -> Result<(), WindowError> {
    let events = EventLoop::new().map_err(WindowError::of_loop)?;
    events.set_control_flow(ControlFlow::Poll);
    let mut app = App::new(exhibit, desc, hear);
    let ran = events.run_app(&mut app);
    app.end()?;
    ran.map_err(WindowError::of_loop)
}
