//! Foot plants: finds the frames in which feet are planted, and keeps planted feet from sliding in
//! transitions.
//!
//! Source: the task and its parts are those of Kovar, Schreiner & Gleicher, "Footskate Cleanup for
//! Motion Capture Editing" (2002), and of Ikemoto, Arikan & Forsyth, "Knowing When to Put Your Foot
//! Down" (2006). Differs: the clips are not changed; their feet stay as captured. A transition
//! blends each foot with its own weights ([`LegBlend`]): only the source while the foot is planted
//! in the source, only the target once it is planted in the target, and a step through the air
//! between them. The remaining foot slide is that of the captures.

mod align;
mod blend;
mod build;
mod darts;
mod foot_plans;
mod keep;
mod plan;
mod plants;
mod settings;
mod slide;
mod standing;

use serde::{Deserialize, Serialize};

pub(in crate::graph) use align::Aligner;
pub(crate) use blend::LegBlend;
pub(super) use darts::{DartTest, PlantedClips};
pub(super) use foot_plans::{DartKey, FootPlans};
pub use settings::FeetSettings;
pub use slide::FootSlide;

use super::ids::{ClipId, EdgeId};
use crate::anim::Leg;

/// Range of frames of a clip in which a foot is planted, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plant {
    /// First frame.
    pub first: u32,
    /// Last frame.
    pub last: u32,
}

impl Plant {
    fn holds(self, frame: u32) -> bool {
        (self.first..=self.last).contains(&frame)
    }
}

/// Legs of a graph's skeleton, their plants in the clips and their blends in the transitions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Feet {
    legs: Vec<Leg>,
    /// Plants, `[clip][leg]`, in order of time.
    plants: Vec<Vec<Plant>>,
    /// Blends, `[edge][leg]`. Empty if feet are not kept planted.
    blends: Vec<Option<LegBlend>>,
    /// Maximum lowering of the root on each edge that keeps feet within reach, in metres. Empty if
    /// feet are not kept planted.
    #[serde(rename = "sinks")]
    root_drops: Vec<f32>,
}

impl Feet {
    /// Legs of the skeleton. Empty if the joints' names do not identify feet.
    #[must_use]
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Plants of a leg's foot in a clip.
    #[must_use]
    pub fn plants(&self, clip: ClipId, leg: usize) -> &[Plant] {
        &self.plants[clip.index() * self.legs.len() + leg]
    }

    /// Blend of a leg's foot on an edge, or `None` if the edge is not a transition or the foot is
    /// planted neither before nor after it.
    #[must_use]
    pub(crate) fn blend(&self, edge: EdgeId, leg: usize) -> Option<LegBlend> {
        let legs = self.legs.len();
        *self.blends.get(edge.index() * legs + leg)?
    }

    /// Maximum lowering of the root on an edge, in metres.
    #[must_use]
    pub fn max_root_drop(&self, edge: EdgeId) -> f32 {
        self.root_drops.get(edge.index()).copied().unwrap_or(0.0)
    }

    /// Whether the foot of a leg stands in a frame of a clip.
    pub(crate) fn stands(&self, clip: ClipId, leg: usize, frame: u32) -> bool {
        let plants = self.plants(clip, leg);
        let next = plants.partition_point(|plant| plant.last < frame);
        plants.get(next).is_some_and(|plant| plant.holds(frame))
    }
}
