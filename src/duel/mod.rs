//! Two fighters of one graph: one attacks, the other avoids, in turn.
//!
//! Source: the task that Masaoka & Oshita leave for later (their section 7), with the attacks chosen as in Lee & Lee,
//! "Precomputing Avatar Behavior from Human Motion Data" (2004): by a grid at each node over where the other one is
//! ([`AttackGrid`]). Differs: what a grid does not reach is approached by a search through the graph, since two moving fighters
//! must also stay in their arena and out of each other, of which a table made beforehand knows nothing.
//!
//! A [`Duel`] has its own clock. [`Duel::challenge`] lets time pass until the one whose turn it is can strike, and says what is
//! coming; anybody answers it, by a [`Query`](crate::query::Query) on whatever culls; [`Duel::settle`] lets both play what they chose, holds the
//! answer to the exact test, and changes the roles. What both did is there to be played back.
//!
//! The same settings give the same duel, to the bit, on any number of threads.

mod apart;
mod challenge;
mod chance;
mod fighter;
mod footwork;
mod record;
mod settings;

use serde::{Deserialize, Serialize};

pub use apart::Core;
pub use challenge::Challenge;
pub use fighter::Fighter;
pub use record::{Exchange, Score, Settled};
pub use settings::{DuelError, DuelSettings};

use crate::graph::{Motion, Playhead};
use crate::maps::{AttackGrid, BakedGraph};
use crate::math::Rigid2;
use crate::query::clearance::{self, Extent, MotionBody, Sampling};
use crate::query::moves::MoveSearch;
use crate::query::{Answer, Attack};
use chance::Chance;

/// One of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Who attacks first.
    White,
    /// The other one.
    Blue,
}

impl Side {
    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::White => Self::Blue,
            Self::Blue => Self::White,
        }
    }

    /// As a position in arrays.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::White => 0,
            Self::Blue => 1,
        }
    }

    /// `white` or `blue`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Blue => "blue",
        }
    }
}

/// A duel under way.
pub struct Duel<'a> {
    baked: &'a BakedGraph,
    grid: &'a AttackGrid,
    settings: DuelSettings,
    core: Core,
    chance: Chance,
    fighters: [Fighter; 2],
    /// Whose turn it is to attack.
    turn: Side,
    /// Seconds since the duel's start.
    now: f32,
    exchanges: Vec<Exchange>,
    called_off: u32,
    /// Attacks of late, the last one last: others are preferred.
    used: Vec<crate::graph::EdgeId>,
    search: MoveSearch,
    body: MotionBody,
}

impl<'a> Duel<'a> {
    /// Two fighters face each other in the middle of the arena.
    ///
    /// # Errors
    /// A setting that is out of its range, by name; a graph without attacks.
    pub fn new(
        baked: &'a BakedGraph,
        grid: &'a AttackGrid,
        settings: &DuelSettings,
    ) -> Result<Self, DuelError> {
        settings.check()?;
        if baked.attack_moves().is_empty() {
            return Err(DuelError::NoAttacks);
        }
        let mut chance = Chance::new(settings.seed);
        let half = 0.5 * settings.opening;
        let places = [
            Rigid2::new(0.0, 0.0, -half),
            Rigid2::new(std::f32::consts::PI, 0.0, half),
        ];
        let fighters = places.map(|place| {
            let edge = footwork::opening_edge(baked.graph(), &mut chance);
            Fighter::new(baked.graph(), Playhead::at(baked.graph(), edge, 0.0, place))
        });
        Ok(Self {
            baked,
            grid,
            settings: *settings,
            core: Core::of(baked),
            chance,
            fighters,
            turn: Side::White,
            now: 0.0,
            exchanges: Vec::new(),
            called_off: 0,
            used: Vec::new(),
            search: MoveSearch::default(),
            body: MotionBody::default(),
        })
    }

    /// Seconds since the duel's start: up to here both fighters' motions are settled.
    #[must_use]
    pub fn now(&self) -> f32 {
        self.now
    }

    /// Whose turn it is to attack.
    #[must_use]
    pub fn turn(&self) -> Side {
        self.turn
    }

    /// What somebody has done so far, and goes on to do.
    #[must_use]
    pub fn fighter(&self, side: Side) -> &Fighter {
        &self.fighters[side.index()]
    }

    /// Both fighters.
    #[must_use]
    pub fn fighters(&self) -> &[Fighter; 2] {
        &self.fighters
    }

    /// Both fighters, to be played back when the duel is over.
    #[must_use]
    pub fn into_fighters(self) -> [Fighter; 2] {
        self.fighters
    }

    /// All exchanges so far.
    #[must_use]
    pub fn exchanges(&self) -> &[Exchange] {
        &self.exchanges
    }

    /// How often each was hit, and avoided.
    #[must_use]
    pub fn score(&self) -> Score {
        Score::of(&self.exchanges, self.called_off)
    }

    /// Lets time pass until the one whose turn it is can strike the other one, should that one do nothing about it.
    ///
    /// # Errors
    /// Where nobody comes within reach for [`DuelSettings::patience`].
    pub fn challenge(&mut self) -> Result<Challenge, DuelError> {
        let begun = self.now;
        // After an exchange both find their feet first.
        let rest = if self.exchanges.is_empty() {
            0.0
        } else {
            self.settings.pause
        };
        while self.now - begun < self.settings.patience {
            if self.now - begun >= rest
                && let Some(challenge) = self.find_challenge()
            {
                return Ok(challenge);
            }
            self.footwork();
        }
        Err(DuelError::OutOfReach {
            seconds: self.settings.patience,
        })
    }

    /// Lets both play what they chose: the one the attack, the other one `answer`, which was asked for the challenge's
    /// [`Challenge::playhead`] and [`Challenge::attack`]. Where that would take them into each other or out of the arena, the
    /// attack is called off, and the turn stays where it is.
    pub fn settle(&mut self, challenge: &Challenge, answer: &Answer) -> Settled {
        let (attacker, defender) = (challenge.attacker, challenge.attacker.other());
        let end = challenge.attack.end();
        let mut motion = answer.motion.clone();
        motion.extend(self.baked.graph(), end + self.settings.window);
        let attacking = self.fighters[attacker.index()].ahead(self.baked.graph(), self.now);
        let fits = self.stays_apart([&attacking, &motion], end + self.settings.pause)
            && self.stays_inside(&motion, end + self.settings.pause);
        if !fits {
            self.called_off += 1;
            self.used.push(challenge.strike);
            self.footwork();
            return Settled::CalledOff;
        }
        let met = self.nearest(&motion, &challenge.attack);
        let exchange = Exchange::new(challenge, answer, met);
        let (graph, now) = (self.baked.graph(), self.now);
        self.fighters[defender.index()].play(graph, now, motion);
        self.now += end;
        self.used.push(challenge.strike);
        self.exchanges.push(exchange.clone());
        self.turn = defender;
        Settled::Fought(Box::new(exchange))
    }

    /// The exact distance of an attack and the body on a motion, both from now on.
    fn nearest(&mut self, motion: &Motion, attack: &Attack) -> clearance::Clearance {
        let sampled = (motion, Sampling::Each);
        let whole = (attack, Extent::WHOLE);
        clearance::on_motion(self.baked, sampled, whole, &mut self.body)
    }
}
