use serde::{Deserialize, Serialize};

use super::ids::{CharacterId, ThreatId};

/// What happened in a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharacterEvent {
    /// The character.
    pub character: CharacterId,
    /// Time on the clock of [`Characters::now`](super::Characters::now), in seconds.
    pub time: f64,
    /// What happened.
    pub kind: CharacterEventKind,
}

/// What happened to a character.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CharacterEventKind {
    /// A motion that avoids all known threats was found. It is taken over after the delay of the settings.
    Planned {
        /// Smallest distance from the threats on it, in metres.
        clearance: f32,
        /// Whether it replaces a plan that a threat came to hit.
        is_change: bool,
    },
    /// What is played already avoids all known threats, and is kept. Of the same threats it is not said again, wherever they move, unless
    /// they could not be avoided meanwhile.
    Kept {
        /// Smallest distance from the threats, in metres; that of the first hit.
        clearance: f32,
    },
    /// A planned motion began.
    Began,
    /// No motion avoids the threats that are known.
    Cannot,
    /// No motion avoids both the threats and the obstacles. The one with the least harm is taken, or what is played goes on.
    Cornered {
        /// Depth of the hit on it, in metres; 0 or less for none.
        hit: f32,
        /// Depth in an obstacle times its weight, in metres; 0 for none.
        entered: f32,
    },
    /// A threat that might have reached the body has passed. Of one that was too far away all the time, nothing is said.
    MissedBy {
        /// The threat.
        threat: ThreatId,
        /// Smallest distance, in metres. If it is more than 0.3 m, it is that of the moment in which the threat passed.
        metres: f32,
    },
    /// A threat touches the body for the first time.
    Hit {
        /// The threat.
        threat: ThreatId,
    },
}
