//! The event loop of the window: mouse, keyboard, and the pictures.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec2;
use softbuffer::{SoftBufferError, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

use super::gui::{Gui, PANEL};
use super::player::{Player, Times};
use super::{Event, Scene, WindowDesc, WindowError};
use crate::film::png;
use sabaki::archive::write_atomically;
use sabaki_fixtures::headless::Message;

/// Opens a window and returns when it is closed. `hear` is called with each event; the last one is the closing.
///
/// May be called once in a process, on its main thread, as window systems require.
///
/// # Errors
/// [`WindowError::NoWindowSystem`] without a window system; an error of the device; a screenshot that cannot be written.
pub fn show(
    scene: &mut dyn Scene,
    desc: &WindowDesc,
    hear: &mut dyn FnMut(&Event),
) -> Result<(), WindowError> {
    let events = EventLoop::new()?;
    events.set_control_flow(ControlFlow::Poll);
    let mut app = App {
        scene: Some(scene),
        desc,
        hear,
        open: None,
        failed: None,
        times: Times::default(),
        pictures: 0,
        last: None,
        due: None,
        mouse: Vec2::ZERO,
        turns: false,
        panels: desc.panels,
        help: false,
        covered: false,
        hidden: false,
        keep: false,
    };
    let ran = events.run_app(&mut app);
    app.end()?;
    Ok(ran?)
}

/// State while the window is open.
struct OpenWindow<'a> {
    window: Arc<Window>,
    surface: Surface<Arc<Window>, Arc<Window>>,
    player: Player<'a>,
    gui: Gui,
    device: String,
}

struct App<'a> {
    /// Moves to the player when the window opens.
    scene: Option<&'a mut dyn Scene>,
    desc: &'a WindowDesc,
    hear: &'a mut dyn FnMut(&Event),
    open: Option<OpenWindow<'a>>,
    failed: Option<WindowError>,
    /// Times from one picture to the next.
    times: Times,
    /// Number of pictures so far.
    pictures: u64,
    /// Start of the last picture; `None` after a pause.
    last: Option<Instant>,
    /// When the next picture is due.
    due: Option<Instant>,
    /// Place of the mouse, in pixels.
    mouse: Vec2,
    /// The mouse turns the camera.
    turns: bool,
    panels: bool,
    help: bool,
    covered: bool,
    /// The window is covered or minimised.
    hidden: bool,
    /// The next picture is written as a screenshot.
    keep: bool,
}

/// Speed of slow motion.
const SLOW: f32 = 0.2;
/// Pixels of a touchpad per notch of a wheel.
const NOTCH: f32 = 50.0;
/// Least time from one picture to the next.
const PACE: Duration = Duration::from_micros(16_667);
/// Time between pictures while the window is hidden.
const HIDDEN: Duration = Duration::from_millis(50);

