//! The event loop of the window.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec2;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use super::desc::PACE;
use super::gui::{Gui, GuiFrame, PANEL};
use super::input::{Mouse, UserAction, held};
use super::times::Times;
use super::view::Projection;
use super::{View, WindowDesc, WindowError};
use crate::film::png;
use crate::live::{Clock, Event, Orbit};
use crate::present::{Outcome, Presenter, PresenterDesc, Scene, is_window_gone};
use sabaki::archive::write_atomically;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::Camera;

/// State while the window is open.
struct OpenWindow {
    window: Arc<Window>,
    presenter: Presenter,
    gui: Gui,
    device: String,
}

pub(super) struct App<'a> {
    view: &'a mut dyn View,
    desc: &'a WindowDesc,
    hear: &'a mut dyn FnMut(&Event),
    open: Option<OpenWindow>,
    failed: Option<WindowError>,
    clock: Clock,
    orbit: Orbit,
    mouse: Mouse,
    times: Times,
    /// Start of the last picture.
    last: Option<Instant>,
    /// Simulated time, in seconds.
    seconds: f64,
    /// Number of simulated clicks that are done.
    clicked: usize,
    size: [u32; 2],
    panels: bool,
    help: bool,
    /// The window is covered.
    covered: bool,
    /// The window is covered or minimised.
    hidden: bool,
    /// The next picture is written as a screenshot.
    keep: bool,
}

impl<'a> App<'a> {
    pub(super) fn new(
        view: &'a mut dyn View,
        desc: &'a WindowDesc,
        hear: &'a mut dyn FnMut(&Event),
    ) -> Self {
        let orbit = Orbit {
            distance: view.distance(),
            ..Orbit::around_fighter(view.focus())
        };
        Self {
            view,
            hear,
            open: None,
            failed: None,
            clock: Clock::default(),
            orbit,
            mouse: Mouse::default(),
            times: Times::default(),
            last: None,
            seconds: 0.0,
            clicked: 0,
            size: [0; 2],
            panels: desc.panels,
            help: false,
            covered: false,
            hidden: false,
            keep: false,
            desc,
        }
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), WindowError> {
        let [width, height] = self.desc.size;
        let attributes = Window::default_attributes()
            .with_title(&self.desc.title)
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events.create_window(attributes);
        let window = Arc::new(window.map_err(|error| WindowError::NoWindow(error.to_string()))?);
        let size = window.inner_size();
        let presenter = Presenter::new(
            window.clone(),
            &PresenterDesc {
                device: self.desc.device.clone(),
                validation: self.desc.validation,
                size: [size.width, size.height],
                in_step: self.desc.in_step,
                stage: StageDesc {
                    samples: self.desc.samples,
                    ..self.view.stage()
                },
            },
        )?;
        let device = presenter.device_name().to_owned();
        self.say(&Event::Opened {
            device: device.clone(),
            size: [size.width, size.height],
        });
        self.open = Some(OpenWindow {
            gui: Gui::new(&window, presenter.most_side()),
            window,
            presenter,
            device,
        });
        Ok(())
    }

    fn say(&mut self, event: &Event) {
        (self.hear)(event);
    }

    /// Closes the window and destroys the device, whatever error came before.
    pub(super) fn end(mut self) -> Result<(), WindowError> {
        let heard = self.open.take().map(|open| open.presenter.destroy());
        for event in self.view.take_events() {
            self.say(&event);
        }
        if let Some(heard) = heard {
            let words = |message: sabaki_fixtures::headless::Message| {
                format!("{}: {}", message.id, message.text)
            };
            self.say(&Event::Closed {
                asking: self.view.is_waiting(),
                frames: self.times.pictures,
                median_frame_ms: self.times.median(),
                median_pose_ms: self.view.pose_ms(),
                validation: heard.into_iter().map(words).collect(),
            });
        }
        self.failed.map_or(Ok(()), Err)
    }

    fn fail(&mut self, events: &ActiveEventLoop, error: WindowError) {
        self.failed.get_or_insert(error);
        events.exit();
    }

