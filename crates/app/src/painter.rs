//! Draws shots to pixels on a headless device.

use sabaki::gpu::GpuError;
use sabaki::math::F32x16;
use sabaki_draw::scene::{CrowdShot, Shot};
use sabaki_draw::{Offscreen, Picture, Stage, StageDesc};
use sabaki_fixtures::headless::Headless;

/// A stage and an offscreen target of one size.
#[derive(Debug)]
pub struct Painter {
    stage: Stage,
    target: Offscreen,
    size: [u32; 2],
}

impl Painter {
    /// Creates both on the device. The painter sets format, size and frames in flight of `desc`.
    ///
    /// # Errors
    /// [`Stage::new`]'s and [`Offscreen::new`]'s.
    pub fn new(
        device: &mut Headless,
        size: [u32; 2],
        desc: &StageDesc<'_>,
    ) -> Result<Self, GpuError> {
        let desc = StageDesc {
            format: Offscreen::FORMAT,
            size,
            frames_in_flight: 1,
            ..*desc
        };
        let stage = device.make(|context, memory| Stage::new(context, memory, &desc))?;
        match device.make(|context, memory| Offscreen::new(context, memory, size)) {
            Ok(target) => Ok(Self {
                stage,
                target,
                size,
            }),
            Err(error) => {
                stage.destroy(device.memory()?);
                Err(error)
            }
        }
    }

    /// Size of a picture, in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The memory for the crowd's poses of the next picture.
    ///
    /// # Errors
    /// None.
    pub fn poses(&mut self) -> Result<&mut [F32x16], GpuError> {
        // SAFETY: `paint` waits for each picture.
        unsafe { self.stage.poses(0) }
    }

    /// Draws a picture and waits for it. Returns four bytes per pixel, row by row from the upper left.
    ///
    /// # Errors
    /// [`Stage::record`]'s, or those of [`Headless::run`].
    pub fn paint(
        &mut self,
        device: &mut Headless,
        shot: &Shot,
        crowd: Option<&CrowdShot>,
    ) -> Result<Vec<u8>, GpuError> {
        let (stage, target) = (&mut self.stage, &self.target);
        let picture = Picture {
            shot,
            crowd,
            target: target.target(),
        };
        // SAFETY: `run` gives a buffer that is being recorded, and has waited for the one before.
        device.run(|cmd| unsafe {
            target.record_start(cmd);
            stage.record(cmd, 0, &picture)?;
            target.record_end(cmd);
            Ok(())
        })?;
        // SAFETY: `run` has waited.
        unsafe { target.pixels() }.map(<[u8]>::to_vec)
    }

    /// Frees everything.
    ///
    /// # Errors
    /// None while the device lives.
    pub fn destroy(self, device: &mut Headless) -> Result<(), GpuError> {
        let memory = device.memory()?;
        self.stage.destroy(memory);
        self.target.destroy(memory);
        Ok(())
    }
}