impl<'a> App<'a> {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), WindowError> {
        let Some(scene) = self.scene.take() else {
            return Ok(());
        };
        let [width, height] = self.desc.size;
        let attributes = Window::default_attributes()
            .with_title("sabaki")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events.create_window(attributes);
        let window = Arc::new(window.map_err(|error| WindowError::NoWindow(error.to_string()))?);
        let context = softbuffer::Context::new(window.clone())?;
        let surface = Surface::new(&context, window.clone())?;
        let player = Player::open(scene, self.desc, window.inner_size().into())?;
        let gui = Gui::new(&window, &player.painter.device)?;
        let device = player.painter.device.device_name().to_owned();
        (self.hear)(&Event::Opened {
            device: device.clone(),
            size: player.painter.size(),
        });
        self.open = Some(OpenWindow {
            window,
            surface,
            player,
            gui,
            device,
        });
        Ok(())
    }

    /// Destroys the device, whatever error came before.
    fn end(self) -> Result<(), WindowError> {
        if let Some(OpenWindow { player, gui, .. }) = self.open {
            let events = player.scene.take_events();
            events.iter().for_each(&mut *self.hear);
            let median_pose_ms = player.scene.pose_ms();
            gui.destroy();
            let words = |message: Message| format!("{}: {}", message.id, message.text);
            (self.hear)(&Event::Closed {
                frames: self.pictures,
                median_frame_ms: self.times.median(),
                median_pose_ms,
                validation: player.close().into_iter().map(words).collect(),
            });
        }
        self.failed.map_or(Ok(()), Err)
    }

    fn fail(&mut self, events: &ActiveEventLoop, error: WindowError) {
        self.failed.get_or_insert(error);
        events.exit();
    }

    /// Draws one picture. Returns false if the window has no size.
    fn frame(&mut self) -> Result<bool, WindowError> {
        let Some(open) = &mut self.open else {
            return Ok(false);
        };
        let size: [u32; 2] = open.window.inner_size().into();
        if size.contains(&0) {
            self.last = None;
            return Ok(false);
        }
        if size != open.player.painter.size() {
            open.player.painter.resize(size)?;
            (self.hear)(&Event::Resized { size });
        }
        let picture = beside_panel(size, self.panels, open.gui.scale());
        let now = Instant::now();
        let since = self
            .last
            .replace(now)
            .map(|last| (now - last).as_secs_f32());
        if let Some(seconds) = since {
            self.times.add(1e3 * seconds, 240);
        }
        open.player.advance(since.unwrap_or(0.0), size, picture)?;
        let (camera, shot, crowd) = open.player.shot(picture)?;
        let panels = self.panels.then(|| {
            let scale = open.gui.scale();
            let seen = |place| {
                let pixel = camera.pixel(place, picture)? / scale;
                Some(egui::pos2(pixel.x, pixel.y))
            };
            let (scene, clock) = (&mut *open.player.scene, &mut open.player.clock);
            let head = (&*open.device, &self.times);
            let (window, help) = (&open.window, self.help);
            open.gui.layout(window, scene, clock, head, &seen, help)
        });
        if let Some(panels) = &panels {
            open.gui.upload(panels)?;
        }
        let gui = &mut open.gui;
        let pixels =
            open.player
                .painter
                .paint_over(picture, &shot, crowd.as_ref(), |cmd, target| match panels {
                    // SAFETY: the painter gives a buffer that is being recorded, and its target.
                    Some(panels) => unsafe { gui.draw(cmd, &target, panels) },
                    None => Ok(()),
                })?;
        open.window.pre_present_notify();
        open.show(size, &pixels)?;
        self.pictures += 1;
        let is_last = self.desc.frames == Some(self.pictures);
        let file = match &self.desc.screenshot {
            Some(file) if is_last => Some(file.clone()),
            _ => self.keep.then(free_name),
        };
        self.keep = false;
        if let Some(file) = file {
            save(&file, size, &pixels)?;
            (self.hear)(&Event::Screenshot { file });
        }
        let events = open.player.scene.take_events();
        events.iter().for_each(&mut *self.hear);
        Ok(true)
    }

    /// Whether the window may be visible. Not every window system sends an event when it is minimised.
    fn look(&mut self) {
        let Some(open) = &self.open else {
            return;
        };
        let hidden = self.covered || open.window.is_minimized() == Some(true);
        if hidden != std::mem::replace(&mut self.hidden, hidden) {
            let event = if hidden { Event::Hidden } else { Event::Shown };
            (self.hear)(&event);
        }
    }

    /// Handles a key that goes down.
    fn key(&mut self, events: &ActiveEventLoop, key: &Key) {
        let Some(OpenWindow { player, .. }) = &mut self.open else {
            return;
        };
        let clock = &mut player.clock;
        match key.as_ref() {
            Key::Named(NamedKey::Space) => clock.paused = !clock.paused,
            Key::Named(NamedKey::F12) => self.keep = true,
            Key::Named(NamedKey::Escape) => events.exit(),
            Key::Character(".") => clock.step(),
            Key::Character("s" | "S") => {
                clock.speed = if clock.speed < 1.0 { 1.0 } else { SLOW };
            }
            Key::Character("p" | "P") => self.panels = !self.panels,
            Key::Character("h" | "H") => {
                self.help = !self.help || !self.panels;
                self.panels |= self.help;
            }
            _ => {}
        }
    }
}

impl OpenWindow<'_> {
    /// Shows the pixels of a picture in the window.
    fn show(&mut self, size: [u32; 2], pixels: &[u8]) -> Result<(), SoftBufferError> {
        let [Some(width), Some(height)] = size.map(NonZeroU32::new) else {
            return Ok(());
        };
        self.surface.resize(width, height)?;
        let mut shown = self.surface.buffer_mut()?;
        for (shown, pixel) in shown.iter_mut().zip(pixels.chunks_exact(4)) {
            *shown = u32::from_be_bytes([0, pixel[0], pixel[1], pixel[2]]);
        }
        shown.present()
    }
}

