//! Draws a stage into a window: swapchain, frames in flight, panels over the picture, screenshots.
//!
//! The window comes from any library that gives raw window handles. The presenter owns its device, as
//! [`Headless`](sabaki_fixtures::headless::Headless) does, and alone submits to its queue.

mod capture;
mod frames;
mod image_uses;
mod overlay;
mod surface;
mod swapchain;

use std::sync::Arc;

use ash::vk;

use capture::Capture;
use frames::Frame;
use image_uses::{ACQUIRED, BLENDED, PRESENTED, begin_panels};
use overlay::Overlay;
use sabaki::gpu::internal::DeviceMemory;
use sabaki::gpu::{Context, GpuError};
use sabaki::math::F32x16;
use sabaki_draw::internal::{COPIED, DRAWN, ImageBarrier, image_barrier};
use sabaki_draw::scene::{CrowdShot, Shot};
use sabaki_draw::{Picture, Stage, StageDesc, Target};
use sabaki_fixtures::headless::{DeviceChoice, Headless, HeadlessDesc, Message};
use surface::Surface;
use swapchain::{Acquired, SwapImage, Swapchain, SwapchainDesc};

pub(crate) use overlay::GuiOutput;
pub(crate) use surface::WindowSystem;

/// Settings of a [`Presenter`].
#[derive(Clone, Debug)]
pub(crate) struct PresenterDesc<'a> {
    pub(crate) device: DeviceChoice,
    /// Enables validation.
    pub(crate) validation: bool,
    /// Size in pixels, for window systems that leave it to the program.
    pub(crate) size: [u32; 2],
    /// Waits for the screen (vertical synchronization).
    pub(crate) in_step: bool,
    /// Settings of the stage. The presenter sets format, size and frames in flight; 0 samples chooses a number for the device.
    pub(crate) stage: StageDesc<'a>,
}

/// The outcome of a frame.
pub(crate) enum Outcome {
    /// The frame was submitted. Red, green and blue of its pixels if they were asked for.
    Shown(Option<Vec<u8>>),
    /// The window accepts no frame at the moment.
    Skipped,
}

/// The contents of a frame.
pub(crate) struct Scene<'a> {
    /// Size of the picture, in pixels, from the upper left corner. Panels cover the rest of the window.
    pub(crate) size: [u32; 2],
    pub(crate) shot: &'a Shot,
    pub(crate) crowd: Option<&'a CrowdShot>,
    pub(crate) panels: Option<&'a GuiOutput>,
    /// Reads the pixels back.
    pub(crate) read: bool,
}

/// Draws frames into a window.
#[derive(Default)]
pub(crate) struct Presenter {
    // In order of creation; `teardown` destroys them in reverse.
    device: Option<Headless>,
    surface: Option<Surface>,
    swapchain: Swapchain,
    format: vk::Format,
    frames: [Frame; FRAMES],
    stage: Option<Stage>,
    overlay: Option<Overlay>,
    size: [u32; 2],
    in_step: bool,
    /// The swapchain no longer fits the window.
    stale: bool,
    turn: usize,
    acquired: Option<u32>,
}

/// Number of frames in flight.
const FRAMES: usize = 2;

impl Presenter {
    /// Creates a presenter. Frees everything if it fails.
    ///
    /// # Errors
    /// Those of [`Headless::new`] and [`Stage::new`]; [`GpuError::Missing`] where the device cannot show anything in this window.
    pub(crate) fn new(
        window: Arc<dyn WindowSystem>,
        desc: &PresenterDesc<'_>,
    ) -> Result<Self, GpuError> {
        let mut presenter = Self::default();
        (presenter.size, presenter.in_step) = (desc.size, desc.in_step);
        match presenter.fill(window, desc) {
            Ok(()) => Ok(presenter),
            Err(error) => {
                presenter.teardown();
                Err(error)
            }
        }
    }

    fn fill(
        &mut self,
        window: Arc<dyn WindowSystem>,
        desc: &PresenterDesc<'_>,
    ) -> Result<(), GpuError> {
        let wanted = HeadlessDesc {
            device: desc.device.clone(),
            validation: desc.validation,
            instance_extensions: surface::extensions(&*window)?,
            device_extensions: vec![ash::khr::swapchain::NAME],
            ..HeadlessDesc::default()
        };
        let device = self.device.insert(Headless::new(&wanted)?);
        let surface = self.surface.insert(Surface::new(device, window)?);
        let context = device.context()?.clone();
        let support = surface.support(&context)?;
        self.format = support.format()?.format;
        for frame in &mut self.frames {
            frame.fill(&context)?;
        }
        let size = support.size(desc.size).map(|side| side.max(1));
        let samples = match desc.stage.samples {
            0 if is_software(&context) => 1,
            0 => StageDesc::default().samples,
            samples => samples,
        };
        let stage = StageDesc {
            samples,
            format: self.format,
            size,
            frames_in_flight: FRAMES as u32,
            ..desc.stage
        };
        let stage = device.make(|context, memory| Stage::new(context, memory, &stage))?;
        self.stage = Some(stage);
        self.overlay = Some(Overlay::new(&context, self.format, FRAMES)?);
        self.stale = true;
        Ok(())
    }

