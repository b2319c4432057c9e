use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How a duel is fought. Seconds, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DuelSettings {
    /// Where chance begins: which attacks are preferred, and in which postures the fighters begin.
    pub seed: u64,
    /// From one fighter to the other at the start. Default 1.5.
    pub opening: f32,
    /// Radius of the arena around the origin, which no fighter's root leaves. Default 3.
    pub arena: f32,
    /// Roots do not come nearer to each other while fighters choose where to go. Default 0.55.
    pub closest: f32,
    /// How far from each other fighters like to stand where no attack says so. Default 0.85.
    pub distance: f32,
    /// The shortest and longest time from the announcement of an attack to its blow; chance chooses. Default 0.5 to 1.3. Who takes
    /// longer to get there announces it on the way.
    pub lead: (f32, f32),
    /// An attack is made only if it would go this deep into trunk, head or thighs of who does nothing. Default 0.02.
    pub depth: f32,
    /// Between the end of an attack and the announcement of the next one, at least. Default 0.4.
    pub pause: f32,
    /// How far ahead steps are planned, and after how long they are planned anew. Default 1.2 and 0.4.
    pub window: f32,
    /// See [`DuelSettings::window`].
    pub step: f32,
    /// How long one may try to come within reach. Default 20.
    pub patience: f32,
}

impl Default for DuelSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            opening: 1.5,
            arena: 3.0,
            closest: 0.55,
            distance: 0.85,
            lead: (0.5, 1.3),
            depth: 0.02,
            pause: 0.4,
            window: 1.2,
            step: 0.4,
            patience: 20.0,
        }
    }
}

impl DuelSettings {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first one that is not, by name.
    pub fn check(&self) -> Result<(), DuelError> {
        let checks = [
            ("opening", self.opening, (0.3, 100.0)),
            ("arena", self.arena, (0.5, 1000.0)),
            ("closest", self.closest, (0.0, 10.0)),
            ("distance", self.distance, (0.1, 100.0)),
            ("lead.0", self.lead.0, (0.0, 10.0)),
            ("lead.1", self.lead.1, (0.0, 10.0)),
            ("depth", self.depth, (0.0, 1.0)),
            ("pause", self.pause, (0.0, 60.0)),
            ("window", self.window, (0.1, 4.0)),
            ("step", self.step, (0.05, 4.0)),
            ("patience", self.patience, (0.1, 600.0)),
            // Who begins outside of the arena cannot stay in it.
            ("opening", 0.5 * self.opening, (0.0, self.arena)),
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

/// Why there is no duel.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum DuelError {
    /// A setting is out of its range.
    #[error("duel setting {name} is {value}; it must be {least} to {most}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f32,
        /// What it may be at least.
        least: f32,
        /// At most.
        most: f32,
    },
    /// No edge of the graph is an attack.
    #[error("the graph has no attacks: nobody can strike")]
    NoAttacks,
    /// The attacker found no way to strike.
    #[error("nobody comes within reach of the other one in {seconds} s")]
    OutOfReach {
        /// How long it was tried.
        seconds: f32,
    },
}
