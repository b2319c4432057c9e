//! Input and report of a frame.

use glam::Vec3;

use crate::lod::Switching;

/// Input of [`Crowd::frame`](super::Crowd::frame).
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// Time since the previous frame, in seconds. Default 0.
    pub seconds: f64,
    /// The distances from `eye` at which levels of detail change. `None`, the default: characters keep their levels.
    pub switching: Option<&'a Switching>,
    /// The camera's position in the world, in metres. Only `switching` uses it.
    pub eye: Vec3,
}

/// Report of [`Crowd::frame`](super::Crowd::frame).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameReport {
    /// Number of characters that were moved to another place in the output.
    pub moved: usize,
    /// Whether all characters were sorted into new groups: many have changed, or the groups had become slow.
    pub sorted: bool,
}
