use serde::{Deserialize, Serialize};

use super::ids::ThreatId;
use super::settings::CharacterSettings;
use super::steer::Steering;
use super::threat::Threat;
use crate::maps::BakedGraph;

/// What all characters of a step share.
pub(super) struct World<'a> {
    pub baked: &'a BakedGraph,
    pub settings: &'a CharacterSettings,
    pub steering: &'a Steering,
    pub threats: &'a [KnownThreat],
    /// Time at the start of the step, in seconds.
    pub now: f64,
    pub dt: f32,
}

/// A threat and the number of its changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct KnownThreat {
    pub id: ThreatId,
    pub version: u32,
    pub threat: Threat,
}
