use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Position and radius of a moving sphere at one time, in the space of what it belongs to: the world for an attack. Both are interpolated linearly between keys.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphereKey {
    /// Time, in seconds.
    pub t: f32,
    /// Position of the centre, in metres.
    pub center: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}
