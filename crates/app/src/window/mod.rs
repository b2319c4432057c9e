//! A window that shows an interactive simulation, with mouse, keyboard and panels.
//!
//! ```no_run
//! # fn show(baked: &sabaki::maps::BakedGraph) -> Result<(), Box<dyn std::error::Error>> {
//! use sabaki_app::live::{QueryWorkerDesc, Fighter, FighterSettings, MapChoices, with_query_worker};
//! use sabaki_app::window::{FighterView, WindowDesc, run};
//!
//! let maps = MapChoices::slabs(baked);
//! let (shown, _) = with_query_worker(&maps, &QueryWorkerDesc::default(), |worker| {
//!     let fighter = Fighter::new(&maps, worker, FighterSettings::default());
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
mod desc;
mod drive;
mod duel;
mod error;
mod fighter;
mod gui;
mod input;
mod panels;
mod times;
mod view;

use winit::event_loop::{ControlFlow, EventLoop};

use super::live::Event;
use app::App;

pub use crowd::CrowdView;
pub use desc::{Click, WindowDesc};
pub use drive::DriveView;
pub use duel::DuelView;
pub use error::WindowError;
pub use fighter::FighterView;
pub use view::{Projection, View};

/// The version of egui that [`View`] uses.
pub use egui;

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
