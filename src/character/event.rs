use serde::{Deserialize, Serialize};

use super::ids::{CharacterId, ThreatId};

/// Event of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharacterEvent {
    /// The character.
    pub character: CharacterId,
    /// Time on the clock of [`Characters::now`](super::Characters::now), in seconds.
    pub time: f64,
    /// Kind of the event.
    pub kind: CharacterEventKind,
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CharacterEventKind {
    /// A motion that avoids all known threats was found. It is taken over after the delay of the settings.
    Planned {
        /// Smallest distance from the threats on it, in metres.
        clearance: f32,
        /// Whether the motion replaces a plan that a threat has come to hit.
        is_change: bool,
    },
    /// The played motion avoids all known threats, and is kept. It is reported once for the same threats, wherever they move, and again only
    /// after they could not be avoided.
    Kept {
        /// Smallest distance from the threats, in metres; that of the first hit.
        clearance: f32,
    },
    /// A planned motion began.
    Began,
    /// No motion avoids the threats that are known.
    Cannot,
    /// No motion avoids both the threats and the obstacles. The motion with the least harm is taken, or the played one continues.
    Cornered {
        /// Depth of the hit on that motion, in metres; 0 or less if it is not hit.
        hit: f32,
        /// Depth in an obstacle times its weight, in metres; 0 for none.
        entered: f32,
    },
    /// A threat that might have reached the body has passed. Threats that were always too far away are not reported.
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
