use glam::Vec3;

use super::WindowError;
use crate::live::{Clock, Event};
use sabaki::math::F32x16;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Shot};

/// The contents of a window.
pub trait View {
    /// Settings of the stage. The window sets format, size, samples and frames in flight.
    fn stage(&self) -> StageDesc<'_>;

    /// Advances the simulation by some seconds.
    fn advance(&mut self, seconds: f32);

    /// Focus of the camera, in metres.
    fn focus(&self) -> Vec3;

    /// Initial distance of the camera, in metres.
    fn distance(&self) -> f32;

    /// The camera, if the view controls it; `None` if the mouse does.
    fn camera(&self) -> Option<Camera> {
        None
    }

    /// The scene that `camera` sees in a picture of `size` pixels. The device reads a crowd's poses from `poses`.
    ///
    /// # Errors
    /// Those of the implementation.
    fn draw(
        &mut self,
        camera: Camera,
        size: [u32; 2],
        poses: &mut [F32x16],
    ) -> Result<(Shot, Option<CrowdShot>), WindowError>;

    /// Handles a click in the direction `ray` of `camera`.
    ///
    /// # Errors
    /// Those of the implementation.
    fn click(&mut self, camera: &Camera, ray: Vec3) -> Result<(), WindowError>;

    /// Handles a key that the window does not use itself: its text in lower case.
    fn key(&mut self, key: &str);

    /// Handles a key that goes down or up: its text in lower case, `space` or `shift`. Returns whether it is one of the view's; the
    /// window then does not use it.
    fn hold(&mut self, _key: &str, _is_down: bool) -> bool {
        false
    }

    /// The keys of the view and their descriptions.
    fn keys(&self) -> &'static [(&'static str, &'static str)];

    /// Lays out the panel.
    fn panel(&mut self, ui: &mut egui::Ui, clock: &mut Clock);

    /// Draws text over the picture.
    fn label(&self, painter: &egui::Painter, seen: &Projection);

    /// Takes the events since the last call.
    fn take_events(&mut self) -> Vec<Event>;

    /// Whether the view waits for an answer.
    fn is_waiting(&self) -> bool {
        false
    }

    /// Median time to pose the crowd, in milliseconds, if there is one.
    fn pose_ms(&self) -> Option<f64> {
        None
    }
}

/// The projection of a picture on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// Camera of the picture.
    pub camera: Camera,
    /// Size of the picture, in pixels.
    pub size: [u32; 2],
    /// Pixels per point of egui.
    pub pixels_per_point: f32,
}

impl Projection {
    /// The position of a place on the screen, in points; `None` behind the camera.
    #[must_use]
    pub fn point(&self, place: Vec3) -> Option<egui::Pos2> {
        let pixel = self.camera.pixel(place, self.size)? / self.pixels_per_point;
        Some(egui::pos2(pixel.x, pixel.y))
    }
}
