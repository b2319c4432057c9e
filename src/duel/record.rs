use serde::Serialize;

use super::{Challenge, Side};
use crate::graph::{EdgeId, Step};
use crate::query::clearance::Clearance;
use crate::query::{Answer, Attack, Counts, Source};

/// What became of a challenge.
#[derive(Clone, Debug, PartialEq)]
pub enum Settled {
    /// It was fought out.
    Fought(Box<Exchange>),
    /// The fighters would have run into each other or out of the arena.
    CalledOff,
}

/// An attack and the answer to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// Who struck.
    pub attacker: Side,
    /// The attack's edge.
    pub strike: EdgeId,
    /// The edges that led to it.
    pub path: Vec<EdgeId>,
    /// When it was announced, seconds since the duel's start.
    pub announced: f32,
    /// From there to the blow, seconds.
    pub lead: f32,
    /// Where it passed; its clock starts with the announcement.
    pub attack: Attack,
    /// Whether it was avoided: exactly tested.
    pub avoided: bool,
    /// The smallest distance of the attack and who avoided it. Negative: a hit.
    pub clearance: Clearance,
    /// [`Challenge::without`].
    pub without: f32,
    /// The evasion's edge; `None` where it was avoided by moving on.
    pub evasion: Option<EdgeId>,
    /// The steps that avoided, from the defender's next node on.
    pub answer: Vec<Step>,
    /// Where the candidates came from, and how many there were.
    pub source: Source,
    /// See [`Exchange::source`].
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
            evasion: { answer.candidates.get(answer.chosen) }.and_then(|chosen| chosen.evasion),
            answer: answer.motion.steps().collect(),
            source: answer.source,
            counts: answer.counts,
        }
    }

    /// When the attack ends, seconds since the duel's start.
    #[must_use]
    pub fn end(&self) -> f32 {
        self.announced + self.attack.end()
    }
}

/// How a duel stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Score {
    /// Blows that each landed, by [`Side::index`].
    pub hits: [u32; 2],
    /// Blows that each avoided.
    pub dodges: [u32; 2],
    /// Attacks that would have ended in each other or outside of the arena.
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
