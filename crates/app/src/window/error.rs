use std::path::PathBuf;

use thiserror::Error;
use winit::error::EventLoopError;

use crate::film::FilmError;
use crate::live::LiveCrowdError;
use sabaki::gpu::GpuError;
use sabaki::query::AttackError;

/// Why a window could not be opened, or was closed.
#[derive(Debug, Error)]
pub enum WindowError {
    /// No window system, for instance no X or Wayland server.
    #[error("there is no window system to open a window on: {0}")]
    NoWindowSystem(String),
    /// The window system refuses the window.
    #[error("no window could be opened: {0}")]
    NoWindow(String),
    /// An error of the device.
    #[error("the window cannot be drawn: {0}")]
    Gpu(#[from] GpuError),
    /// An error of the crowd.
    #[error(transparent)]
    LiveCrowd(#[from] LiveCrowdError),
    /// The settings make no ball.
    #[error("no ball can be thrown: {0}")]
    Ball(#[from] AttackError),
    /// The window system does not allow screenshots.
    #[error("this window system does not let its pictures be read")]
    NotReadable,
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

impl WindowError {
    pub(super) fn of_loop(error: EventLoopError) -> Self {
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
