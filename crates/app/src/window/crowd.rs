//! An endless crowd, posed straight into the memory that it is drawn from.

use std::sync::Arc;
use std::time::Instant;

use egui::{RichText, Slider};
use glam::Vec3;

use super::gui::bars;
use super::player::Times;
use super::{Drawn, Scene};
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, Formation, Mesh, Outfit, level_colour};

/// An endless crowd.
pub struct CrowdScene {
    /// The characters.
    pub formation: Formation,
    /// Chooses levels of detail by distance.
    pub levels: bool,
    /// Draws each character in the colour of its level.
    pub tinted: bool,
    outfit: Arc<Outfit>,
    /// Whether the mouse has the camera.
    is_free: bool,
    times: Times,
}

impl CrowdScene {
    /// A crowd with levels by distance, in its own colours. The outfit has the skin that it was created with.
    #[must_use]
    pub fn new(formation: Formation, outfit: Arc<Outfit>) -> Self {
        Self {
            formation,
            levels: true,
            tinted: false,
            outfit,
            is_free: false,
            times: Times::default(),
        }
    }
}

impl Scene for CrowdScene {
    fn meshes(&self) -> &[Mesh] {
        &self.outfit.meshes
    }

    fn stage(&self) -> StageDesc<'_> {
        StageDesc::for_crowd(&self.formation, self.meshes())
    }

    fn advance(&mut self, seconds: f32) {
        self.formation.advance(seconds);
    }

    fn focus(&self) -> Vec3 {
        Vec3::new(0.0, 1.0, -4.0)
    }

    fn distance(&self) -> f32 {
        13.0
    }

    fn camera(&self) -> Option<Camera> {
        (!self.is_free).then(|| self.formation.camera())
    }

    fn draw(&mut self, camera: Camera, size: [u32; 2], poses: &mut [F32x16]) -> Drawn {
        self.formation.use_levels(self.levels);
        self.formation.show_levels(self.tinted);
        self.formation.look_from(&camera, size)?;
        let started = Instant::now();
        self.formation.pose(poses)?;
        self.times.add(1e3 * started.elapsed().as_secs_f32(), 120);
        let (shot, crowd) = self.formation.shot(camera, size)?;
        Ok((shot, Some(crowd)))
    }

    fn key(&mut self, key: &str, is_down: bool) -> bool {
        match key {
            "l" | "t" | "c" if !is_down => {}
            "l" => self.levels = !self.levels,
            "t" => self.tinted = !self.tinted,
            "c" => self.is_free = !self.is_free,
            _ => return false,
        }
        true
    }

    fn keys(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("l", "levels of detail, or all joints for all"),
            ("t", "everybody in the colour of its level"),
            (
                "c",
                "the mouse has the camera, or it stands in front of the crowd",
            ),
        ]
    }

    fn panel(&mut self, ui: &mut egui::Ui) {
        let count = self.formation.len();
        let plural = if count == 1 { "" } else { "s" };
        ui.label(RichText::new(format!("{count} character{plural}")).strong());
        ui.checkbox(&mut self.levels, "levels of detail by distance");
        ui.checkbox(&mut self.tinted, "everybody in the colour of its level");
        let slider = Slider::new(self.formation.error_mut(), 0.25..=16.0).logarithmic(true);
        ui.add_enabled(self.levels, slider.text("pixels of error"));
        ui.checkbox(&mut self.is_free, "the mouse has the camera");
        ui.separator();
        let posed = self.times.median();
        ui.label(format!("posed in {posed:.2} ms, into mapped memory"));
        bars(ui, &self.times);
        ui.separator();
        ui.label("characters on each level");
        add_census(ui, &self.formation.census());
    }

    fn pose_ms(&self) -> Option<f64> {
        Some(self.times.median())
    }
}

/// A bar for each level, in its colour.
fn add_census(ui: &mut egui::Ui, census: &[usize]) {
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
