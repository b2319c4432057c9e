//! A window that shows an interactive [`Scene`], with mouse, keyboard and panels.
//!
//! ```no_run
//! # fn example(baked: &sabaki::maps::BakedGraph) -> Result<(), Box<dyn std::error::Error>> {
//! use sabaki_app::window::{ThrowScene, ThrowSettings, WindowDesc, show};
//!
//! let mut scene = ThrowScene::new(baked, None, ThrowSettings::default(), 1);
//! show(&mut scene, &WindowDesc::default(), &mut |event| println!("{event:?}"))?;
//! # Ok(())
//! # }
//! ```
//!
//! A picture takes one way, in a window and without one: the scene advances and describes a [`Shot`], a [`Painter`](crate::Painter)
//! draws it and, over it, the panels, and its pixels are read back. A window shows these pixels, so that any device can draw and any
//! window system can show. [`picture`] returns them.
//!
//! Architecture invariant: only the implementations of [`Scene`] know what is shown, and only `gui` uses Vulkan.

mod app;
mod crowd;
mod drive;
mod duel;
mod gui;
mod player;
mod throw;

use std::path::PathBuf;

use glam::Vec3;
use serde::Serialize;
use thiserror::Error;
use winit::error::EventLoopError;

use crate::film::FilmError;
use sabaki::crowd::CrowdError;
use sabaki::gpu::GpuError;
use sabaki::math::F32x16;
use sabaki::query::{AttackError, Source};
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Mesh, Shot};
use sabaki_fixtures::headless::{DeviceChoice, Headless};

pub use app::show;
pub use crowd::CrowdScene;
pub use drive::{DriveScene, DriveScore};
pub use duel::DuelScene;
pub use player::{MouseCamera, picture};
pub use throw::{ThrowScene, ThrowSettings, Thrown};

/// The version of egui that [`Scene`] uses.
pub use egui;

/// Where a place of the world appears on the screen, in points; `None` behind the camera.
pub type Seen<'a> = &'a dyn Fn(Vec3) -> Option<egui::Pos2>;

/// A picture and, if there is one, its crowd.
pub type Drawn = Result<(Shot, Option<CrowdShot>), WindowError>;

/// The contents of a window.
pub trait Scene {
    /// Meshes of the characters.
    fn meshes(&self) -> &[Mesh];

    /// Settings of the stage. The window sets format, size and samples.
    fn stage(&self) -> StageDesc<'_> {
        StageDesc {
            meshes: self.meshes(),
            ..StageDesc::default()
        }
    }

    /// Advances the simulation by some seconds.
    fn advance(&mut self, seconds: f32);

    /// Focus of the camera, in metres.
    fn focus(&self) -> Vec3;

    /// Initial distance of the camera, in metres.
    fn distance(&self) -> f32;

    /// The camera, if the scene controls it; `None` if the mouse does.
    fn camera(&self) -> Option<Camera> {
        None
    }

    /// What `camera` sees in a picture of `size` pixels. The device reads a crowd's poses from `poses`.
    ///
    /// # Errors
    /// Those of the scene.
    fn draw(&mut self, camera: Camera, size: [u32; 2], poses: &mut [F32x16]) -> Drawn;

    /// Handles a click in the direction `ray` of `camera`. The device culls where the scene uses it.
    ///
    /// # Errors
    /// Those of the scene.
    fn click(&mut self, _: &Camera, _ray: Vec3, _: &mut Headless) -> Result<(), WindowError> {
        Ok(())
    }

    /// Handles a key that goes down or up: its text in lower case, `space` or `shift`. Returns whether it is one of the scene's;
    /// the window then does not use it.
    fn key(&mut self, key: &str, is_down: bool) -> bool;

    /// The keys of the scene and their descriptions.
    fn keys(&self) -> &'static [(&'static str, &'static str)];

    /// Lays out the panel.
    fn panel(&mut self, ui: &mut egui::Ui);

    /// Draws text over the picture.
    fn label(&self, _: &egui::Painter, _seen: Seen<'_>) {}

    /// Takes the events since the last call.
    fn take_events(&mut self) -> Vec<Event> {
        Vec::new()
    }

    /// Median time to pose the crowd, in milliseconds, if there is one.
    fn pose_ms(&self) -> Option<f64> {
        None
    }

    /// Destroys what the scene has made on the device.
    fn close(&mut self, _: &mut Headless) {}
}

