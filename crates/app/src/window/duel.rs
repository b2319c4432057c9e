//! An endless duel, simulated a little ahead of what is shown.

use std::sync::Arc;

use egui::{Color32, RichText};
use glam::Vec3;

use super::gui::write_in_corner;
use super::{Event, Scene, Seen, WindowError};
use sabaki::anim::Clip;
use sabaki::duel::{Duel, DuelError, DuelSettings, Exchange, Score, Side};
use sabaki::maps::{AttackGrid, BakedGraph};
use sabaki::math::F32x16;
use sabaki::query::{Answer, Query, QueryContext, QuerySettings};
use sabaki_draw::scene::{Camera, CrowdShot, Cut, DuelPlayback, Light, Mesh, Outfit, Shot};

/// Time that the duel is simulated ahead, in seconds.
const AHEAD: f32 = 0.25;

/// Number of exchanges in the panel.
const LISTED: usize = 20;
const AVOIDED: Color32 = Color32::from_rgb(110, 220, 120);
const HIT: Color32 = Color32::from_rgb(240, 90, 80);

/// Two characters of one graph that attack and avoid in turn.
pub struct DuelScene<'a> {
    baked: &'a BakedGraph,
    duel: Duel<'a>,
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
    /// Reason why the duel has stopped.
    ended: Option<DuelError>,
    /// The mouse controls the camera.
    is_free: bool,
    events: Vec<Event>,
}

impl<'a> DuelScene<'a> {
    /// Starts a duel of two characters that face each other.
    ///
    /// # Errors
    /// Those of [`Duel::new`].
    pub fn new(
        baked: &'a BakedGraph,
        grid: &'a AttackGrid,
        outfit: Option<Arc<Outfit>>,
        settings: &DuelSettings,
    ) -> Result<Self, DuelError> {
        let mut scene = Self {
            baked,
            duel: Duel::new(baked, grid, settings)?,
            outfit,
            context: QueryContext::default(),
            answer: Answer::default(),
            t: 0.0,
            cut: None,
            aspect: 4.0 / 3.0,
            told: 0,
            ended: None,
            is_free: false,
            events: Vec::new(),
        };
        scene.advance(0.0);
        Ok(scene)
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
        let over = |one: &Exchange| DuelPlayback::end(one) <= self.t;
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
        DuelPlayback::new(self.baked, self.duel.fighters(), one).with_skins(skins)
    }

    /// The exchanges whose outcome has been shown.
    #[must_use]
    pub fn seen(&self) -> &[Exchange] {
        &self.duel.exchanges()[..self.told]
    }

    /// The shown exchange, if its attack has been announced.
    fn shown(&self) -> Option<&Exchange> {
        let exchange = self.duel.exchanges().get(self.current())?;
        (exchange.announced <= self.t).then_some(exchange)
    }

    /// Name of an exchange's attack.
    fn attack(&self, exchange: &Exchange) -> &str {
        let graph = self.baked.graph();
        graph
            .clip(graph.node(graph.edge(exchange.strike).from).clip)
            .name()
    }
}

impl Scene for DuelScene<'_> {
    fn meshes(&self) -> &[Mesh] {
        self.outfit.as_ref().map_or(&[], |outfit| &outfit.meshes)
    }

    /// Slower while an attack is near. It stops when the fighters no longer come within reach.
    fn advance(&mut self, seconds: f32) {
        let pace = self.cut.map_or(1.0, |cut| {
            self.playback(cut.exchange)
                .pace(&Cut { exchange: 0, ..cut }, self.t)
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

    /// The point between the fighters, at the height of their hips.
    fn focus(&self) -> Vec3 {
        let (playback, mut joints) = (self.playback(0), Vec::new());
        let hips = [Side::White, Side::Blue].map(|side| {
            playback.joints(side, self.t, &mut joints);
            joints.first().map_or(Vec3::Y, |joint| joint.translation)
        });
        0.5 * (hips[0] + hips[1])
    }

    fn distance(&self) -> f32 {
        4.5
    }

    /// The camera that sees the exchange best.
    fn camera(&self) -> Option<Camera> {
        self.cut.filter(|_| !self.is_free).map(|cut| cut.camera)
    }

    fn draw(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        _: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError> {
        self.aspect = size[0].max(1) as f32 / size[1].max(1) as f32;
        let shot = match self.cut {
            Some(cut) => {
                let own = Cut {
                    camera,
                    exchange: 0,
                    ..cut
                };
                self.playback(cut.exchange).shot(&own, self.t)
            }
            None => Shot::new(camera, Light::default()),
        };
        Ok((shot, None))
    }

    fn key(&mut self, key: &str, is_down: bool) -> bool {
        self.is_free ^= key == "c" && is_down;
        key == "c"
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &[("c", "the mouse has the camera, or each exchange its own")]
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let score = Score::new(self.seen(), self.duel.score().called_off);
        let [white, blue] = score.hits;
        ui.label(RichText::new(format!("white {white} : {blue} blue")).strong());
        let [white, blue] = score.dodges;
        ui.label(format!("avoided: white {white}, blue {blue}"));
        ui.checkbox(&mut self.is_free, "the mouse has the camera");
        if let Some(error) = self.ended {
            ui.label(RichText::new(error.to_string()).color(HIT));
        }
        ui.separator();
        if let Some(exchange) = self.shown() {
            let (lead, from) = (exchange.attack.start(), exchange.attacker.name());
            let attack = Clip::title(self.attack(exchange));
            let line = format!("{from}: {attack}, announced {lead:.2} s before it starts");
            ui.label(line);
            ui.label(format!("{} candidates", exchange.counts.candidates));
        }
        ui.separator();
        ui.label("exchanges, the last one first");
        for exchange in self.seen().iter().rev().take(LISTED) {
            let attack = Clip::title(self.attack(exchange));
            let (text, colour) = outcome(exchange);
            let line = format!("{:<5} {attack:<16} {text}", exchange.attacker.name());
            ui.label(RichText::new(line).monospace().size(11.0).color(colour));
        }
    }

    fn label(&self, painter: &egui::Painter, _: Seen<'_>) {
        let shown = self.shown().filter(|one| self.seen().contains(one));
        if let Some((text, colour)) = shown.map(outcome) {
            write_in_corner(painter, text, colour.gamma_multiply(0.6));
        }
    }

    fn take_events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

/// The outcome of an attack as text and colour.
fn outcome(exchange: &Exchange) -> (String, Color32) {
    let centimetres = 100.0 * exchange.clearance.metres;
    match exchange.avoided {
        true => (format!("avoided by {centimetres:.1} cm"), AVOIDED),
        false => ("hit".to_owned(), HIT),
    }
}
