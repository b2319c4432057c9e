//! Spheres.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Position of the centre, in metres. Files call it `offset`.
    #[serde(rename = "offset")]
    pub centre: Vec3,
    /// Radius, in metres.
    pub radius: f32,
}

impl Sphere {
    /// The sphere with this centre and radius, in metres.
    #[must_use]
    pub fn new(centre: Vec3, radius: f32) -> Self {
        Self { centre, radius }
    }

    /// A sphere that contains all `spheres`, centred in the bounding box of their centres.
    #[doc(hidden)]
    pub fn around(spheres: &[Self]) -> Self {
        let centres = || spheres.iter().map(|sphere| sphere.centre);
        let low = centres().fold(Vec3::INFINITY, Vec3::min);
        let high = centres().fold(Vec3::NEG_INFINITY, Vec3::max);
        let centre = (low + high) / 2.0;
        let reach = |sphere: &Self| sphere.centre.distance(centre) + sphere.radius;
        let radius = spheres.iter().map(reach).fold(0.0, f32::max);
        Self { centre, radius }
    }
}
