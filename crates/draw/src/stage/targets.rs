//! Internal images of a stage: the shadow map, the depth buffer and, with multisampling, the colour
//! samples.

use ash::vk;

use super::StageDesc;
use super::pipelines::DEPTH;
use sabaki::gpu::internal::{DeviceMemory, Image, ImageDesc};
use sabaki::gpu::{Context, GpuError, Memory};

/// Internal images. Handles are null by default.
#[derive(Debug, Default)]
pub(super) struct Targets {
    pub(super) shadow: Image,
    pub(super) depth: Image,
    /// Colour samples, or null for one sample per pixel.
    pub(super) samples: Image,
}

impl Targets {
    pub(super) fn fill_shadow(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
    ) -> Result<(), GpuError> {
        use vk::ImageUsageFlags as Usage;
        let desc = ImageDesc {
            name: &format!("{}: shadow map", desc.name),
            side: [desc.shadow_side.max(1); 2],
            format: DEPTH,
            samples: vk::SampleCountFlags::TYPE_1,
            usage: Usage::DEPTH_STENCIL_ATTACHMENT | Usage::SAMPLED,
            aspect: vk::ImageAspectFlags::DEPTH,
        };
        self.shadow = device.image(&desc)?;
        Ok(())
    }

    /// Creates depth buffer and colour samples of the size of `desc`, and frees the previous ones.
    pub(super) fn resize(
        &mut self,
        device: &mut DeviceMemory<'_>,
        desc: &StageDesc<'_>,
        samples: vk::SampleCountFlags,
    ) -> Result<(), GpuError> {
        use vk::ImageUsageFlags as Usage;
        self.depth.destroy(device.context, device.memory);
        self.samples.destroy(device.context, device.memory);
        let depth = ImageDesc {
            name: &format!("{}: depth", desc.name),
            side: desc.size.map(|side| side.max(1)),
            format: DEPTH,
            samples,
            usage: Usage::DEPTH_STENCIL_ATTACHMENT | Usage::TRANSIENT_ATTACHMENT,
            aspect: vk::ImageAspectFlags::DEPTH,
        };
        self.depth = device.image(&depth)?;
        if samples != vk::SampleCountFlags::TYPE_1 {
            let colour = ImageDesc {
                name: &format!("{}: samples", desc.name),
                format: desc.format,
                usage: Usage::COLOR_ATTACHMENT | Usage::TRANSIENT_ATTACHMENT,
                aspect: vk::ImageAspectFlags::COLOR,
                ..depth
            };
            self.samples = device.image(&colour)?;
        }
        Ok(())
    }

    pub(super) fn destroy(&mut self, context: &Context, memory: &mut dyn Memory) {
        for image in [&mut self.shadow, &mut self.depth, &mut self.samples] {
            image.destroy(context, memory);
        }
    }
}