impl From<SoftBufferError> for WindowError {
    fn from(error: SoftBufferError) -> Self {
        Self::NoWindow(error.to_string())
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.fail(events, error);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else {
            return;
        };
        // egui requests repaints; the loop draws anyway.
        if self.panels && open.gui.hears(&open.window, &event) {
            self.turns = false;
            return;
        }
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => events.exit(),
            WindowEvent::Occluded(covered) => self.covered = covered,
            WindowEvent::CursorMoved { position, .. } => {
                let at = Vec2::new(position.x as f32, position.y as f32);
                let moved = at - std::mem::replace(&mut self.mouse, at);
                if self.turns {
                    open.player.camera.drag(moved);
                }
            }
            WindowEvent::MouseInput { state, button, .. } => {
                let pressed = state == ElementState::Pressed;
                let size = open.player.painter.size();
                match button {
                    MouseButton::Right => self.turns = pressed,
                    MouseButton::Left if pressed && !size.contains(&0) => {
                        let picture = beside_panel(size, self.panels, open.gui.scale());
                        if let Err(error) = open.player.click(self.mouse, picture) {
                            self.fail(events, error);
                        }
                    }
                    _ => {}
                }
            }
            WindowEvent::MouseWheel { delta, .. } => open.player.camera.zoom(match delta {
                MouseScrollDelta::LineDelta(_, lines) => lines,
                MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / NOTCH,
            }),
            WindowEvent::KeyboardInput { event, .. } => {
                let KeyEvent {
                    logical_key: key,
                    state,
                    repeat,
                    ..
                } = event;
                // A key that is held down repeats; only single steps use that.
                if repeat && key.as_ref() != Key::Character(".") {
                    return;
                }
                let is_down = state == ElementState::Pressed;
                let name = match &key {
                    Key::Named(NamedKey::Space) => "space".to_owned(),
                    Key::Named(NamedKey::Shift) => "shift".to_owned(),
                    Key::Character(text) => text.to_lowercase(),
                    _ => String::new(),
                };
                if !open.player.scene.key(&name, is_down) && is_down {
                    self.key(events, &key);
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let is_over = self.desc.frames.is_some_and(|most| self.pictures >= most);
        if (self.desc.stops)() || is_over {
            events.exit();
        }
        if events.exiting() {
            return;
        }
        let begun = Instant::now();
        // Events wake the loop up before its time.
        if self.due.is_some_and(|due| begun < due) {
            return;
        }
        self.look();
        let pause = match self.frame() {
            Ok(true) if !self.hidden && !self.desc.in_step => Duration::ZERO,
            Ok(true) if !self.hidden => PACE,
            Ok(_) => HIDDEN,
            Err(error) => return self.fail(events, error),
        };
        let due = begun + pause;
        self.due = Some(due);
        events.set_control_flow(ControlFlow::WaitUntil(due));
    }
}

/// Size of the picture beside the panel, in pixels.
fn beside_panel([width, height]: [u32; 2], panels: bool, scale: f32) -> [u32; 2] {
    let panel = if panels { (PANEL * scale) as u32 } else { 0 };
    [width.saturating_sub(panel).max(width.div_ceil(4)), height]
}

/// The first name of `sabaki-0001.png`, `sabaki-0002.png` and so on without a file.
fn free_name() -> PathBuf {
    let names = (1..10_000).map(|number| PathBuf::from(format!("sabaki-{number:04}.png")));
    let mut free = names.filter(|name| !name.exists());
    free.next().unwrap_or_else(|| PathBuf::from("sabaki.png"))
}

fn save(path: &Path, size: [u32; 2], pixels: &[u8]) -> Result<(), WindowError> {
    use std::io::Write;
    let colours = pixels.chunks_exact(4).flat_map(|pixel| &pixel[..3]);
    let bytes = png(size, &colours.copied().collect::<Vec<u8>>())?;
    write_atomically(path, |file| file.write_all(&bytes)).map_err(|source| WindowError::Write {
        path: path.to_owned(),
        source,
    })
}
