//! Draws shots to pixels on a headless device.

use sabaki::gpu::ash::vk;
use sabaki::gpu::{Context, GpuError};
use sabaki::math::F32x16;
use sabaki_draw::scene::{CrowdShot, Shot};
use sabaki_draw::{Offscreen, Picture, Stage, StageDesc, Target};
use sabaki_fixtures::headless::{Headless, Message};

/// A device with a stage and an offscreen target of one size.
#[derive(Debug)]
pub struct Painter {
    /// The device.
    pub device: Headless,
    // `None` once they are destroyed.
    parts: Option<(Stage, Offscreen)>,
    size: [u32; 2],
}

impl Painter {
    /// Creates both on the device. The painter sets format, size and frames in flight of `desc`; 0 samples are 1 on a software device,
    /// else the default.
    ///
    /// # Errors
    /// [`Stage::new`]'s and [`Offscreen::new`]'s.
    pub fn new(device: Headless, size: [u32; 2], desc: &StageDesc<'_>) -> Result<Self, GpuError> {
        let mut painter = Self {
            device,
            parts: None,
            size,
        };
        let device = &mut painter.device;
        let samples = match desc.samples {
            0 if is_software(device.context()?) => 1,
            0 => StageDesc::default().samples,
            samples => samples,
        };
        let desc = StageDesc {
            format: Offscreen::FORMAT,
            size,
            samples,
            frames_in_flight: 1,
            ..*desc
        };
        let stage = device.make(|context, memory| Stage::new(context, memory, &desc))?;
        match device.make(|context, memory| Offscreen::new(context, memory, size)) {
            Ok(target) => painter.parts = Some((stage, target)),
            Err(error) => {
                stage.destroy(device.memory()?);
                return Err(error);
            }
        }
        Ok(painter)
    }

    /// Size of a picture, in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Changes the size of the pictures, in pixels.
    ///
    /// # Errors
    /// [`Stage::resize`]'s and [`Offscreen::new`]'s. After an error, `resize` can be called again.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), GpuError> {
        let device = &mut self.device;
        let target = device.make(|context, memory| Offscreen::new(context, memory, size))?;
        let memory = device.memory()?;
        let (stage, old) = self.parts.as_mut().ok_or(GpuError::Unfinished)?;
        std::mem::replace(old, target).destroy(memory);
        self.size = size;
        stage.resize(memory, size)
    }

    /// The memory for the crowd's poses of the next picture.
    ///
    /// # Errors
    /// None until it is closed.
    pub fn poses(&mut self) -> Result<&mut [F32x16], GpuError> {
        let (stage, _) = self.parts.as_mut().ok_or(GpuError::Unfinished)?;
        // SAFETY: each picture is waited for.
        unsafe { stage.poses(0) }
    }

    /// Draws a picture and waits for it. Returns four bytes per pixel, row by row from the upper left.
    ///
    /// # Errors
    /// [`Stage::record`]'s, or those of [`Headless::run`].
    pub fn paint(&mut self, shot: &Shot, crowd: Option<&CrowdShot>) -> Result<Vec<u8>, GpuError> {
        self.paint_over(self.size, shot, crowd, |_, _| Ok(()))
    }

    /// Draws a picture of `size` pixels in the upper left corner. Then `over` records what is drawn over it: it gets a command buffer outside
    /// of rendering, and the whole target, which stays a colour attachment. Returns the pixels of the whole target.
    ///
    /// # Errors
    /// As for [`Painter::paint`], and those of `over`.
    pub fn paint_over(
        &mut self,
        size: [u32; 2],
        shot: &Shot,
        crowd: Option<&CrowdShot>,
        over: impl FnOnce(vk::CommandBuffer, Target) -> Result<(), GpuError>,
    ) -> Result<Vec<u8>, GpuError> {
        let (stage, target) = self.parts.as_mut().ok_or(GpuError::Unfinished)?;
        let size = [0, 1].map(|axis: usize| size[axis].min(self.size[axis]));
        let whole = target.target();
        let picture = Picture {
            shot,
            crowd,
            target: Target { size, ..whole },
        };
        // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
        self.device.run(|cmd| unsafe {
            target.record_start(cmd);
            stage.record(cmd, 0, &picture)?;
            over(cmd, whole)?;
            target.record_end(cmd);
            Ok(())
        })?;
        // SAFETY: `run` has waited.
        unsafe { target.pixels() }.map(<[u8]>::to_vec)
    }

    /// Destroys everything, the device too. Returns the validation messages.
    pub fn close(&mut self) -> Vec<Message> {
        if let (Some((stage, target)), Ok(memory)) = (self.parts.take(), self.device.memory()) {
            stage.destroy(memory);
            target.destroy(memory);
        }
        self.device.close()
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        for message in self.close() {
            tracing::warn!("validation: {message:?}");
        }
    }
}

fn is_software(context: &Context) -> bool {
    let (instance, device) = (context.instance(), context.physical_device());
    // SAFETY: both are the context's.
    let properties = unsafe { instance.get_physical_device_properties(device) };
    properties.device_type == vk::PhysicalDeviceType::CPU
}
