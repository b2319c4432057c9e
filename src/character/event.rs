use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::anim::JointId;
use crate::graph::EdgeId;

/// Identifies a character of [`Characters`](super::Characters). It is not used again after the character is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CharacterId {
    pub(super) index: u32,
    pub(super) generation: u32,
}

impl CharacterId {
    /// Index of its place among the characters. A removed character's place is used again.
    #[must_use]
    pub fn index(self) -> u32 {
        self.index
    }

    /// As one number, for interfaces to other languages.
    #[must_use]
    pub fn to_bits(self) -> u64 {
        u64::from(self.generation) << 32 | u64::from(self.index)
    }

    /// The id of a number of [`CharacterId::to_bits`].
    #[must_use]
    pub fn from_bits(bits: u64) -> Self {
        Self {
            index: bits as u32,
            generation: (bits >> 32) as u32,
        }
    }
}

/// Identifies a threat of [`Characters`](super::Characters).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ThreatId(pub u64);

/// Event of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharacterEvent {
    /// The character.
    pub character: CharacterId,
    /// Time of the game ([`Characters::now`](super::Characters::now)), in seconds.
    pub time: f64,
    /// Kind of the event.
    pub kind: CharacterEventKind,
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CharacterEventKind {
    /// A motion that avoids all known threats was found. It begins after [`CharacterSettings::delay`](super::CharacterSettings::delay).
    Planned {
        /// Smallest distance from the threats on it, in metres.
        clearance: f32,
        /// Whether the motion replaces an earlier plan that a threat would now hit.
        is_change: bool,
        /// The threat that comes first.
        threat: ThreatId,
        /// Time of the game at which that threat is nearest, in seconds.
        contact: f64,
    },
    /// The played motion avoids all known threats and continues. It is reported once for the same threats, even if they move, and again only
    /// after they could not be avoided.
    Kept {
        /// Smallest distance from the threats, in metres.
        clearance: f32,
    },
    /// A planned motion began.
    Began,
    /// A planned motion has ended, or was left because its threats have passed: the character follows its goal again.
    Ended,
    /// No motion avoids all known threats. The one that hits first is given up, so that the others are avoided. It is reported once for each
    /// that is given up.
    Cannot,
    /// No motion avoids both the threats and the obstacles. The motion with the least harm is taken, or the played one continues.
    Cornered {
        /// Depth of the hit on that motion, in metres; 0 or less if it is not hit.
        hit: f32,
        /// Depth in an obstacle times its weight, in metres; 0 for none.
        entered: f32,
    },
    /// An obstacle was put on the body, which is shoved out at the speed of a run. It is reported once until the body is free.
    Shoved,
    /// The body is in an obstacle, and there is no free place around it. It is reported once until the body is free.
    Stuck {
        /// Depth in the obstacle, in metres.
        depth: f32,
    },
    /// A threat that might have reached the body has passed. It is reported once for each threat, and not for one that was always too far away.
    MissedBy {
        /// The threat.
        threat: ThreatId,
        /// Smallest distance, in metres. Above 0.3 m it is the distance at the moment in which the threat passed.
        metres: f32,
    },
    /// A threat touches the body for the first time. Numbers are those of the moment of the step in which it is deepest.
    Hit {
        /// The threat.
        threat: ThreatId,
        /// The joint that it touches.
        joint: JointId,
        /// The point of the body's surface that is deepest in the threat, in the world, in metres.
        point: Vec3,
        /// Depth, in metres.
        depth: f32,
        /// Unit direction from the body to the threat, in the world.
        normal: Vec3,
    },
    /// A strike of the character ([`Goal::Strike`](super::Goal::Strike)) is announced: from now on others avoid the limb.
    Strikes {
        /// The limb as a threat. [`Characters::limb`](super::Characters::limb) says where it is.
        threat: ThreatId,
        /// Edge of the graph that plays the attack.
        attack: EdgeId,
        /// Time of the game at which the limb has reached furthest, in seconds.
        contact: f64,
    },
    /// The striking limb of another character touches the body for the first time. Numbers are those of the moment of the step in which it is
    /// deepest.
    Struck {
        /// The character that strikes.
        by: CharacterId,
        /// The limb.
        threat: ThreatId,
        /// The joint that is struck.
        joint: JointId,
        /// The point of the body's surface that is deepest in the limb, in the world, in metres.
        point: Vec3,
        /// Depth, in metres.
        depth: f32,
        /// Speed of the limb relative to what it strikes, in metres per second.
        speed: f32,
    },
    /// A strike of the character has ended.
    StrikeEnded {
        /// Whether the attack was played to its end; if not, it was broken off to avoid a threat, or by [`Characters::release`](super::Characters::release).
        is_whole: bool,
    },
}
