use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Position and radius of a moving sphere at one time. Both are interpolated linearly between keys. The space is that of the object that the
/// key belongs to; for an attack it is the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphereKey {
    /// Time, in seconds.
    pub t: f32,
    /// Position of the centre, in metres.
    pub center: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}
