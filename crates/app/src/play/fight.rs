//! Two characters of one game that strike and dodge in turn.

use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sabaki::anim::Pose;
use sabaki::character::{
    CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters, Goal, StrikeAt,
    StrikeKind, ThreatId,
};
use sabaki::graph::EdgeId;
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki_draw::scene::{Exchange, Played};
use sabaki_fixtures::throw::generator;

use super::recording::write_played;
use super::{FRAME, PlayError};

/// Initial distance of the fighters, in metres.
pub const APART: f32 = 1.2;

/// Time without a strike after which a duel ends, in seconds.
pub const PATIENCE: f64 = 20.0;

/// Two characters that take turns: one strikes, the other one stands and dodges.
pub struct Fight {
    game: Characters,
    fighters: [CharacterId; 2],
    /// Index of the fighter whose turn it is to strike.
    turn: usize,
    random: Pcg64Mcg,
    /// Time of the game from which that one may strike, in seconds.
    rests_until: f64,
    running: Option<(ThreatId, Exchange)>,
    /// What was played.
    pub played: Played,
    /// The strikes that have ended.
    pub exchanges: Vec<Exchange>,
    /// Number of strikes that were broken off.
    pub broken_off: u32,
}

/// The numbers of hits and of avoided strikes, each white's first.
#[must_use]
pub fn score(exchanges: &[Exchange]) -> [[u32; 2]; 2] {
    let [mut hits, mut dodges] = [[0; 2]; 2];
    for exchange in exchanges {
        match exchange.is_avoided() {
            true => dodges[1 - exchange.attacker] += 1,
            false => hits[exchange.attacker] += 1,
        }
    }
    [hits, dodges]
}

/// The clip that an edge starts in.
#[must_use]
pub fn clip_of(baked: &BakedGraph, edge: EdgeId) -> &str {
    let graph = baked.graph();
    graph.clip(graph.node(graph.edge(edge).from).clip).name()
}

fn strike(whom: CharacterId) -> Goal {
    Goal::Strike {
        at: StrikeAt::Character(whom),
        kind: StrikeKind::Any,
    }
}

impl Fight {
    /// Begins a duel of two characters that face each other. The same seed gives the same duel.
    ///
    /// # Errors
    /// A graph without attacks, or in which nothing can be played.
    pub fn new(baked: &Arc<BakedGraph>, apart: f32, seed: u64) -> Result<Self, PlayError> {
        let settings = CharacterSettings {
            body_radius: 0.15,
            ..CharacterSettings::default()
        };
        let mut game = Characters::new(Arc::clone(baked), settings)?;
        let mut random = generator(seed, 0);
        let mut place = |facing: f32, z: f32| {
            let turned = 0.4 * (random.random::<f32>() - 0.5);
            game.spawn(Rigid2::new(facing + turned, 0.0, z))
        };
        let fighters = [place(0.0, -0.5 * apart)?, place(PI, 0.5 * apart)?];
        // A graph without attacks is refused at once.
        game.steer(fighters[0], strike(fighters[1]))?;
        game.steer(fighters[0], Goal::Idle)?;
        let mut fight = Self {
            game,
            fighters,
            turn: 0,
            random,
            rests_until: 0.0,
            running: None,
            played: Played {
                step: FRAME,
                frames: Vec::new(),
            },
            exchanges: Vec::new(),
            broken_off: 0,
        };
        fight.record()?;
        fight.rest();
        Ok(fight)
    }

    /// Time since the duel's start, in seconds.
    pub fn now(&self) -> f32 {
        self.game.now() as f32
    }

    /// Plays on until a strike has ended. Returns `false` if there was none for a long time.
    ///
    /// # Errors
    /// None for characters that are there.
    pub fn exchange(&mut self) -> Result<bool, PlayError> {
        let (number, begun) = (self.exchanges.len(), self.game.now());
        let mut events = Vec::new();
        while self.exchanges.len() == number {
            if self.running.is_none() && self.game.now() - begun > PATIENCE {
                return Ok(false);
            }
            if self.game.now() >= self.rests_until {
                let [me, other] = [self.turn, 1 - self.turn].map(|index| self.fighters[index]);
                self.game.steer(me, strike(other))?;
            }
            events.clear();
            self.game.step(FRAME, &[], &mut events);
            self.record()?;
            for event in &events {
                self.follow(event)?;
            }
            self.follow_evasion()?;
        }
        Ok(true)
    }

