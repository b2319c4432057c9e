//! What a duel tells of an attack: its announcement, then how it ended.

use serde::{Deserialize, Serialize};

use crate::graph::{EdgeId, Motion, MotionStep, Playhead};
use crate::query::clearance::Clearance;
use crate::query::{Answer, Attack, Counts, Request, Source};

/// One of the two fighters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The fighter that attacks first.
    White,
    /// The other fighter.
    Blue,
}

impl Side {
    /// The other fighter.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::White => Self::Blue,
            Self::Blue => Self::White,
        }
    }

    /// The index of the fighter in arrays: 0 or 1.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::White => 0,
            Self::Blue => 1,
        }
    }

    /// The name: `white` or `blue`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Blue => "blue",
        }
    }
}

/// An announced attack.
#[derive(Clone, Debug, PartialEq)]
pub struct Challenge {
    /// Fighter that attacks.
    pub attacker: Side,
    /// Current position of the fighter that is attacked.
    pub playhead: Playhead,
    /// Motion of the attacked fighter from now on. Its blend fades out in every answer.
    pub playing: Motion,
    /// Attack, in the world of the duel. Its times count from now.
    pub attack: Attack,
    /// Edge of the attack.
    pub strike: EdgeId,
    /// Edges that lead to the attack, from the attacker's next node when it decides to attack.
    pub path: Vec<EdgeId>,
    /// Time from the duel's start to the announcement, in seconds.
    pub announced: f32,
    /// Time from now to the impact, in seconds.
    pub lead: f32,
    /// Clearance of a fighter that does not react, in metres. It is below 0.
    pub without: f32,
}

impl Challenge {
    /// Request of the attacked fighter.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request {
            playing: Some(self.playing.moment_at(0.0)),
            ..Request::new(self.playhead, &self.attack)
        }
    }
}

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
    pub fn new(exchanges: &[Exchange], called_off: u32) -> Self {
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
