use serde::{Deserialize, Serialize};

use super::{FeetSettings, GraphError, LinkSettings};
use crate::anim::CompressionSettings;

/// Settings of a graph build.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraphSettings {
    /// Frame rate to which all clips are resampled, in frames per second. Default 30.
    pub frame_rate: f64,
    /// Length of a transition's blend, in seconds. Default 1/3 (Kovar).
    pub window: f64,
    /// Maximum distance of a transition's windows: root of the mean squared distance of joints, in
    /// metres. Default 0.10.
    pub threshold: f32,
    /// Minimum separation of two transitions between the same clips, in seconds. Of closer ones the
    /// better one is kept. Default 1/3.
    pub separation: f64,
    /// Weight of each joint in the distance. Default: empty, which weights all joints equally.
    pub joint_weights: Vec<f32>,
    /// Thresholds for planted feet, and whether transitions keep them planted.
    #[doc(hidden)]
    pub feet: FeetSettings,
    /// Settings of links: transitions with a looser threshold that bring evasions within reach.
    /// `None` builds a graph of the transitions under `threshold` alone.
    #[doc(hidden)]
    pub links: Option<LinkSettings>,
    /// Largest errors that compressing the clips may cause. `None` keeps them plain. The graph is built from the decoded
    /// clips. Default 0.1 mm at the joints and 0.3 mm at the ends.
    pub compression: Option<CompressionSettings>,
    /// Number of threads for the distance maps, or 0 for one thread per CPU core. The graph does
    /// not depend on it.
    pub threads: usize,
    /// Memory that a build may take, in bytes. Input that would take more by an estimate is rejected before the work begins.
    /// Default 8 GiB.
    pub memory: u64,
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
            compression: Some(CompressionSettings::default()),
            threads: 0,
            memory: Self::MEMORY,
        }
    }
}

impl GraphSettings {
    /// Range of frame rates that a graph may have, in frames per second.
    pub const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=480.0;

    /// Converts a time to whole frames, at least one.
    pub(super) fn frames(&self, seconds: f64) -> usize {
        ((seconds * self.frame_rate).round() as usize).max(1)
    }

    /// Checks the settings and returns the weight of each joint.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub(super) fn checked_weights(&self, joints: usize) -> Result<Vec<f32>, GraphError> {
        let threshold = f64::from(self.threshold);
        let compression = self.compression.unwrap_or_default();
        let [joint_error, end_error] =
            [compression.joint_error, compression.end_error].map(f64::from);
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
            ("joint_error", joint_error, 1e-6..=1.0, "0.000001 to 1 m"),
            ("end_error", end_error, 1e-6..=1.0, "0.000001 to 1 m"),
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
