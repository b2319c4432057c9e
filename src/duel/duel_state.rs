use super::fighter::Fighter;
use super::record::{Challenge, Exchange, Score, Side};
use super::rng::SplitMix64;
use super::settings::{DuelError, DuelSettings};
use super::trunk::Trunk;
use crate::graph::{EdgeId, Motion, MotionGraph, Playhead};
use crate::maps::{AttackGrid, BakedGraph};
use crate::math::Rigid2;
use crate::query::clearance::{Clearance, ExactTest, MotionBody};
use crate::query::{Answer, Attack, MoveSearch};

/// A duel. It keeps all motions for playback, about 50 MB for each hour. After three hours its time has a resolution of a millisecond.
pub struct Duel<'a> {
    pub(super) baked: &'a BakedGraph,
    pub(super) grid: &'a AttackGrid,
    pub(super) settings: DuelSettings,
    pub(super) trunk: Trunk,
    pub(super) rng: SplitMix64,
    pub(super) fighters: [Fighter; 2],
    /// The fighter whose turn it is to attack.
    pub(super) turn: Side,
    /// Time since the duel's start, in seconds.
    pub(super) now: f32,
    exchanges: Vec<Exchange>,
    called_off: u32,
    /// Edges of recent attacks, the latest last. They are avoided if there are others.
    pub(super) used: Vec<EdgeId>,
    pub(super) search: MoveSearch,
    body: MotionBody,
}

impl<'a> Duel<'a> {
    /// Starts a duel: two fighters face each other in the middle of the arena.
    ///
    /// # Errors
    /// A setting is out of range, or the graph has no attacks.
    pub fn new(
        baked: &'a BakedGraph,
        grid: &'a AttackGrid,
        settings: &DuelSettings,
    ) -> Result<Self, DuelError> {
        settings.check()?;
        if baked.attack_moves().is_empty() {
            return Err(DuelError::NoAttacks);
        }
        let mut rng = SplitMix64::new(settings.seed);
        let half = 0.5 * settings.opening;
        let places = [
            Rigid2::new(0.0, 0.0, -half),
            Rigid2::new(std::f32::consts::PI, 0.0, half),
        ];
        let fighters = places.map(|place| {
            let edge = opening_edge(baked.graph(), &mut rng);
            Fighter::new(baked.graph(), Playhead::at(baked.graph(), edge, 0.0, place))
        });
        Ok(Self {
            baked,
            grid,
            settings: *settings,
            trunk: Trunk::new(baked),
            rng,
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

    /// Time since the duel's start, in seconds. The motions of both fighters are final up to this time.
    #[must_use]
    pub fn now(&self) -> f32 {
        self.now
    }

    /// The fighter whose turn it is to attack.
    #[must_use]
    pub fn turn(&self) -> Side {
        self.turn
    }

    /// The motion of one fighter, past and planned.
    #[must_use]
    pub fn fighter(&self, side: Side) -> &Fighter {
        &self.fighters[side.index()]
    }

    /// The motions of both fighters.
    #[must_use]
    pub fn fighters(&self) -> &[Fighter; 2] {
        &self.fighters
    }

    /// The motions of both fighters, for playback after the duel.
    #[must_use]
    pub fn into_fighters(self) -> [Fighter; 2] {
        self.fighters
    }

    /// All exchanges so far.
    #[must_use]
    pub fn exchanges(&self) -> &[Exchange] {
        &self.exchanges
    }

    /// The number of hits and avoided attacks so far.
    #[must_use]
    pub fn score(&self) -> Score {
        Score::new(&self.exchanges, self.called_off)
    }

    /// Advances time until the attacker has an attack that would hit an opponent that continues as planned.
    ///
    /// # Errors
    /// There is no such attack within [`DuelSettings::patience`].
    pub fn challenge(&mut self) -> Result<Challenge, DuelError> {
        let begun = self.now;
        // After an exchange there is a pause.
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

    /// Plays the attack and its answer. `answer` is the answer to [`Challenge::request`].
    ///
    /// Returns `None` if the attack is called off because the fighters would run into each other or leave the arena. The attacker
    /// then keeps its turn.
    pub fn settle(&mut self, challenge: &Challenge, answer: &Answer) -> Option<&Exchange> {
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
            return None;
        }
        let clearance = self.clearance(&motion, &challenge.attack);
        let (graph, now) = (self.baked.graph(), self.now);
        self.fighters[defender.index()].play(graph, now, motion);
        self.now += end;
        self.used.push(challenge.strike);
        self.turn = defender;
        let exchange = Exchange::new(challenge, answer, clearance);
        self.exchanges.push(exchange);
        self.exchanges.last()
    }

    /// The exact clearance of an attack and a motion that start together.
    pub(super) fn clearance(&mut self, motion: &Motion, attack: &Attack) -> Clearance {
        self.body.forget();
        ExactTest::new(self.baked, attack).on_motion(motion, &mut self.body)
    }
}

/// A random start edge with no event on it or soon after it.
fn opening_edge(graph: &MotionGraph, rng: &mut SplitMix64) -> EdgeId {
    /// Number of edges, from the start edge on, that must have no event.
    const CALM: usize = 12;
    let natural: Vec<EdgeId> = graph.natural_edges().collect();
    let is_natural = |edge: &EdgeId| natural.binary_search(edge).is_ok();
    let is_calm = |&edge: &EdgeId| {
        let next = |edge: &EdgeId| Some(graph.natural_edge(graph.edge(*edge).to));
        let mut way = std::iter::successors(Some(edge), next).take(CALM);
        way.all(|edge| is_natural(&edge))
    };
    let calm: Vec<EdgeId> = graph.edge_ids().filter(is_calm).collect();
    match calm.len() {
        0 => EdgeId(0),
        count => calm[rng.below(count)],
    }
}
