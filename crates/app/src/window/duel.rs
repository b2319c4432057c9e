//! An endless duel, simulated a little ahead of what is shown.

use std::sync::Arc;

use egui::{Color32, RichText};
use glam::Vec3;

use super::gui::write_in_corner;
use super::{Drawn, Event, Scene, Seen};
use crate::play::{APART, Fight, PlayError, clip_of, score};
use sabaki::anim::Clip;
use sabaki::maps::BakedGraph;
use sabaki::math::F32x16;
use sabaki_draw::scene::{Camera, Cut, DuelPlayback, Exchange, Light, Mesh, Outfit, Shot};

/// Number of exchanges in the panel.
const LISTED: usize = 20;
const AVOIDED: Color32 = Color32::from_rgb(110, 220, 120);
const HIT: Color32 = Color32::from_rgb(240, 90, 80);

/// Two characters of one graph that strike and dodge in turn.
pub struct DuelScene {
    baked: Arc<BakedGraph>,
    fight: Fight,
    outfit: Option<Arc<Outfit>>,
    /// Time that is shown, in seconds since the duel's start.
    t: f32,
    /// Exchange that is shown, with its camera; `None` before the first picture.
    cut: Option<Cut>,
    /// Width of the picture divided by its height.
    aspect: f32,
    /// Number of exchanges whose outcome has been shown.
    told: usize,
    /// Why the duel has stopped.
    ended: Option<String>,
    /// The mouse controls the camera.
    is_free: bool,
    events: Vec<Event>,
}

impl DuelScene {
    /// Starts a duel of two characters that face each other.
    ///
    /// # Errors
    /// Those of [`Fight::new`].
    pub fn new(
        baked: Arc<BakedGraph>,
        outfit: Option<Arc<Outfit>>,
        seed: u64,
    ) -> Result<Self, PlayError> {
        let mut scene = Self {
            fight: Fight::new(&baked, APART, seed)?,
            baked,
            outfit,
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

    /// Plays one more exchange, before it is shown.
    fn fight(&mut self) {
        match self.fight.exchange() {
            Ok(true) => {}
            Ok(false) => self.ended = Some("no fighter comes within reach".to_owned()),
            Err(error) => self.ended = Some(error.to_string()),
        }
    }

    /// Index of the shown exchange: the first one that is not over.
    fn current(&self) -> usize {
        let exchanges = &self.fight.exchanges;
        let over = |one: &Exchange| DuelPlayback::end(one) <= self.t;
        exchanges
            .partition_point(over)
            .min(exchanges.len().saturating_sub(1))
    }

    /// Reports the attacks whose outcome has been shown by now.
    fn tell(&mut self) {
        while let Some(exchange) = self.fight.exchanges.get(self.told) {
            if exchange.nearest_at > self.t {
                break;
            }
            self.told += 1;
            self.events.push(Event::Exchange {
                number: self.told as u32,
                attacker: exchange.attacker_name(),
                attack: self.attack(exchange).to_owned(),
                avoided: exchange.is_avoided(),
                clearance: exchange.clearance,
                lead: exchange.contact - exchange.announced,
            });
        }
    }

    fn playback(&self, exchange: usize) -> DuelPlayback<'_> {
        let exchanges = &self.fight.exchanges;
        let one = exchanges.get(exchange..=exchange).unwrap_or(&[]);
        let skins = self.outfit.as_ref().map(|outfit| outfit.skins.clone());
        DuelPlayback::new(&self.baked, &self.fight.played, one).with_skins(skins)
    }

    /// The exchanges whose outcome has been shown.
    pub fn seen(&self) -> &[Exchange] {
        &self.fight.exchanges[..self.told]
    }

    /// The shown exchange, if its attack has been announced.
    fn shown(&self) -> Option<&Exchange> {
        let exchange = self.fight.exchanges.get(self.current())?;
        (exchange.announced <= self.t).then_some(exchange)
    }

    fn attack(&self, exchange: &Exchange) -> &str {
        clip_of(&self.baked, exchange.attack)
    }
}

impl Scene for DuelScene {
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
        while self.ended.is_none()
            && self
                .fight
                .exchanges
                .last()
                .is_none_or(|last| DuelPlayback::end(last) <= self.t)
        {
            self.fight();
        }
        self.t = self.t.min(self.fight.now());
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
        let hips = [0, 1].map(|fighter| {
            playback.joints(fighter, self.t, &mut joints);
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

    fn draw(&mut self, camera: Camera, size: [u32; 2], _: &mut [F32x16]) -> Drawn {
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
        let [[white, blue], dodges] = score(self.seen());
        ui.label(RichText::new(format!("white {white} : {blue} blue")).strong());
        let [white, blue] = dodges;
        ui.label(format!("avoided: white {white}, blue {blue}"));
        ui.checkbox(&mut self.is_free, "the mouse has the camera");
        if let Some(why) = &self.ended {
            ui.label(RichText::new(why).color(HIT));
        }
        ui.separator();
        if let Some(exchange) = self.shown() {
            let (from, attack) = (exchange.attacker_name(), Clip::title(self.attack(exchange)));
            let lead = exchange.contact - exchange.announced;
            ui.label(format!(
                "{from}: {attack}, seen {lead:.2} s before its furthest reach"
            ));
        }
        ui.separator();
        ui.label("exchanges, the last one first");
        for exchange in self.seen().iter().rev().take(LISTED) {
            let attack = Clip::title(self.attack(exchange));
            let (text, colour) = outcome(exchange);
            let line = format!("{:<5} {attack:<16} {text}", exchange.attacker_name());
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
    match exchange.clearance {
        Some(metres) if metres < 0.0 => ("hit".to_owned(), HIT),
        Some(metres) => (format!("avoided by {:.1} cm", 100.0 * metres), AVOIDED),
        None => ("avoided".to_owned(), AVOIDED),
    }
}
