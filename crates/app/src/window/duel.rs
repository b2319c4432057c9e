//! Shows a duel in the window.

use egui::{Color32, RichText};
use glam::Vec3;

use super::{Projection, View, WindowError};
use crate::live::{Clock, Event, LiveDuel};
use sabaki::anim::Clip;
use sabaki::duel::Exchange;
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Shot};

/// A duel with its keys.
pub struct DuelView<'a> {
    live_duel: LiveDuel<'a>,
    /// The mouse controls the camera.
    is_free: bool,
}

const KEYS: [(&str, &str); 1] = [("c", "the mouse has the camera, or each exchange its own")];
/// Number of exchanges in the panel.
const LISTED: usize = 20;
const AVOIDED: Color32 = Color32::from_rgb(110, 220, 120);
const HIT: Color32 = Color32::from_rgb(240, 90, 80);

impl<'a> DuelView<'a> {
    /// Shows a duel.
    #[must_use]
    pub fn new(live_duel: LiveDuel<'a>) -> Self {
        Self {
            live_duel,
            is_free: false,
        }
    }
}

impl View for DuelView<'_> {
    fn stage(&self) -> StageDesc<'_> {
        StageDesc {
            meshes: self.live_duel.meshes(),
            ..StageDesc::default()
        }
    }

    fn advance(&mut self, seconds: f32) {
        self.live_duel.advance(seconds);
    }

    fn focus(&self) -> Vec3 {
        self.live_duel.middle()
    }

    fn distance(&self) -> f32 {
        4.5
    }

    fn camera(&self) -> Option<Camera> {
        self.live_duel.camera().filter(|_| !self.is_free)
    }

    fn draw(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        _: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError> {
        let aspect = size[0].max(1) as f32 / size[1].max(1) as f32;
        Ok((self.live_duel.shot(camera, aspect), None))
    }

    fn click(&mut self, _: &Camera, _: Vec3) -> Result<(), WindowError> {
        Ok(())
    }

    fn key(&mut self, key: &str) {
        if key == "c" {
            self.is_free = !self.is_free;
        }
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &KEYS
    }

    fn panel(&mut self, ui: &mut egui::Ui, _: &mut Clock) {
        let score = self.live_duel.score();
        let [white, blue] = score.hits;
        ui.label(RichText::new(format!("white {white} : {blue} blue")).strong());
        let [white, blue] = score.dodges;
        ui.label(format!("avoided: white {white}, blue {blue}"));
        ui.checkbox(&mut self.is_free, "the mouse has the camera");
        if let Some(error) = self.live_duel.ended() {
            ui.label(RichText::new(error.to_string()).color(HIT));
        }
        ui.separator();
        if let Some(exchange) = self.live_duel.shown() {
            let lead = exchange.attack.start();
            let from = exchange.attacker.name();
            let attack = Clip::title(self.live_duel.attack(exchange));
            ui.label(format!(
                "{from}: {attack}, announced {lead:.2} s before it starts"
            ));
            ui.label(format!("{} candidates", exchange.counts.candidates));
        }
        ui.separator();
        ui.label("exchanges, the last one first");
        for exchange in self.live_duel.seen().iter().rev().take(LISTED) {
            let attack = Clip::title(self.live_duel.attack(exchange));
            let (text, colour) = outcome(exchange);
            let line = format!("{:<5} {attack:<16} {text}", exchange.attacker.name());
            ui.label(RichText::new(line).monospace().size(11.0).color(colour));
        }
    }

    fn label(&self, painter: &egui::Painter, _: &Projection) {
        let shown = self.live_duel.shown();
        let Some(exchange) = shown.filter(|one| self.live_duel.seen().contains(one)) else {
            return;
        };
        let (text, colour) = outcome(exchange);
        let at = painter.clip_rect().left_top() + egui::vec2(18.0, 14.0);
        let letters = egui::FontId::proportional(22.0);
        let dark = colour.gamma_multiply(0.6);
        painter.text(at, egui::Align2::LEFT_TOP, text, letters, dark);
    }

    fn take_events(&mut self) -> Vec<Event> {
        self.live_duel.take_events()
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
