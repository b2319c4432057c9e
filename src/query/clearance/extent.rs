//! What the exact tests find, and how far they search.

use serde::{Deserialize, Serialize};

use crate::maps::BodyTrack;

/// The smallest distance of body and attack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clearance {
    /// Distance of the surfaces, in metres. It is negative if they overlap.
    pub metres: f32,
    /// Time from the query to the moment of the smallest distance, in seconds.
    pub time: f32,
    /// Index of the body's sphere.
    pub body_sphere: usize,
}

impl Clearance {
    /// An infinite clearance.
    #[must_use]
    pub fn none(time: f32) -> Self {
        Self {
            metres: f32::INFINITY,
            time,
            body_sphere: 0,
        }
    }

    /// Whether the attack is avoided.
    pub fn is_clean(&self) -> bool {
        self.metres >= 0.0
    }
}

/// Entry of a motion into an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObstacleHit {
    /// Depth times the obstacle's weight, in metres.
    pub harm: f32,
    /// Time since the start of the motion, in seconds.
    pub time: f32,
    /// The body's sphere that enters deepest.
    pub sphere: usize,
}

impl ObstacleHit {
    /// The entry as a clearance below 0.
    pub fn as_clearance(self) -> Clearance {
        Clearance {
            metres: -self.harm,
            time: self.time,
            body_sphere: self.sphere,
        }
    }
}

/// Samples of the body per second.
pub const SAMPLE_RATE: f32 = BodyTrack::RATE;

/// Range in which a test computes exact distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Distances are clamped to this value, in metres.
    pub below: f32,
    /// The search stops once it finds a distance below this value, in metres. The true distance may then be smaller.
    pub enough: f32,
}

impl Extent {
    /// The exact smallest distance over the whole attack.
    pub const WHOLE: Self = Self {
        below: f32::INFINITY,
        enough: f32::NEG_INFINITY,
    };

    /// The exact smallest distance of a clean motion. The search stops at the first hit it finds.
    pub const UNTIL_HIT: Self = Self {
        enough: 0.0,
        ..Self::WHOLE
    };
}

/// Which samples of a motion are tested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampling {
    /// Every sample at which the attack may be near.
    #[default]
    Each,
    /// Every fourth sample, then the samples between those where the attack is near. Every hit that it reports is a hit. It may
    /// overestimate the clearance of a body that leaves the straight line between two such samples by more than 2.5 cm.
    CoarseFirst,
}

impl Sampling {
    /// Number of samples from one sample that is always tested to the next.
    pub(super) fn interval(self) -> usize {
        match self {
            Self::Each => 1,
            Self::CoarseFirst => BodyTrack::INTERVAL,
        }
    }
}
