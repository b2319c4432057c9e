use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Settings of a duel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DuelSettings {
    /// Seed of the random choices of attacks and of the first postures.
    pub seed: u64,
    /// Distance of the fighters at the start, in metres. Default 1.5.
    pub opening: f32,
    /// Radius of the arena around the origin, in metres. No root leaves it. Default 3.
    pub arena: f32,
    /// Minimum distance of the roots in footwork, in metres. Default 0.55.
    pub closest: f32,
    /// Preferred distance of the roots if no attack requires another, in metres. Default 0.85.
    pub distance: f32,
    /// Time from the announcement of an attack to its impact, in seconds, chosen at random within these limits. Default 0.3 to 0.6. An attack
    /// is announced no later than its start.
    pub lead: LeadTime,
    /// Minimum depth by which an attack must enter trunk, head or thighs of an opponent that does not react, in metres. Default 0.02.
    pub depth: f32,
    /// Minimum time from the end of an attack to the next announcement, in seconds. Default 0.4.
    pub pause: f32,
    /// Time for which footwork is planned, in seconds. Default 1.2.
    pub window: f32,
    /// Time after which footwork is planned again, in seconds. Default 0.4.
    pub step: f32,
    /// Maximum time without an attack, in seconds. Default 20.
    pub patience: f32,
}

/// Limits of the time from the announcement of an attack to its impact, in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeadTime {
    /// Shortest time, in seconds.
    pub shortest: f32,
    /// Longest time, in seconds. If it is less than `shortest`, `shortest` is used.
    pub longest: f32,
}

impl Default for DuelSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            opening: 1.5,
            arena: 3.0,
            closest: 0.55,
            distance: 0.85,
            lead: LeadTime {
                shortest: 0.3,
                longest: 0.6,
            },
            depth: 0.02,
            pause: 0.4,
            window: 1.2,
            step: 0.4,
            patience: 20.0,
        }
    }
}

impl DuelSettings {
    /// Checks that every setting is in range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), DuelError> {
        let checks = [
            ("arena", self.arena, (0.5, 1000.0)),
            // A fighter that starts outside the arena cannot stay in it.
            (
                "opening",
                self.opening,
                (0.3, (2.0 * self.arena).min(100.0)),
            ),
            ("closest", self.closest, (0.0, 10.0)),
            ("distance", self.distance, (0.1, 100.0)),
            ("lead.shortest", self.lead.shortest, (0.0, 10.0)),
            ("lead.longest", self.lead.longest, (0.0, 10.0)),
            ("depth", self.depth, (0.0, 1.0)),
            ("pause", self.pause, (0.0, 60.0)),
            ("window", self.window, (0.1, 4.0)),
            ("step", self.step, (0.05, 4.0)),
            ("patience", self.patience, (0.1, 600.0)),
        ];
        for (name, value, (least, most)) in checks {
            if !(least..=most).contains(&value) {
                return Err(DuelError::Setting {
                    name,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }
}

/// Reason why a duel cannot start or continue.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum DuelError {
    /// A setting is out of range.
    #[error("duel setting {name} is {value}; it must be {least} to {most}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f32,
        /// Minimum value.
        least: f32,
        /// Maximum value.
        most: f32,
    },
    /// No edge of the graph is an attack.
    #[error("the graph has no attacks")]
    NoAttacks,
    /// The attacker found no attack that would hit.
    #[error("no fighter comes within reach of the other in {seconds} s")]
    OutOfReach {
        /// Time without an attack, in seconds.
        seconds: f32,
    },
}
