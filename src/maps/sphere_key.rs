use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Where a moving sphere is at one moment; between two keys its centre and radius go in a straight
/// line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SphereKey {
    /// Seconds.
    pub t: f32,
    /// Metres.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}