    /// Name of the device.
    pub(crate) fn device_name(&self) -> &str {
        self.device.as_ref().map_or("", Headless::device_name)
    }

    /// Largest width and height of a texture.
    pub(crate) fn most_side(&self) -> u32 {
        let limit = |context: &Context| context.limits().max_image_dimension2_d;
        self.context().map_or(2048, limit)
    }

    /// Size of the frames, in pixels; 0 while nothing is drawn.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.swapchain.size
    }

    /// Tells that the size of the window has changed.
    pub(crate) fn resize(&mut self, size: [u32; 2]) {
        self.stale |= size != self.swapchain.size;
        self.size = size;
    }

    /// Acquires the next image and waits until the frame's memory is free. Returns false if there is no image at the moment.
    ///
    /// # Errors
    /// A Vulkan error, or [`GpuError::Timeout`].
    pub(crate) fn begin(&mut self) -> Result<bool, GpuError> {
        if self.acquired.is_some() {
            return Ok(true);
        }
        let context = self.context()?.clone();
        self.frames[self.turn].wait(&context)?;
        if self.stale {
            self.remake(&context)?;
        }
        if self.swapchain.size.contains(&0) {
            return Ok(false);
        }
        match self.swapchain.acquire(self.frames[self.turn].free)? {
            Acquired::Image(image) => self.acquired = Some(image),
            Acquired::None => {}
            Acquired::Stale => self.stale = true,
        }
        Ok(self.acquired.is_some())
    }

    fn remake(&mut self, context: &Context) -> Result<(), GpuError> {
        self.idle()?;
        let (Some(device), Some(surface), Some(stage)) =
            (&mut self.device, &self.surface, &mut self.stage)
        else {
            return Err(GpuError::Unfinished);
        };
        let desc = SwapchainDesc {
            size: self.size,
            in_step: self.in_step,
        };
        self.swapchain.remake(context, surface, desc)?;
        // The size is 0 while the window is minimised; it is queried again each time.
        self.stale = self.swapchain.size.contains(&0);
        if !self.stale {
            stage.resize(device.memory()?, self.swapchain.size)?;
        }
        Ok(())
    }

    /// The memory for a crowd's poses of the frame that [`Presenter::begin`] started.
    ///
    /// # Errors
    /// None.
    pub(crate) fn poses(&mut self) -> Result<&mut [F32x16], GpuError> {
        let slot = self.turn as u32;
        let stage = self.stage.as_mut().ok_or(GpuError::Unfinished)?;
        // SAFETY: `begin` has waited for what was recorded into this slot.
        unsafe { stage.poses(slot) }
    }

    /// Draws the frame that [`Presenter::begin`] started.
    ///
    /// # Errors
    /// Those of [`Stage::record`], or a call's.
    pub(crate) fn show(&mut self, scene: &Scene<'_>) -> Result<Outcome, GpuError> {
        let Some(number) = self.acquired else {
            return Ok(Outcome::Skipped);
        };
        let context = self.context()?.clone();
        let image = self.swapchain.image(number);
        let (format, size) = (self.format, self.swapchain.size);
        let (Some(device), Some(overlay)) = (&mut self.device, &mut self.overlay) else {
            return Err(GpuError::Unfinished);
        };
        let queue = device.queue()?;
        if let Some(panels) = scene.panels {
            // SAFETY: the queue is this presenter's, and `begin` has waited for a frame.
            unsafe { overlay.update(&context, queue, &panels.textures) }?;
        }
        let capture = match scene.read && self.swapchain.readable {
            true => {
                let (context, memory) = (&context, device.memory()?);
                let mut device = DeviceMemory { context, memory };
                Some(Capture::new(&mut device, size, format)?)
            }
            false => None,
        };
        let recorded = self.record(image, scene, capture.as_ref());
        let submitted = recorded.and_then(|()| {
            let frame = &mut self.frames[self.turn];
            frame.submit(&context, queue, image.drawn)
        });
        if let Err(error) = submitted {
            if let (Some(mut capture), Some(device)) = (capture, &mut self.device) {
                capture.destroy(&context, device.memory()?);
            }
            return Err(error);
        }
        self.acquired = None;
        self.stale |= !self.swapchain.present(queue, number)?;
        let pixels = match capture {
            Some(capture) => Some(self.read(&context, capture)?),
            None => None,
        };
        self.turn = (self.turn + 1) % FRAMES;
        Ok(Outcome::Shown(pixels))
    }

    fn read(&mut self, context: &Context, capture: Capture) -> Result<Vec<u8>, GpuError> {
        self.frames[self.turn].wait(context)?;
        let device = self.device.as_mut().ok_or(GpuError::Unfinished)?;
        // SAFETY: the frame has been waited for.
        unsafe { capture.take(context, device.memory()?) }
    }

    fn record(
        &mut self,
        image: SwapImage,
        scene: &Scene<'_>,
        capture: Option<&Capture>,
    ) -> Result<(), GpuError> {
        let (Some(device), Some(stage), Some(overlay)) =
            (&self.device, &mut self.stage, &mut self.overlay)
        else {
            return Err(GpuError::Unfinished);
        };
        let (context, frame) = (device.context()?, &self.frames[self.turn]);
        frame.begin(context)?;
        let (cmd, size) = (frame.cmd, self.swapchain.size);
        let whole = Target {
            view: image.view,
            size,
        };
        let picture = Picture {
            shot: scene.shot,
            crowd: scene.crowd,
            target: Target {
                size: [0, 1].map(|axis: usize| scene.size[axis].min(size[axis])),
                ..whole
            },
        };
        let barrier = |before, after| ImageBarrier::colour(image.handle, before, after);
        // SAFETY: the buffer is being recorded; `begin` has waited for the slot and acquired the image, and the submission waits
        // for the image at the stage that the first barrier names.
        unsafe {
            image_barrier(context, cmd, barrier(ACQUIRED, DRAWN));
            stage.record(cmd, self.turn as u32, &picture)?;
            if let Some(panels) = scene.panels {
                image_barrier(context, cmd, barrier(DRAWN, BLENDED));
                begin_panels(context, cmd, &whole);
                overlay.draw(cmd, size, panels)?;
                context.device().cmd_end_rendering(cmd);
            }
            match capture {
                Some(capture) => {
                    image_barrier(context, cmd, barrier(BLENDED, COPIED));
                    capture.record(context, cmd, image.handle);
                    image_barrier(context, cmd, barrier(COPIED, PRESENTED));
                }
                None => image_barrier(context, cmd, barrier(BLENDED, PRESENTED)),
            }
        }
        Ok(())
    }

    fn context(&self) -> Result<&Context, GpuError> {
        self.device.as_ref().ok_or(GpuError::Unfinished)?.context()
    }

    /// Waits until the device is idle.
    fn idle(&mut self) -> Result<(), GpuError> {
        let context = self.context()?.clone();
        // SAFETY: the queue is used by this thread alone.
        let idle = unsafe { context.device().device_wait_idle() };
        sabaki::gpu::internal::Named::call(idle, "vkDeviceWaitIdle")
    }

    /// Destroys the presenter. Returns the validation messages.
    #[must_use = "these are the complaints of validation"]
    pub(crate) fn destroy(mut self) -> Vec<Message> {
        self.teardown()
    }

    fn teardown(&mut self) -> Vec<Message> {
        if let Err(error) = self.idle() {
            tracing::warn!("{error}");
        }
        let Some(mut device) = self.device.take() else {
            return Vec::new();
        };
        if let Ok(context) = device.context().cloned() {
            if let Some(overlay) = self.overlay.take() {
                overlay.destroy(&context);
            }
            if let (Some(stage), Ok(memory)) = (self.stage.take(), device.memory()) {
                stage.destroy(memory);
            }
            for frame in &mut self.frames {
                std::mem::take(frame).destroy(&context);
            }
            std::mem::take(&mut self.swapchain).destroy(&context);
        }
        if let Some(surface) = self.surface.take() {
            surface.destroy();
        }
        device.destroy()
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        if self.device.is_some() {
            tracing::error!("a Presenter was dropped without destroy: its device leaks");
        }
    }
}

fn is_software(context: &Context) -> bool {
    let (instance, device) = (context.instance(), context.physical_device());
    // SAFETY: both are the context's.
    let properties = unsafe { instance.get_physical_device_properties(device) };
    properties.device_type == vk::PhysicalDeviceType::CPU
}

/// Whether the surface is lost, as when the window is gone.
pub(crate) fn is_window_gone(error: &GpuError) -> bool {
    let lost = vk::Result::ERROR_SURFACE_LOST_KHR;
    matches!(error, GpuError::Call { result, .. } if *result == lost)
}
