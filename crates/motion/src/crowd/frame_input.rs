//! Input and report of a frame.

use glam::{Vec3, Vec4};

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
    /// The camera's frustum. `None`, the default: all characters are posed.
    pub frustum: Option<Frustum>,
}

/// The volume that a camera sees. Characters outside it are neither given levels nor posed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// Planes (normal, offset): a point p is inside where `normal · p + offset >= 0`. Normals have length 1.
    pub planes: [Vec4; 6],
    /// Radius of a sphere around each character, in metres.
    pub radius: f32,
    /// Height of the sphere's centre above the character's position, in metres.
    pub centre: f32,
}

/// Report of [`Crowd::frame`](super::Crowd::frame).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameReport {
    /// Number of characters that were moved to another place in the output.
    pub moved: usize,
    /// Whether all characters were sorted into new groups: many have changed, or the groups had become slow.
    pub sorted: bool,
}

impl Frustum {
    pub(super) fn contains(&self, position: Vec3) -> bool {
        let centre = (position + Vec3::Y * self.centre).extend(1.0);
        let depths = self.planes.iter().map(|plane| plane.dot(centre));
        let depth = depths.fold(f32::INFINITY, f32::min);
        // A position that is no number is inside, as in the kernel.
        depth >= -self.radius || depth.is_nan()
    }
}
