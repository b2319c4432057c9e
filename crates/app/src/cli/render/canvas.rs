//! The device and the painter that draw pictures.

use sabaki::gpu::GpuError;
use sabaki::math::F32x16;
use sabaki_app::Painter;
use sabaki_draw::StageDesc;
use sabaki_draw::scene::{CrowdShot, Shot};
use sabaki_fixtures::headless::{DeviceChoice, Headless, HeadlessDesc};

use crate::cli::Failure;
use crate::cli::culling::DeviceArgs;
use crate::cli::picture::Picture;

pub(super) struct Canvas {
    // `None` only while the canvas is dropped.
    parts: Option<(Headless, Painter)>,
    size: [u32; 2],
}

impl Canvas {
    pub(super) fn new(
        args: &DeviceArgs,
        size: [u32; 2],
        desc: &StageDesc<'_>,
    ) -> Result<Self, Failure> {
        let device = args.device.clone();
        let desc_of_device = HeadlessDesc {
            device: device.map_or(DeviceChoice::Best, DeviceChoice::Named),
            validation: args.validation,
            ..HeadlessDesc::default()
        };
        let mut device = Headless::new(&desc_of_device).map_err(failed)?;
        match Painter::new(&mut device, size, desc) {
            Ok(painter) => Ok(Self {
                parts: Some((device, painter)),
                size,
            }),
            Err(error) => {
                report(device);
                Err(failed(error))
            }
        }
    }

    /// The memory for a crowd's poses.
    pub(super) fn poses(&mut self) -> Result<&mut [F32x16], Failure> {
        let (_, painter) = self.parts.as_mut().ok_or_else(gone)?;
        painter.poses().map_err(failed)
    }

    pub(super) fn paint(
        &mut self,
        shot: &Shot,
        crowd: Option<&CrowdShot>,
    ) -> Result<Picture, Failure> {
        let (device, painter) = self.parts.as_mut().ok_or_else(gone)?;
        let pixels = painter.paint(device, shot, crowd).map_err(failed)?;
        Ok(Picture::from_rgba(self.size, &pixels))
    }
}

impl Drop for Canvas {
    fn drop(&mut self) {
        let Some((mut device, painter)) = self.parts.take() else {
            return;
        };
        if let Err(error) = painter.destroy(&mut device) {
            tracing::error!("{error}");
        }
        report(device);
    }
}

fn report(device: Headless) {
    for message in device.destroy() {
        eprintln!("validation: {message:?}");
    }
}

fn failed(error: GpuError) -> Failure {
    Failure::Device(format!("no picture can be drawn: {error}"))
}

fn gone() -> Failure {
    failed(GpuError::Unfinished)
}
