use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::MeshError;

/// Settings of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitSettings {
    /// Maximum distance by which the mesh may stick out of the spheres, in metres. Default 0.02.
    pub cover: f32,
    /// Maximum distance by which the spheres may stick out of the mesh, in metres. Default 0.01.
    pub bulge: f32,
    /// Maximum number of spheres for each joint. Default 64. If they are too few for
    /// [`FitSettings::cover`], the report says so.
    pub most_spheres: usize,
    /// Maximum distance of a vertex from all bones, or from the hand that holds the mesh, in
    /// metres. A larger distance is an error, because the mesh has another scale or position.
    /// Default 1, or 10 for props.
    pub furthest: f32,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            cover: 0.02,
            bulge: 0.01,
            most_spheres: 64,
            furthest: 1.0,
        }
    }
}

impl FitSettings {
    /// Settings for a prop.
    pub const HELD: Self = Self {
        cover: 0.02,
        bulge: 0.01,
        most_spheres: 64,
        furthest: 10.0,
    };

    /// Whether distances are 1 mm to 10 m and the number of spheres is 1 to 1000.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let lengths = [self.cover, self.bulge, self.furthest];
        lengths.iter().all(|metres| (0.001..=10.0).contains(metres))
            && (1..=1000).contains(&self.most_spheres)
    }
}

/// Reason why a mesh cannot be fitted.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// A setting is out of range.
    #[error(
        "a fit needs errors and distances of 0.001 to 10 m and 1 to 1000 spheres a joint: {0:?}"
    )]
    Settings(FitSettings),
    /// The frame of the bind pose does not exist, or the clip has another skeleton.
    #[error(
        "the bind pose should be frame {frame} of clip \"{clip}\", which has {frames} frames of its own skeleton"
    )]
    NoFrame {
        /// Name of the clip.
        clip: String,
        /// Frame, counted from 0.
        frame: usize,
        /// Number of frames of the clip.
        frames: usize,
    },
    /// A vertex is too far from all bones.
    #[error(
        "vertex {vertex} is {metres:.2} m from the nearest bone (of joint \"{joint}\"), {furthest} m is the most: another scale, place or bind pose?"
    )]
    Far {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// Distance to the nearest bone, in metres.
        metres: f32,
        /// Name of the nearest bone's joint.
        joint: String,
        /// Maximum distance, in metres.
        furthest: f32,
    },
    /// The mesh or its placement is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}
