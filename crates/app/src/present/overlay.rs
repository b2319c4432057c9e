//! Draws egui's panels over the picture, by `egui-ash-renderer`.

use std::sync::{Arc, Mutex};

use ash::vk;
use egui_ash_renderer::{DynamicRendering, Options, Renderer, RendererError};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};

use sabaki::gpu::{Context, GpuError};

/// egui's output of one frame.
#[derive(Default)]
pub(crate) struct GuiOutput {
    pub(crate) textures: egui::TexturesDelta,
    pub(crate) primitives: Vec<egui::ClippedPrimitive>,
    pub(crate) pixels_per_point: f32,
}

/// Draws panels.
pub(super) struct Overlay {
    renderer: Renderer,
    /// Command pool for uploads.
    pool: vk::CommandPool,
    /// Textures to free once no frame in flight reads them, with the number of frames since their release.
    freed: Vec<(egui::TextureId, usize)>,
    frames: usize,
}

/// Size of a block of memory, in bytes.
const BLOCK: u64 = 8 << 20;

impl Overlay {
    pub(super) fn new(
        context: &Context,
        format: vk::Format,
        frames: usize,
    ) -> Result<Self, GpuError> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: context.instance().clone(),
            device: context.device().clone(),
            physical_device: context.physical_device(),
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::new(BLOCK, BLOCK),
        });
        let allocator = allocator.map_err(failed)?;
        let rendering = DynamicRendering {
            color_attachment_format: format,
            depth_attachment_format: None,
        };
        let options = Options {
            in_flight_frames: frames,
            srgb_framebuffer: matches!(
                format,
                vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB
            ),
            ..Options::default()
        };
        let allocator = Arc::new(Mutex::new(allocator));
        let device = context.device().clone();
        let renderer =
            Renderer::with_gpu_allocator(allocator, device, rendering, options).map_err(failed)?;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(context.queue_family());
        // SAFETY: the device is valid and has this queue family.
        let pool = unsafe { context.device().create_command_pool(&info, None) };
        Ok(Self {
            renderer,
            pool: pool.map_err(failed)?,
            freed: Vec::new(),
            frames,
        })
    }

    /// Uploads new textures and frees those that no frame reads any more. Waits for the device if there are new ones,
    /// which happens when panels open.
    ///
    /// # Safety
    /// The queue is of the context's family and used by this thread alone; one frame more has finished since the last call.
    pub(super) unsafe fn update(
        &mut self,
        context: &Context,
        queue: vk::Queue,
        textures: &egui::TexturesDelta,
    ) -> Result<(), GpuError> {
        let frames = self.frames;
        self.freed.iter_mut().for_each(|(_, age)| *age += 1);
        let old = |(_, age): &(egui::TextureId, usize)| *age > frames;
        let gone: Vec<_> = self
            .freed
            .iter()
            .filter(|one| old(one))
            .map(|(id, _)| *id)
            .collect();
        self.freed.retain(|one| !old(one));
        self.renderer.free_textures(&gone).map_err(failed)?;
        self.freed.extend(textures.free.iter().map(|id| (*id, 0)));
        if textures.set.is_empty() {
            return Ok(());
        }
        // SAFETY: the caller vouches for the queue.
        let idle = unsafe { context.device().queue_wait_idle(queue) };
        idle.map_err(failed)?;
        self.renderer
            .set_textures(queue, self.pool, &textures.set)
            .map_err(failed)
    }

    /// Records the drawing of the panels; called inside of a rendering pass.
    pub(super) fn draw(
        &mut self,
        cmd: vk::CommandBuffer,
        [width, height]: [u32; 2],
        output: &GuiOutput,
    ) -> Result<(), GpuError> {
        let extent = vk::Extent2D { width, height };
        self.renderer
            .cmd_draw(cmd, extent, output.pixels_per_point, &output.primitives)
            .map_err(failed)
    }

    /// The device is idle.
    pub(super) fn destroy(self, context: &Context) {
        drop(self.renderer);
        // SAFETY: the pool is of this device, which is done with it.
        unsafe { context.device().destroy_command_pool(self.pool, None) };
    }
}

fn failed(error: impl Into<RendererError>) -> GpuError {
    match error.into() {
        RendererError::Vulkan(result) => GpuError::Call {
            call: "drawing of panels",
            result,
        },
        other => GpuError::Memory {
            name: "panels".to_owned(),
            reason: other.to_string(),
        },
    }
}