    /// The camera of the next picture.
    fn camera(&self) -> Camera {
        let own = self.view.camera();
        own.unwrap_or_else(|| self.orbit.camera())
    }

    /// Size of the picture beside the panel, in pixels.
    fn picture(&self, scale: f32) -> [u32; 2] {
        let [width, height] = self.size;
        let panel = match self.panels {
            true => (PANEL * scale) as u32,
            false => 0,
        };
        [width.saturating_sub(panel).max(width.div_ceil(4)), height]
    }

    /// Draws one picture. Returns false if the window accepts none.
    fn frame(&mut self) -> Result<bool, WindowError> {
        let Some(mut open) = self.open.take() else {
            return Ok(false);
        };
        let shown = self.frame_in(&mut open);
        self.open = Some(open);
        shown
    }

    fn frame_in(&mut self, open: &mut OpenWindow) -> Result<bool, WindowError> {
        if !open.presenter.begin()? {
            self.times.pause();
            self.last = None;
            return Ok(false);
        }
        let size = open.presenter.size();
        if size != self.size {
            if self.size != [0; 2] {
                self.say(&Event::Resized { size });
            }
            self.size = size;
        }
        self.go_on();
        let (camera, picture) = (self.camera(), self.picture(open.gui.scale()));
        self.clicks(&camera, picture)?;
        let poses = open.presenter.poses()?;
        let (shot, crowd) = self.view.draw(camera, picture, poses)?;
        let laid = self.panels.then(|| {
            let frame = GuiFrame {
                seen: Projection {
                    camera,
                    size: picture,
                    pixels_per_point: open.gui.scale(),
                },
                view: &mut *self.view,
                clock: &mut self.clock,
                times: &self.times,
                device: &open.device,
                help: self.help,
            };
            open.gui.layout(&open.window, frame)
        });
        let is_last = self.desc.frames == Some(self.times.pictures + 1);
        let file = match (&self.desc.screenshot, self.keep) {
            (Some(file), _) if is_last => Some(file.clone()),
            (_, true) => Some(free_name()),
            _ => None,
        };
        self.keep = false;
        open.window.pre_present_notify();
        let outcome = open.presenter.show(&Scene {
            size: picture,
            shot: &shot,
            crowd: crowd.as_ref(),
            panels: laid.as_ref(),
            read: file.is_some(),
        })?;
        if let (Outcome::Shown(pixels), Some(file)) = (&outcome, file) {
            let pixels = pixels.as_ref().ok_or(WindowError::NotReadable)?;
            save(&file, size, pixels)?;
            self.say(&Event::Screenshot { file });
        }
        self.times.shown();
        for event in self.view.take_events() {
            self.say(&event);
        }
        Ok(true)
    }

    /// Advances the simulation to this picture.
    fn go_on(&mut self) {
        let now = Instant::now();
        let since = self
            .last
            .replace(now)
            .map_or(0.0, |last| (now - last).as_secs_f32());
        let seconds = self.clock.advance(self.desc.step.unwrap_or(since));
        self.seconds += f64::from(seconds);
        self.view.advance(seconds);
        self.orbit.follow(self.view.focus(), seconds);
    }

    fn clicks(&mut self, camera: &Camera, picture: [u32; 2]) -> Result<(), WindowError> {
        while let Some(click) = self.desc.clicks.get(self.clicked) {
            if self.seconds < f64::from(click.seconds) {
                break;
            }
            self.clicked += 1;
            let [width, height] = self.size.map(|side| side as f32);
            let pixel = Vec2::from(click.at) * Vec2::new(width, height);
            self.view.click(camera, camera.ray(pixel, picture))?;
        }
        Ok(())
    }

    /// Whether the window may be visible. Not every window system sends an event when it is minimised.
    fn look(&mut self) {
        let Some(open) = &self.open else {
            return;
        };
        let hidden = self.covered || open.window.is_minimized() == Some(true);
        if hidden != std::mem::replace(&mut self.hidden, hidden) {
            self.say(if hidden {
                &Event::Hidden
            } else {
                &Event::Shown
            });
        }
    }

