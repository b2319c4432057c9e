use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::ids::{CharacterId, ThreatId};
use super::settings::CharacterSettings;
use super::steer::Steering;
use super::threat::Threat;
use crate::maps::BakedGraph;
use crate::query::Obstacle;

/// Data that all characters of a step share.
pub(super) struct World<'a> {
    pub baked: &'a BakedGraph,
    pub settings: &'a CharacterSettings,
    pub steering: &'a Steering,
    pub threats: &'a [KnownThreat],
    /// Obstacles, at the start of the step.
    pub obstacles: &'a [Obstacle],
    /// The other characters, if they avoid each other.
    pub bodies: &'a [OtherBody],
    /// Time at the start of the step, in seconds.
    pub now: f64,
    pub dt: f32,
}

impl<'a> World<'a> {
    /// Time at the end of the step, in seconds.
    pub(super) fn end(&self) -> f64 {
        self.now + f64::from(self.dt)
    }

    /// The threats that a character has to avoid.
    pub(super) fn threats_of(
        &self,
        id: CharacterId,
    ) -> impl Iterator<Item = &'a KnownThreat> + use<'a> {
        let concerns = move |known: &&KnownThreat| known.threat.concerns(id);
        self.threats.iter().filter(concerns)
    }
}

/// A threat and the number of its changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct KnownThreat {
    pub id: ThreatId,
    pub version: u32,
    pub threat: Threat,
}

/// A character as the others see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OtherBody {
    pub index: u32,
    /// Position on the ground (x, z), in metres.
    pub place: Vec2,
    /// Velocity on the ground (x, z), in metres per second.
    pub velocity: Vec2,
}
