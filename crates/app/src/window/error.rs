use std::path::PathBuf;

use thiserror::Error;
use winit::error::EventLoopError;

use crate::film::FilmError;
use crate::live::MarchError;
use sabaki::gpu::GpuError;
use sabaki::query::AttackError;

/// Why there is no window, or no longer.
#[derive(Debug, Error)]
pub enum WindowError {
    /// Nothing that a window could be opened on: no X or Wayland server, for instance.
    #[error("there is no window system to open a window on: {0}")]
    NoWindowSystem(String),
    /// There is a window system, but it gives no window.
    #[error("no window could be opened: {0}")]
    NoWindow(String),
    /// The device's.
    #[error("the window cannot be drawn: {0}")]
    Gpu(#[from] GpuError),
    /// A crowd's.
    #[error(transparent)]
    March(#[from] MarchError),
    /// Settings that make no ball.
    #[error("no ball can be thrown: {0}")]
    Ball(#[from] AttackError),
    /// A screenshot was asked for, but this window system does not let pictures be read back.
    #[error("this window system does not let its pictures be read")]
    NotReadable,
    /// A screenshot that is no PNG.
    #[error(transparent)]
    Png(#[from] FilmError),
    /// A screenshot that was not written.
    #[error("{path}: {source}")]
    Write {
        /// Where to.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
}

impl WindowError {
    pub(super) fn of_loop(error: EventLoopError) -> Self {
        // What it prints has the place in its code in front, which is of no use to anybody.
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
