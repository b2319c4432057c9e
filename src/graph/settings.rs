use serde::{Deserialize, Serialize};

use super::{FeetSettings, GraphError, LinkSettings};

/// How a graph is built.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSettings {
    /// All clips are resampled to it, frames per second. Default 30.
    pub frame_rate: f64,
    /// How long a transition blends, seconds. Default 1/3 (Kovar).
    pub window: f64,
    /// Transitions whose windows lie further apart are not made: root of the mean squared distance
    /// of joints, metres. Default 0.10.
    pub threshold: f32,
    /// Of two transitions that start and end nearer than this to each other the closer one is kept,
    /// seconds. Default 1/3.
    pub separation: f64,
    /// Weight of each joint in the distance; empty for all alike.
    pub joint_weights: Vec<f32>,
    /// What counts as a planted foot, and whether transitions keep it from sliding.
    pub feet: FeetSettings,
    /// Links for the sake of events: looser transitions where they bring evasions near. `None` for
    /// a graph of the transitions under `threshold` alone.
    pub links: Option<LinkSettings>,
    /// Threads for the distance maps; 0 for as many as the machine has. The graph is the same for
    /// any number.
    pub threads: usize,
}

impl Default for GraphSettings {
    fn default() -> Self {
        Self {
            frame_rate: 30.0,
            window: 1.0 / 3.0,
            threshold: 0.10,
            separation: 1.0 / 3.0,
            joint_weights: Vec::new(),
            feet: FeetSettings::default(),
            links: Some(LinkSettings::default()),
            threads: 0,
        }
    }
}

impl GraphSettings {
    /// Frames per second that a graph may have.
    pub const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=480.0;

    /// A time of the settings in whole frames, at least one.
    pub(super) fn frames(&self, seconds: f64) -> usize {
        ((seconds * self.frame_rate).round() as usize).max(1)
    }

    /// The weight of each of a skeleton's joints.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub(super) fn checked_weights(&self, joints: usize) -> Result<Vec<f32>, GraphError> {
        let threshold = f64::from(self.threshold);
        let ranges = [
            (
                "frame_rate",
                self.frame_rate,
                Self::FRAME_RATES,
                "1 to 480 a second",
            ),
            ("window", self.window, 0.0..=10.0, "0 to 10 s"),
            ("separation", self.separation, 0.0..=60.0, "0 to 60 s"),
            ("threshold", threshold, 1e-6..=1e3, "0.000001 to 1000 m"),
        ];
        for (name, value, allowed, range) in ranges.into_iter().chain(self.feet.ranges()) {
            if !allowed.contains(&value) {
                return Err(GraphError::Setting { name, value, range });
            }
        }
        self.links.as_ref().map_or(Ok(()), LinkSettings::check)?;
        if self.joint_weights.is_empty() {
            return Ok(vec![1.0; joints]);
        }
        let weights = self.joint_weights.clone();
        let sound =
            weights.iter().all(|w| w.is_finite() && *w >= 0.0) && weights.iter().any(|&w| w > 0.0);
        let found = weights.len();
        if found == joints && sound {
            Ok(weights)
        } else {
            Err(GraphError::JointWeights { found, joints })
        }
    }
}
