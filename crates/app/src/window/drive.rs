//! Shows a character that is driven by keys.

use egui::{Color32, RichText};
use glam::Vec3;

use super::{Projection, View, WindowError};
use crate::live::{Clock, Drive, Event};
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Shot};

/// A driven character with its keys.
pub struct DriveView {
    drive: Drive,
    /// Reason why the simulation has stopped.
    failed: Option<String>,
}

const KEYS: [(&str, &str); 5] = [
    ("w a s d", "walk, seen from the camera"),
    ("shift", "run"),
    ("q e", "turn"),
    ("space", "dodge what flies, if it does not by itself"),
    ("f", "dodge by itself, or by the key"),
];
const AVOIDED: Color32 = Color32::from_rgb(60, 150, 80);
const HIT: Color32 = Color32::from_rgb(200, 60, 50);

impl DriveView {
    /// Shows a driven character.
    #[must_use]
    pub fn new(drive: Drive) -> Self {
        Self {
            drive,
            failed: None,
        }
    }

    /// The score, and the distance of the last ball, with its colour.
    fn line(&self) -> (String, Color32) {
        let score = self.drive.score();
        let counts = format!("{} avoided : {} hit", score.missed, score.hits);
        match score.last {
            Some(metres) if metres > 0.0 => {
                (format!("{counts}, the last by {metres:.2} m"), AVOIDED)
            }
            Some(_) => (format!("{counts}, the last hit"), HIT),
            None => (counts, AVOIDED),
        }
    }
}

impl View for DriveView {
    fn stage(&self) -> StageDesc<'_> {
        StageDesc {
            meshes: self.drive.meshes(),
            ..StageDesc::default()
        }
    }

    fn advance(&mut self, seconds: f32) {
        if self.failed.is_none() {
            let advanced = self.drive.advance(seconds);
            self.failed = advanced.err().map(|error| error.to_string());
        }
    }

    fn focus(&self) -> Vec3 {
        self.drive.focus()
    }

    fn distance(&self) -> f32 {
        6.5
    }

    fn draw(
        &mut self,
        camera: Camera,
        _: [u32; 2],
        _: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError> {
        self.drive.look(&camera);
        let shot = self.drive.shot(camera);
        let shot = shot.unwrap_or_else(|error| {
            self.failed = Some(error.to_string());
            Shot::new(camera, sabaki_draw::scene::Light::default())
        });
        Ok((shot, None))
    }

    fn click(&mut self, _: &Camera, _: Vec3) -> Result<(), WindowError> {
        Ok(())
    }

    fn key(&mut self, _: &str) {}

    fn hold(&mut self, key: &str, is_down: bool) -> bool {
        self.drive.hold(key, is_down)
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &KEYS
    }

    fn panel(&mut self, ui: &mut egui::Ui, _: &mut Clock) {
        let (line, colour) = self.line();
        ui.label(RichText::new(line).strong().color(colour));
        if let Some(closest) = self.drive.score().closest {
            ui.label(format!("the closest that missed: {closest:.3} m"));
        }
        ui.checkbox(&mut self.drive.dodges_alone, "it dodges by itself");
        if self.drive.is_cornered() {
            ui.label(RichText::new("cornered: no way avoids balls and walls").color(HIT));
        }
        if let Some(failed) = &self.failed {
            ui.label(RichText::new(failed).color(HIT));
        }
        ui.separator();
        for (key, what) in KEYS {
            ui.label(format!("{key}: {what}"));
        }
    }

    fn label(&self, painter: &egui::Painter, _: &Projection) {
        let (line, colour) = self.line();
        let at = painter.clip_rect().left_top() + egui::vec2(18.0, 14.0);
        let letters = egui::FontId::proportional(22.0);
        painter.text(at, egui::Align2::LEFT_TOP, line, letters, colour);
    }

    fn take_events(&mut self) -> Vec<Event> {
        self.drive.take_events()
    }
}
