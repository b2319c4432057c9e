//! Plays a scene picture by picture, with a window or without one: clock, camera, clicks, drawing.

use std::collections::VecDeque;
use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{Scene, WindowDesc, WindowError};
use crate::Painter;
use sabaki::gpu::GpuError;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{Camera, CrowdShot, Orbit, Shot};
use sabaki_fixtures::headless::{Headless, HeadlessDesc, Message};

/// A scene with the device that draws it.
pub(super) struct Player<'a> {
    pub(super) scene: &'a mut dyn Scene,
    pub(super) clock: Clock,
    pub(super) camera: MouseCamera,
    desc: &'a WindowDesc,
    pub(super) painter: Painter,
    /// Simulated time, in seconds.
    seconds: f64,
    /// Number of simulated clicks that are done.
    clicked: usize,
}

/// The last of the pictures that a window of the same settings would show, four bytes per pixel, and the validation messages.
/// Without [`WindowDesc::frames`] it is the first one. Panels are left out.
///
/// # Errors
/// An error of the device or of the scene.
pub fn picture(
    scene: &mut dyn Scene,
    desc: &WindowDesc,
) -> Result<(Vec<u8>, Vec<Message>), WindowError> {
    let mut player = Player::open(scene, desc, desc.size)?;
    let mut last = || -> Result<_, WindowError> {
        for _ in 1..desc.frames.unwrap_or(1) {
            player.advance(0.0, desc.size, desc.size)?;
            player.shot(desc.size)?;
        }
        player.advance(0.0, desc.size, desc.size)?;
        let (_, shot, crowd) = player.shot(desc.size)?;
        Ok(player.painter.paint(&shot, crowd.as_ref())?)
    };
    let drawn = last();
    let heard = player.close();
    Ok((drawn?, heard))
}

impl<'a> Player<'a> {
    /// Opens a device for pictures of `size` pixels.
    pub(super) fn open(
        scene: &'a mut dyn Scene,
        desc: &'a WindowDesc,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let device = Headless::new(&HeadlessDesc {
            device: desc.device.clone(),
            validation: desc.validation,
            ..HeadlessDesc::default()
        })?;
        let stage = StageDesc {
            samples: desc.samples,
            ..scene.stage()
        };
        let painter = Painter::new(device, size, &stage)?;
        Ok(Self {
            camera: MouseCamera::new(scene.focus(), scene.distance()),
            scene,
            clock: Clock::default(),
            desc,
            painter,
            seconds: 0.0,
            clicked: 0,
        })
    }

    /// Advances the simulation, `since` seconds after the last picture, and does the clicks that are due. `side` is the size of the
    /// window, `picture` that of the picture beside the panel.
    pub(super) fn advance(
        &mut self,
        since: f32,
        side: [u32; 2],
        picture: [u32; 2],
    ) -> Result<(), WindowError> {
        let seconds = self.clock.advance(self.desc.step.unwrap_or(since));
        self.seconds += f64::from(seconds);
        self.scene.advance(seconds);
        self.camera.follow(self.scene.focus(), seconds);
        while let Some(click) = self.desc.clicks.get(self.clicked) {
            if self.seconds < f64::from(click.seconds) {
                break;
            }
            self.clicked += 1;
            let side = Vec2::from(side.map(|side| side as f32));
            self.click(Vec2::from(click.at) * side, picture)?;
        }
        Ok(())
    }

    pub(super) fn click(&mut self, at: Vec2, picture: [u32; 2]) -> Result<(), WindowError> {
        let camera = self.eye();
        let ray = camera.ray(at, picture);
        self.scene.click(&camera, ray, &mut self.painter.device)
    }

    /// The camera of the next picture.
    fn eye(&self) -> Camera {
        let own = self.scene.camera();
        own.unwrap_or_else(|| self.camera.camera())
    }

    /// What the next picture shows. A crowd's poses are written to the memory that it is drawn from.
    pub(super) fn shot(
        &mut self,
        picture: [u32; 2],
    ) -> Result<(Camera, Shot, Option<CrowdShot>), WindowError> {
        let camera = self.eye();
        let (shot, crowd) = self.scene.draw(camera, picture, self.painter.poses()?)?;
        Ok((camera, shot, crowd))
    }

    /// Destroys the device. Returns the validation messages.
    pub(super) fn close(mut self) -> Vec<Message> {
        self.scene.close(&mut self.painter.device);
        self.painter.close()
    }
}

