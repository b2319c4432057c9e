use glam::Vec3;

use super::WindowError;
use crate::live::{Clock, Event};
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Shot};

/// Something to be shown in a window.
pub trait Exhibit {
    /// What a stage must have room for; format, size, samples and frames in flight are the window's own.
    fn stage(&self) -> StageDesc<'static>;

    /// Time goes on, seconds.
    fn advance(&mut self, seconds: f32);

    /// What the camera follows at first and from then on, metres.
    fn focus(&self) -> Vec3;

    /// How far away the camera is at first, metres.
    fn distance(&self) -> f32;

    /// Where it has the camera itself; `None` where the mouse has it.
    fn camera(&self) -> Option<Camera> {
        None
    }

    /// The picture that `camera` sees in so many pixels. `poses` is where the device reads those of a crowd.
    ///
    /// # Errors
    /// The exhibit's own.
    fn draw(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        poses: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError>;

    /// A click at what `camera` sees in the direction `ray`.
    ///
    /// # Errors
    /// The exhibit's own.
    fn click(&mut self, camera: &Camera, ray: Vec3) -> Result<(), WindowError>;

    /// A key that the window has no use for itself, as what it writes, in small letters.
    fn key(&mut self, key: &str);

    /// Its keys, and what they do.
    fn keys(&self) -> &'static [(&'static str, &'static str)];

    /// What is written in the panel.
    fn panel(&mut self, ui: &mut egui::Ui, clock: &mut Clock);

    /// What is written over the picture.
    fn label(&self, painter: &egui::Painter, seen: &Seen);

    /// What has happened since it was asked last.
    fn take_events(&mut self) -> Vec<Event>;

    /// Whether it waits for an answer.
    fn is_asking(&self) -> bool {
        false
    }

    /// The median of the milliseconds in which it posed, where it says.
    fn pose_ms(&self) -> Option<f64> {
        None
    }
}

/// How a picture lies on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// From where it is seen.
    pub camera: Camera,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Pixels in a point of egui's.
    pub pixels_per_point: f32,
}

impl Seen {
    /// Where a place is on the screen, in points; `None` behind the camera.
    #[must_use]
    pub fn point(&self, place: Vec3) -> Option<egui::Pos2> {
        let pixel = self.camera.pixel(place, self.size)? / self.pixels_per_point;
        Some(egui::pos2(pixel.x, pixel.y))
    }
}