    /// Random time before the next strike.
    fn rest(&mut self) {
        let seconds = 0.3 + 0.7 * self.random.random::<f64>();
        self.rests_until = self.game.now() + seconds;
    }

    fn record(&mut self) -> Result<(), PlayError> {
        let mut poses = [Pose::default(), Pose::default()];
        for (pose, &id) in poses.iter_mut().zip(&self.fighters) {
            self.game.local_pose(id, pose)?;
        }
        self.played.frames.push(poses);
        Ok(())
    }

    fn follow(&mut self, event: &CharacterEvent) -> Result<(), PlayError> {
        let time = event.time as f32;
        match event.kind {
            CharacterEventKind::Strikes {
                threat,
                attack,
                contact,
            } => {
                let exchange = Exchange {
                    attacker: self.turn,
                    attack,
                    announced: time,
                    contact: contact as f32,
                    span: [time, time],
                    limb: Vec::new(),
                    clearance: None,
                    nearest_at: contact as f32,
                    by: None,
                };
                self.running = Some((threat, exchange));
                self.write_limb()?;
            }
            CharacterEventKind::Struck { threat, depth, .. } => {
                self.come_near(threat, -depth, time);
            }
            CharacterEventKind::MissedBy { threat, metres } => {
                let contact = self.running.as_ref().map(|(_, one)| one.contact);
                self.come_near(threat, metres, contact.unwrap_or(time));
            }
            CharacterEventKind::StrikeEnded { is_whole } => {
                let ended = self.running.take();
                self.game.steer(self.fighters[self.turn], Goal::Idle)?;
                self.rest();
                if is_whole {
                    self.exchanges.extend(ended.map(|(_, exchange)| exchange));
                    self.turn = 1 - self.turn;
                } else {
                    self.broken_off += 1;
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn come_near(&mut self, threat: ThreatId, metres: f32, time: f32) {
        let running = self.running.as_mut();
        if let Some((_, exchange)) = running.filter(|(running, _)| *running == threat) {
            (exchange.clearance, exchange.nearest_at) = (Some(metres), time);
        }
    }

    /// Writes where the limb of the strike that was announced will be.
    fn write_limb(&mut self) -> Result<(), PlayError> {
        let Some((threat, exchange)) = &mut self.running else {
            return Ok(());
        };
        let [start, end] = self.game.limb_times(*threat)?;
        exchange.span = [start as f32, end as f32];
        let step = f64::from(FRAME);
        let times = (0..).map(|index| start + step * f64::from(index));
        for time in times.take_while(|&time| time <= end) {
            let mut spheres = Vec::new();
            self.game.limb(*threat, time, &mut spheres)?;
            exchange.limb.push(spheres);
        }
        Ok(())
    }

    /// Remembers the evasion that the other fighter plays.
    fn follow_evasion(&mut self) -> Result<(), PlayError> {
        let other = self.fighters[1 - self.turn];
        if let Some((_, exchange)) = &mut self.running {
            let edge = self.game.playhead(other)?.edge;
            let evasion = self.game.baked().evasion(edge);
            exchange.by = exchange.by.or(evasion.map(|evasion| evasion.edge));
        }
        Ok(())
    }

    /// Writes what both have played, as `white.bvh` and `blue.bvh`.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn export(&self, folder: &Path) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let graph = self.game.baked().graph();
        for (fighter, name) in ["white", "blue"].into_iter().enumerate() {
            let poses = self.played.frames.iter().map(|both| &both[fighter]);
            write_played(&folder.join(format!("{name}.bvh")), graph, poses)?;
        }
        Ok(())
    }
}
