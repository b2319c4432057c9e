//! Shows a crowd in the window.

use egui::{RichText, Slider};
use glam::Vec3;

use super::gui::bars;
use super::times::median;
use super::{Projection, View, WindowError};
use crate::live::{CameraPath, Clock, Event, LiveCrowd};
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Shot, level_colour};

/// A crowd with its keys.
pub struct CrowdView {
    live_crowd: LiveCrowd,
}

const KEYS: [(&str, &str); 3] = [
    ("l", "levels of detail, or all joints for all"),
    ("t", "everybody in the colour of its level"),
    ("c", "the next camera path"),
];

impl CrowdView {
    /// Shows a crowd.
    #[must_use]
    pub fn new(live_crowd: LiveCrowd) -> Self {
        Self { live_crowd }
    }
}

impl View for CrowdView {
    fn stage(&self) -> StageDesc<'_> {
        let crowd = &self.live_crowd.formation;
        StageDesc {
            shadow_side: 4096,
            max_members: crowd.len() as u32,
            max_crowd_len: crowd.max_output_len() as u32,
            max_parts: crowd.parts() as u32,
            meshes: self.live_crowd.meshes(),
            ..StageDesc::default()
        }
    }

    fn advance(&mut self, seconds: f32) {
        self.live_crowd.advance(seconds);
    }

    fn focus(&self) -> Vec3 {
        Vec3::new(0.0, 1.0, -4.0)
    }

    fn distance(&self) -> f32 {
        13.0
    }

    fn camera(&self) -> Option<Camera> {
        self.live_crowd.camera()
    }

    fn draw(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        poses: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError> {
        let (shot, crowd) = self.live_crowd.shot(camera, size, poses)?;
        Ok((shot, Some(crowd)))
    }

    fn click(&mut self, _: &Camera, _: Vec3) -> Result<(), WindowError> {
        Ok(())
    }

    fn key(&mut self, key: &str) {
        match key {
            "l" => self.live_crowd.levels = !self.live_crowd.levels,
            "t" => self.live_crowd.tinted = !self.live_crowd.tinted,
            "c" => {
                let all = CameraPath::ALL;
                let at = all.iter().position(|path| *path == self.live_crowd.path);
                self.live_crowd.path = all[at.map_or(0, |at| (at + 1) % all.len())];
            }
            _ => {}
        }
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &KEYS
    }

    fn panel(&mut self, ui: &mut egui::Ui, _: &mut Clock) {
        let live_crowd = &mut self.live_crowd;
        let count = live_crowd.formation.len();
        let plural = if count == 1 { "" } else { "s" };
        ui.label(RichText::new(format!("{count} character{plural}")).strong());
        ui.checkbox(&mut live_crowd.levels, "levels of detail by distance");
        ui.checkbox(
            &mut live_crowd.tinted,
            "everybody in the colour of its level",
        );
        let mut error = live_crowd.formation.error();
        let slider = Slider::new(&mut error, 0.25..=16.0).logarithmic(true);
        ui.add_enabled(live_crowd.levels, slider.text("pixels of error"));
        live_crowd.formation.set_error(error);
        ui.label("camera");
        ui.horizontal(|ui| {
            for path in CameraPath::ALL {
                ui.selectable_value(&mut live_crowd.path, path, path.name());
            }
        });
        ui.separator();
        let posed = median(live_crowd.pose_times());
        ui.label(format!("posed in {posed:.2} ms, into mapped memory"));
        bars(ui, live_crowd.pose_times(), "ms");
        ui.separator();
        ui.label("characters on each level");
        census(ui, &live_crowd.formation.census());
    }

    fn label(&self, _: &egui::Painter, _: &Projection) {}

    fn take_events(&mut self) -> Vec<Event> {
        Vec::new()
    }

    fn pose_ms(&self) -> Option<f64> {
        Some(median(self.live_crowd.pose_times()))
    }
}

/// Draws a bar for each level, in its colour.
fn census(ui: &mut egui::Ui, census: &[usize]) {
    let most = census.iter().copied().max().unwrap_or(0).max(1);
    for (level, &count) in census.iter().enumerate() {
        ui.horizontal(|ui| {
            let text = format!("{level:>2} {count:>6}");
            ui.label(RichText::new(text).monospace().size(11.0));
            let wide = ui.available_width() * count as f32 / most as f32;
            let size = egui::vec2(wide.max(1.0), 9.0);
            let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
            let colour = level_colour(level, census.len());
            let encoded = |linear: f32| (255.0 * linear.clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
            let [red, green, blue] = colour.to_array().map(encoded);
            let fill = egui::Color32::from_rgb(red, green, blue);
            ui.painter().rect_filled(rect, 1.0, fill);
        });
    }
}
