//! An endless duel, simulated a little ahead of what is shown.

use std::sync::Arc;

use glam::Vec3;

use crate::live::Event;
use sabaki::anim::JointTransform;
use sabaki::duel::{Duel, DuelError, DuelSettings, Exchange, Score, Side};
use sabaki::maps::{AttackGrid, BakedGraph};
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_draw::scene::{
    Camera, Cut, DuelPlayback, DuelPlaybackSettings, Mesh, Outfit, RecordedDuel, Shot,
};

/// Time that the duel is simulated ahead, in seconds.
const AHEAD: f32 = 0.25;

/// Two characters of one graph that attack and avoid in turn.
pub struct LiveDuel<'a> {
    baked: &'a BakedGraph,
    duel: Duel<'a>,
    settings: DuelPlaybackSettings,
    outfit: Option<Arc<Outfit>>,
    context: QueryContext,
    answer: Answer,
    /// Time that is shown, in seconds since the duel's start.
    t: f32,
    /// Exchange that is shown, with its camera; `None` before the first picture.
    cut: Option<Cut>,
    /// Width of the picture divided by its height.
    aspect: f32,
    /// Number of exchanges whose outcome has been shown.
    told: usize,
    ended: Option<DuelError>,
    events: Vec<Event>,
}

impl<'a> LiveDuel<'a> {
    /// Starts a duel of two characters that face each other.
    ///
    /// # Errors
    /// Those of [`Duel::new`].
    pub fn new(
        baked: &'a BakedGraph,
        grid: &'a AttackGrid,
        settings: &DuelSettings,
    ) -> Result<Self, DuelError> {
        let mut live_duel = Self {
            baked,
            duel: Duel::new(baked, grid, settings)?,
            settings: DuelPlaybackSettings::default(),
            outfit: None,
            context: QueryContext::default(),
            answer: Answer::default(),
            t: 0.0,
            cut: None,
            aspect: 4.0 / 3.0,
            told: 0,
            ended: None,
            events: Vec::new(),
        };
        live_duel.advance(0.0);
        Ok(live_duel)
    }

    /// Advances the simulation, slower while an attack is near. It stops when the fighters no longer come within reach.
    pub fn advance(&mut self, seconds: f32) {
        let pace = self.cut.map_or(1.0, |cut| {
            self.playback(cut.exchange).pace(&self.of_one(cut), self.t)
        });
        self.t += seconds * pace;
        while self.ended.is_none() && self.duel.now() < self.t + AHEAD {
            self.fight();
        }
        self.t = self.t.min(self.duel.now());
        self.tell();
        let current = self.current();
        if self.cut.is_none_or(|cut| cut.exchange != current) {
            let cuts = self.playback(current).cuts(self.aspect);
            self.cut = cuts.first().map(|&cut| Cut {
                exchange: current,
                ..cut
            });
        }
    }

    /// Simulates one more exchange.
    fn fight(&mut self) {
        let query_settings = QuerySettings::default();
        let query = Query::new(self.baked, &query_settings);
        match self.duel.challenge() {
            Ok(challenge) => {
                let (context, answer) = (&mut self.context, &mut self.answer);
                query.answer(challenge.request(), context, answer);
                if self.duel.settle(&challenge, answer).is_none() {
                    tracing::debug!("an attack was called off");
                }
            }
            Err(error) => self.ended = Some(error),
        }
    }

    /// Index of the shown exchange: the first one that is not over.
    fn current(&self) -> usize {
        let exchanges = self.duel.exchanges();
        let over = |one: &Exchange| one.end() + self.settings.after <= self.t;
        exchanges
            .partition_point(over)
            .min(exchanges.len().saturating_sub(1))
    }

    /// Reports the attacks whose outcome has been shown by now.
    fn tell(&mut self) {
        while let Some(exchange) = self.duel.exchanges().get(self.told) {
            if exchange.announced + exchange.clearance.time > self.t {
                break;
            }
            self.told += 1;
            self.events.push(Event::Exchange {
                number: self.told as u32,
                attacker: exchange.attacker.name(),
                attack: self.attack(exchange).to_owned(),
                avoided: exchange.avoided,
                clearance: exchange.clearance.metres,
                lead: exchange.attack.start(),
            });
        }
    }

    /// The playback of one exchange.
    fn playback(&self, exchange: usize) -> DuelPlayback<'_> {
        let exchanges = self.duel.exchanges();
        let one = exchanges.get(exchange..=exchange).unwrap_or(&[]);
        let skins = self.outfit.as_ref().map(|outfit| outfit.skins.clone());
        let duel = RecordedDuel {
            baked: self.baked,
            fighters: self.duel.fighters(),
            exchanges: one,
        };
        DuelPlayback::new(duel, &self.settings).with_skins(skins)
    }

    /// Draws the fighters with meshes that are bound to the graph's skeleton.
    pub fn wear(&mut self, outfit: Option<Arc<Outfit>>) {
        self.outfit = outfit;
    }

    /// Meshes of the fighters.
    #[must_use]
    pub fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    /// The cut in the playback of its exchange alone.
    fn of_one(&self, cut: Cut) -> Cut {
        Cut { exchange: 0, ..cut }
    }

    /// The camera that sees the exchange best.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        self.cut.map(|cut| cut.camera)
    }

    /// The picture that `camera` sees, with this ratio of width to height.
    pub fn shot(&mut self, camera: Camera, aspect: f32) -> Shot {
        self.aspect = aspect;
        let Some(cut) = self.cut else {
            return Shot::new(camera, sabaki_draw::scene::Light::default());
        };
        let cut = Cut {
            camera,
            ..self.of_one(cut)
        };
        self.playback(self.cut.map_or(0, |cut| cut.exchange))
            .shot(&cut, self.t)
    }

    /// The point between the fighters, at the height of their hips.
    #[must_use]
    pub fn middle(&self) -> Vec3 {
        let (playback, mut joints) = (self.playback(0), Vec::<JointTransform>::new());
        let hips = [Side::White, Side::Blue].map(|side| {
            playback.joints(side, self.t, &mut joints);
            joints.first().map_or(Vec3::Y, |joint| joint.translation)
        });
        0.5 * (hips[0] + hips[1])
    }

    /// The exchanges whose outcome has been shown.
    #[must_use]
    pub fn seen(&self) -> &[Exchange] {
        &self.duel.exchanges()[..self.told]
    }

    /// The shown exchange, if its attack has been announced.
    #[must_use]
    pub fn shown(&self) -> Option<&Exchange> {
        let exchange = self.duel.exchanges().get(self.current())?;
        (exchange.announced <= self.t).then_some(exchange)
    }

    /// Number of hits and avoided attacks of each fighter so far.
    #[must_use]
    pub fn score(&self) -> Score {
        Score::of(self.seen(), self.duel.score().called_off)
    }

    /// Name of an exchange's attack.
    #[must_use]
    pub fn attack(&self, exchange: &Exchange) -> &str {
        let graph = self.baked.graph();
        graph
            .clip(graph.node(graph.edge(exchange.strike).from).clip)
            .name()
    }

    /// Why the duel has stopped.
    #[must_use]
    pub fn ended(&self) -> Option<&DuelError> {
        self.ended.as_ref()
    }

    /// Takes the events since the last call.
    pub fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}