/// A camera that orbits its focus by the mouse and follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MouseCamera {
    /// Place of the camera around its focus.
    pub orbit: Orbit,
}

impl MouseCamera {
    /// A camera in front of a character that faces +Z, slightly to the side and above.
    #[must_use]
    pub fn new(focus: Vec3, distance: f32) -> Self {
        Self {
            orbit: Orbit {
                target: focus,
                around: 0.55,
                up: 0.17,
                distance,
            },
        }
    }

    /// Orbits by a drag of the mouse, in pixels.
    pub fn drag(&mut self, pixels: Vec2) {
        /// Rotation for each pixel, in radians.
        const TURN: f32 = 0.006;
        self.orbit.around = (self.orbit.around - pixels.x * TURN).rem_euclid(TAU);
        self.orbit.up = (self.orbit.up + pixels.y * TURN).clamp(-0.05, 1.45);
    }

    /// Moves nearer by notches of the mouse wheel.
    pub fn zoom(&mut self, notches: f32) {
        self.orbit.distance = (self.orbit.distance * 0.9f32.powf(notches)).clamp(1.2, 60.0);
    }

    /// Follows a moving focus; `seconds` have passed since the last call.
    pub fn follow(&mut self, focus: Vec3, seconds: f32) {
        /// Time constant, in seconds.
        const SLACK: f32 = 0.35;
        let share = 1.0 - (-seconds.max(0.0) / SLACK).exp();
        self.orbit.target = self.orbit.target.lerp(focus, share);
    }

    /// The camera. It stays above the ground.
    pub fn camera(&self) -> Camera {
        let out = Camera::orbit(self.orbit);
        Camera {
            eye: out.eye.with_y(out.eye.y.max(0.12)),
            field: 32f32.to_radians(),
            ..out
        }
    }
}

/// Maps real time to simulated time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Simulated seconds per real second.
    pub(super) speed: f32,
    pub(super) paused: bool,
    step: bool,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            speed: 1.0,
            paused: false,
            step: false,
        }
    }
}

impl Clock {
    /// Longest real time of a picture, in seconds; after a pause nothing leaps.
    const LONGEST: f32 = 0.1;
    /// Duration of a single step, in seconds.
    const STEP: f32 = 1.0 / 60.0;

    /// Pauses after one step at the next [`Clock::advance`].
    pub(super) fn step(&mut self) {
        (self.paused, self.step) = (true, true);
    }

    /// Simulated seconds for real `seconds`. Negative numbers and NaN count as 0.
    fn advance(&mut self, seconds: f32) -> f32 {
        if std::mem::take(&mut self.step) {
            return Self::STEP;
        }
        match !self.paused && seconds > 0.0 {
            true => seconds.min(Self::LONGEST) * self.speed,
            false => 0.0,
        }
    }
}

/// The last times of something that repeats, in milliseconds.
#[derive(Debug, Default)]
pub(super) struct Times(VecDeque<f32>);

impl Times {
    /// Adds a time to the last `most`.
    pub(super) fn add(&mut self, milliseconds: f32, most: usize) {
        self.0.push_back(milliseconds);
        if self.0.len() > most {
            self.0.pop_front();
        }
    }

    /// All times, the latest one last.
    pub(super) fn all(&self) -> impl DoubleEndedIterator<Item = f32> + ExactSizeIterator + '_ {
        self.0.iter().copied()
    }

    /// Median; the upper one of two middle values; 0 without times.
    pub(super) fn median(&self) -> f64 {
        let mut values: Vec<f32> = self.all().collect();
        values.sort_by(f32::total_cmp);
        values.get(values.len() / 2).copied().map_or(0.0, f64::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_bounded_slowed_and_stepped() {
        let mut clock = Clock::default();
        assert_eq!(clock.advance(0.02), 0.02);
        assert_eq!(clock.advance(7.0), Clock::LONGEST);
        assert_eq!(clock.advance(-1.0), 0.0);
        assert_eq!(clock.advance(f32::NAN), 0.0);
        clock.speed = 0.25;
        assert_eq!(clock.advance(0.04), 0.01);
        clock.step();
        assert_eq!(clock.advance(0.04), Clock::STEP);
        assert_eq!(clock.advance(0.04), 0.0, "after a step it stands");
        clock.paused = false;
        assert_eq!(clock.advance(0.04), 0.01);
    }
}
