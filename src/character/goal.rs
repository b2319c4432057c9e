use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::error::{ANY, CharacterError, FURTHEST, shorter, within};
use super::event::CharacterId;
use crate::anim::JointId;
use crate::graph::EdgeId;

/// Goal of a character, which it follows while nothing threatens it. Heights are ignored, but for that of a place to strike; headings are those of [`Rigid2`](crate::math::Rigid2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    /// Stands idle; the clips may move and turn the body a little. [`Goal::Face`] holds a heading.
    #[default]
    Idle,
    /// Walks or runs as the clips allow. If no clip is fast enough, or none moves backwards or sideways, the character goes slower or turns.
    Walk {
        /// Velocity over the ground in the world, at most 100 m/s.
        velocity: Vec3,
        /// Heading of the body in the world, in radians; `None`: face the direction of travel.
        facing: Option<f32>,
    },
    /// Stands and turns to a heading, in radians.
    Face {
        /// Heading, in radians.
        heading: f32,
    },
    /// Goes to a point and stops there.
    GoTo {
        /// The point in the world, in metres; at most 5 km from the origin.
        point: Vec3,
        /// Speed on the way, 0 to 100 m/s.
        speed: f32,
    },
    /// Stops as soon as it can, then stands.
    Stop,
    /// Goes to where an attack of the clips reaches what it strikes, and strikes: again and again, while this is the goal. A strike that has begun
    /// goes on to its end, unless a threat has to be avoided. The limb is a threat to all other characters from the beginning of the strike on.
    Strike {
        /// What is struck.
        at: StrikeAt,
        /// With which attacks.
        kind: StrikeKind,
    },
}

/// What a [`Goal::Strike`] strikes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum StrikeAt {
    /// A point in the world, in metres; at most 5 km from the origin.
    Place(Vec3),
    /// The trunk of another character. While there is none, the character stands.
    Character(CharacterId),
}

/// The attacks that a [`Goal::Strike`] may choose from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum StrikeKind {
    /// All.
    #[default]
    Any,
    /// The one that an edge plays: [`AttackMove::edge`](crate::maps::AttackMove::edge) of [`BakedGraph::attack_moves`](crate::maps::BakedGraph::attack_moves).
    Attack(EdgeId),
    /// Those in which a joint strikes.
    Limb(JointId),
}

/// Velocity and heading that a goal demands at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Aim {
    /// Velocity over the ground (x, z), in metres per second.
    pub velocity: Vec2,
    /// Heading of the body, in radians; `None`: face the direction of travel.
    pub facing: Option<f32>,
}

/// A character that goes slower stands, in metres per second.
pub(super) const STANDING: f32 = 0.15;

impl Goal {
    /// Checks that every number is finite, every speed at most 100 m/s, and every point within 5 km of the origin.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), CharacterError> {
        const FASTEST: f32 = 100.0;
        match *self {
            Self::Idle | Self::Stop => Ok(()),
            Self::Walk { velocity, facing } => {
                shorter("the speed of the goal", velocity, FASTEST)?;
                within("the heading of the goal", facing.unwrap_or_default(), ANY)
            }
            Self::Face { heading } => within("the heading of the goal", heading, ANY),
            Self::GoTo { point, speed } => {
                shorter("the distance of the goal from the origin", point, FURTHEST)?;
                within("the speed of the goal", speed, 0.0..=FASTEST)
            }
            Self::Strike { at, .. } => match at {
                StrikeAt::Place(place) => {
                    shorter("the distance of the goal from the origin", place, FURTHEST)
                }
                StrikeAt::Character(_) => Ok(()),
            },
        }
    }

    /// Aim for a character at a place (x, z), in metres; that of a strike is found otherwise. `has_arrived` says whether the character reached the goal's point before, and is updated.
    pub(super) fn aim(&self, place: Vec2, has_arrived: &mut bool) -> Aim {
        /// Distance from the point within which a character has arrived, in metres.
        const ARRIVED: f32 = 0.15;
        /// Distance from the point beyond which a character that had arrived goes back, in metres.
        const LEFT: f32 = 0.45;
        /// Time in which the rest of the way is walked, in seconds.
        const BRAKING: f32 = 0.5;
        match *self {
            Self::Idle | Self::Stop | Self::Strike { .. } => Aim::default(),
            Self::Walk { velocity, facing } => Aim {
                velocity: Vec2::new(velocity.x, velocity.z),
                facing,
            },
            Self::Face { heading } => Aim {
                velocity: Vec2::ZERO,
                facing: Some(heading),
            },
            Self::GoTo { point, speed } => {
                let way = Vec2::new(point.x, point.z) - place;
                let far = way.length();
                *has_arrived = far < if *has_arrived { LEFT } else { ARRIVED };
                if *has_arrived {
                    return Aim::default();
                }
                Aim {
                    velocity: way * (speed.min(far / BRAKING) / far),
                    facing: None,
                }
            }
        }
    }
}

impl Aim {
    /// Whether the character shall stand.
    pub(super) fn stands(&self) -> bool {
        self.velocity.length() < STANDING
    }

    /// The heading that the body should have, if any.
    pub(super) fn heading(&self) -> Option<f32> {
        match self.facing {
            Some(heading) => Some(heading),
            None if self.stands() => None,
            None => Some(heading_of(self.velocity)),
        }
    }

    /// Whether the aims differ so much that the played motion should be chosen again.
    pub(super) fn differs(&self, other: &Self) -> bool {
        let faster = (self.velocity.length() - other.velocity.length()).abs();
        let turned = match (self.heading(), other.heading()) {
            (Some(a), Some(b)) => wrapped(a - b).abs(),
            (None, None) => 0.0,
            _ => PI,
        };
        faster > 0.2 || turned > 0.2
    }
}

/// Heading of a direction on the ground (x, z), in radians.
pub(super) fn heading_of(way: Vec2) -> f32 {
    way.x.atan2(way.y)
}

/// Direction of a heading (x, z).
pub(super) fn direction(heading: f32) -> Vec2 {
    let (sin, cos) = heading.sin_cos();
    Vec2::new(sin, cos)
}

/// The angle modulo 2π, in [-π, π], in radians.
pub(super) fn wrapped(angle: f32) -> f32 {
    angle - TAU * (angle / TAU).round()
}
