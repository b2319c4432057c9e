use std::path::PathBuf;
use std::time::Duration;

use sabaki_fixtures::headless::DeviceChoice;

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
pub(super) const PACE: Duration = Duration::from_micros(8000);
