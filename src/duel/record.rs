use serde::Serialize;

use super::challenge::Challenge;
use super::side::Side;
use crate::graph::{EdgeId, MotionStep};
use crate::query::clearance::Clearance;
use crate::query::{Answer, Attack, Counts, Source};

/// An attack and the answer to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// Fighter that attacked.
    pub attacker: Side,
    /// Edge of the attack.
    pub strike: EdgeId,
    /// Edges that led to the attack.
    pub path: Vec<EdgeId>,
    /// Time from the duel's start to the announcement, in seconds.
    pub announced: f32,
    /// Time from the announcement to the impact, in seconds.
    pub lead: f32,
    /// Attack. Its times count from the announcement.
    pub attack: Attack,
    /// Whether the attack was avoided, by the exact test.
    pub avoided: bool,
    /// Smallest distance of attack and defender. It is negative for a hit.
    pub clearance: Clearance,
    /// Clearance of a defender that does not react, in metres, as [`Challenge::without`].
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

    /// Time from the duel's start to the end of the attack, in seconds.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.announced + self.attack.end()
    }
}

/// The score of a duel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Score {
    /// Number of hits by each fighter, by [`Side::index`].
    pub hits: [u32; 2],
    /// Number of attacks that each fighter avoided, by [`Side::index`].
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