/// Settings of a window.
#[derive(Clone, Debug)]
pub struct WindowDesc {
    /// Initial size, in pixels. Default: 1,280 × 720.
    pub size: [u32; 2],
    /// Device that draws and culls.
    pub device: DeviceChoice,
    /// Enables validation.
    pub validation: bool,
    /// Samples per pixel. Default: 0, which means 4, or 1 on a software device.
    pub samples: u32,
    /// Starts with panels. Default: true.
    pub panels: bool,
    /// Draws at most 60 pictures per second. Default: true.
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

impl Default for WindowDesc {
    fn default() -> Self {
        Self {
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

/// A simulated click.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Click {
    /// Position as shares of the window's width and height, from the upper left corner.
    pub at: [f32; 2],
    /// Time, in simulated seconds.
    pub seconds: f32,
}

/// An event of a window: one line of `sabaki view --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The window was opened.
    Opened {
        /// Device that draws.
        device: String,
        /// Size of the picture, in pixels.
        size: [u32; 2],
    },
    /// A ball was thrown.
    Throw {
        /// Number, counted from 1.
        number: u32,
        /// Start of the flight in the world, in metres.
        from: [f32; 3],
        /// Target in the world, in metres.
        target: [f32; 3],
        /// Whether the target is on the body.
        at_body: bool,
        /// Time until the throw, in seconds.
        lead: f32,
        /// Speed of the ball, in metres per second.
        speed: f32,
        /// Radius of the ball, in metres.
        radius: f32,
    },
    /// A click while a ball was flying; it throws nothing.
    Ignored {
        /// Number of the flying ball.
        number: u32,
    },
    /// The answer of a query.
    Answer {
        /// Number of the throw.
        number: u32,
        /// Whether the chosen motion avoids the ball.
        avoided: bool,
        /// The chosen answer: `evasion` or `move`.
        chosen: &'static str,
        /// Smallest distance of body and ball, in metres.
        clearance: f32,
        /// Time of the smallest distance, in seconds since the click.
        nearest_at: f32,
        /// Source of the candidates.
        source: Source,
        /// Number of candidates.
        candidates: usize,
        /// Number of candidates that the maps removed.
        culled: usize,
        /// Number of candidates that the exact test found hit.
        hits: usize,
        /// Number of candidates that the exact test found clean.
        clean: usize,
        /// Culling path: `exact`, `cpu`, `stencil` or `compute`.
        cull: &'static str,
        /// Whether the node's grid was used.
        grid: bool,
        /// Time of the query, in milliseconds.
        query_ms: f64,
    },
    /// The end of an attack of a duel.
    Exchange {
        /// Number, counted from 1.
        number: u32,
        /// The attacker: `white` or `blue`.
        attacker: &'static str,
        /// Clip of the attack.
        attack: String,
        /// Whether the attack was avoided.
        avoided: bool,
        /// Smallest distance of body and limb, in metres; negative for a hit. `None` if the limb never came near.
        clearance: Option<f32>,
        /// Time from the beginning of the strike to its furthest reach, in seconds.
        lead: f32,
    },
    /// A query could not be culled as requested; the CPU culls it instead.
    Trouble {
        /// Reason, as text.
        why: String,
    },
    /// The end of a ball's flight, as shown.
    Passed {
        /// Number of the throw.
        number: u32,
        /// Smallest distance of body and ball in the shown pictures, in metres; negative for a hit.
        nearest: f32,
        /// Number of pictures with the ball.
        pictures: u32,
    },
    /// The size of the window changed.
    Resized {
        /// Size of the drawing, in pixels.
        size: [u32; 2],
    },
    /// The window was hidden.
    Hidden,
    /// The window is visible again.
    Shown,
    /// A screenshot was written.
    Screenshot {
        /// Path of the file.
        file: PathBuf,
    },
    /// The window was closed.
    Closed {
        /// Number of pictures shown.
        frames: u64,
        /// Median time from one picture to the next of the last pictures, in milliseconds.
        median_frame_ms: f64,
        /// Median time to pose the crowd, in milliseconds.
        #[serde(skip_serializing_if = "Option::is_none")]
        median_pose_ms: Option<f64>,
        /// Validation messages, if validation was enabled.
        validation: Vec<String>,
    },
}

/// Why a window could not be opened, or was closed.
#[derive(Debug, Error)]
pub enum WindowError {
    /// No window system, for instance no X or Wayland server.
    #[error("there is no window system to open a window on: {0}")]
    NoWindowSystem(String),
    /// The window system refuses the window or its pictures.
    #[error("no window could be opened: {0}")]
    NoWindow(String),
    /// An error of the device.
    #[error("the window cannot be drawn: {0}")]
    Gpu(#[from] GpuError),
    /// The crowd cannot be shown.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
    /// The settings make no ball.
    #[error("no ball can be thrown: {0}")]
    Ball(#[from] AttackError),
    /// The screenshot could not be encoded.
    #[error(transparent)]
    Png(#[from] FilmError),
    /// The screenshot could not be written.
    #[error("{path}: {source}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
}

impl From<EventLoopError> for WindowError {
    fn from(error: EventLoopError) -> Self {
        // The error's text starts with a place in winit's code, which is left out.
        let text = match &error {
            EventLoopError::Os(error) => error.to_string(),
            other => other.to_string(),
        };
        let text = text
            .rsplit_once(": ")
            .map_or(text.as_str(), |(_, words)| words);
        Self::NoWindowSystem(text.trim_matches('"').to_owned())
    }
}