    fn act_on(&mut self, action: UserAction, events: &ActiveEventLoop) -> Result<(), WindowError> {
        match action {
            UserAction::Throw(at) if !self.size.contains(&0) => {
                let scale = self.open.as_ref().map_or(1.0, |open| open.gui.scale());
                let (camera, picture) = (self.camera(), self.picture(scale));
                self.view.click(&camera, camera.ray(at, picture))?;
            }
            UserAction::Throw(_) => {}
            UserAction::Turn(pixels) => self.orbit.drag(pixels),
            UserAction::Zoom(notches) => self.orbit.zoom(notches),
            UserAction::Pause => self.clock.paused = !self.clock.paused,
            UserAction::Step => self.clock.step(),
            UserAction::Slow => self.clock.speed = if self.clock.speed < 1.0 { 1.0 } else { SLOW },
            UserAction::Panel => self.panels = !self.panels,
            UserAction::Help => {
                self.help = !self.help || !self.panels;
                self.panels |= self.help;
            }
            UserAction::Screenshot => self.keep = true,
            UserAction::Close => events.exit(),
            UserAction::Key(key) => self.view.key(&key),
        }
        Ok(())
    }
}

/// Speed of slow motion.
const SLOW: f32 = 0.2;

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.open.is_none()
            && let Err(error) = self.open(events)
        {
            self.fail(events, error);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else {
            return;
        };
        // egui requests repaints; the loop draws anyway.
        let is_panels = self.panels && open.gui.hears(&open.window, &event);
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => {
                events.exit();
                return;
            }
            WindowEvent::Resized(size) => open.presenter.resize([size.width, size.height]),
            WindowEvent::Occluded(covered) => self.covered = covered,
            _ => {}
        }
        if is_panels {
            self.mouse.let_go();
            return;
        }
        if let Some((key, is_down)) = held(&event)
            && self.view.hold(&key, is_down)
        {
            return;
        }
        if let Some(action) = self.mouse.action(&event)
            && let Err(error) = self.act_on(action, events)
        {
            self.fail(events, error);
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if (self.desc.stops)()
            || self
                .desc
                .frames
                .is_some_and(|most| self.times.pictures >= most)
        {
            events.exit();
        }
        if events.exiting() {
            return;
        }
        self.look();
        let begun = Instant::now();
        let pause = match self.frame() {
            Ok(true) if self.hidden => HIDDEN,
            // A driver that does not wait for the screen would draw thousands of pictures per second.
            Ok(true) if self.desc.in_step => PACE.saturating_sub(begun.elapsed()),
            Ok(true) => Duration::ZERO,
            Ok(false) => HIDDEN,
            // The window was destroyed by the system.
            Err(WindowError::Gpu(error)) if is_window_gone(&error) => return events.exit(),
            Err(error) => return self.fail(events, error),
        };
        events.set_control_flow(match pause.is_zero() {
            true => ControlFlow::Poll,
            false => ControlFlow::WaitUntil(begun + pause),
        });
    }
}

/// Time between attempts to draw while the window is hidden.
const HIDDEN: Duration = Duration::from_millis(50);

/// The first name of `sabaki-0001.png`, `sabaki-0002.png` and so on without a file.
fn free_name() -> PathBuf {
    let names = (1..10_000).map(|number| PathBuf::from(format!("sabaki-{number:04}.png")));
    let mut free = names.filter(|name| !name.exists());
    free.next().unwrap_or_else(|| PathBuf::from("sabaki.png"))
}

fn save(path: &Path, size: [u32; 2], pixels: &[u8]) -> Result<(), WindowError> {
    use std::io::Write;
    let bytes = png(size, pixels)?;
    write_atomically(path, |file| file.write_all(&bytes)).map_err(|source| WindowError::Write {
        path: path.to_owned(),
        source,
    })
}
