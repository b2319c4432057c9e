use serde::Serialize;

use super::challenge::Challenge;
use super::side::Side;
use crate::graph::{EdgeId, MotionStep};
use crate::query::clearance::Clearance;
use crate::query::{Answer, Attack, Counts, Source};

/// An attack and the answer to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// The fighter that attacked.
    pub attacker: Side,
    /// Edge of the attack.
    pub strike: EdgeId,
    /// Edges that led to it.
    pub path: Vec<EdgeId>,
    /// Time of the announcement, seconds since the duel's start.
    pub announced: f32,
    /// Time from there to the impact, seconds.
    pub lead: f32,
    /// Attack; its clock starts with the announcement.
    pub attack: Attack,
    /// Whether it was avoided, by the exact test.
    pub avoided: bool,
    /// Smallest distance of the attack and the defender; negative for a hit.
    pub clearance: Clearance,
    /// Distance without the answer: [`Challenge::without`].
    pub without: f32,
    /// Edge of the evasion; `None` for a move.
    pub evasion: Option<EdgeId>,
    /// Steps of the answer, from the defender's next node on.
    pub answer: Vec<MotionStep>,
    /// Set that the candidates came from.
    pub source: Source,
    /// Number of candidates by result.
    pub counts: Counts,
}

impl Exchange {
    pub(super) fn new(challenge: &Challenge, answer: &Answer, clearance: Clearance) -> Self {
        Self {
            attacker: challenge.attacker,
            strike: challenge.strike,
            path: challenge.path.clone(),
            announced: challenge.announced,
            lead: challenge.lead,
            attack: challenge.attack.clone(),
            avoided: clearance.is_clean(),
            clearance,
            without: challenge.without,
            evasion: answer
                .candidates
                .get(answer.chosen)
                .and_then(|chosen| chosen.evasion),
            answer: answer.motion.steps().collect(),
            source: answer.source,
            counts: answer.counts,
        }
    }

    /// End of the attack, seconds since the duel's start.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.announced + self.attack.end()
    }
}

/// The score of a duel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Score {
    /// Hits of each fighter, by [`Side::index`].
    pub hits: [u32; 2],
    /// Attacks that each fighter avoided.
    pub dodges: [u32; 2],
    /// Number of attacks that were called off.
    pub called_off: u32,
}

impl Score {
    /// Counts exchanges.
    #[must_use]
    pub fn of(exchanges: &[Exchange], called_off: u32) -> Self {
        let mut score = Self {
            called_off,
            ..Self::default()
        };
        for exchange in exchanges {
            match exchange.avoided {
                true => score.dodges[exchange.attacker.other().index()] += 1,
                false => score.hits[exchange.attacker.index()] += 1,
            }
        }
        score
    }
}
