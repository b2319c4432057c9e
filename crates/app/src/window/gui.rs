//! Panels: egui lays them out, `egui-ash-renderer` draws them over the picture.

use std::sync::{Arc, Mutex};

use ash::vk;
use egui::{Align2, Color32, FontId, RichText, Stroke};
use egui_ash_renderer::{DynamicRendering, Options, Renderer, RendererError};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};
use winit::event::WindowEvent;
use winit::window::Window;

use super::player::{Clock, Times};
use super::{Scene, Seen};
use sabaki::gpu::{Context, GpuError};
use sabaki_draw::{Offscreen, Target};
use sabaki_fixtures::headless::Headless;

/// egui with its window and its renderer.
pub(super) struct Gui {
    context: egui::Context,
    state: egui_winit::State,
    renderer: Renderer,
    device: Context,
    queue: vk::Queue,
    /// Command pool for uploads of textures.
    pool: vk::CommandPool,
    /// Textures that the last picture was the last to show.
    freed: Vec<egui::TextureId>,
}

/// Width of the panel, in points.
pub(super) const PANEL: f32 = 318.0;

/// The keys of every scene.
const KEYS: [(&str, &str); 10] = [
    ("left click", "throw"),
    ("right drag", "turn the camera"),
    ("wheel", "nearer, further"),
    ("space", "pause"),
    (".", "one step"),
    ("s", "slow motion"),
    ("p", "panel"),
    ("h", "this help"),
    ("F12", "screenshot"),
    ("esc", "close"),
];

/// Memory of the renderer is allocated in blocks of this size, in bytes.
const BLOCK: u64 = 8 << 20;

impl Gui {
    pub(super) fn new(window: &Window, device: &Headless) -> Result<Self, GpuError> {
        let (queue, device) = (device.queue()?, device.context()?.clone());
        let context = egui::Context::default();
        context.set_visuals(visuals());
        context.all_styles_mut(|style| {
            style.spacing.item_spacing = egui::vec2(6.0, 4.0);
            style.spacing.slider_width = 130.0;
        });
        let state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            None,
            Some(device.limits().max_image_dimension2_d as usize),
        );
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: device.instance().clone(),
            device: device.device().clone(),
            physical_device: device.physical_device(),
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::new(BLOCK, BLOCK),
        });
        let allocator = Arc::new(Mutex::new(allocator.map_err(failed)?));
        let rendering = DynamicRendering {
            color_attachment_format: Offscreen::FORMAT,
            depth_attachment_format: None,
        };
        let options = Options {
            in_flight_frames: 1,
            srgb_framebuffer: true,
            ..Options::default()
        };
        let renderer =
            Renderer::with_gpu_allocator(allocator, device.device().clone(), rendering, options);
        let renderer = renderer.map_err(failed)?;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.queue_family());
        // SAFETY: the device is valid and has this queue family.
        let pool = unsafe { device.device().create_command_pool(&info, None) };
        Ok(Self {
            context,
            state,
            renderer,
            pool: pool.map_err(failed)?,
            device,
            queue,
            freed: Vec::new(),
        })
    }

    /// Handles an event; returns whether a panel used it.
    pub(super) fn hears(&mut self, window: &Window, event: &WindowEvent) -> bool {
        self.state.on_window_event(window, event).consumed
    }

    /// Pixels per point.
    pub(super) fn scale(&self) -> f32 {
        self.context.pixels_per_point()
    }

    /// Lays out one picture: panel, label and, if it is asked for, the help.
    pub(super) fn layout(
        &mut self,
        window: &Window,
        scene: &mut dyn Scene,
        clock: &mut Clock,
        head: (&str, &Times),
        seen: Seen<'_>,
        help: bool,
    ) -> egui::FullOutput {
        let input = self.state.take_egui_input(window);
        let output = self.context.run(input, |context| {
            let over = egui::LayerId::background();
            scene.label(&context.layer_painter(over), seen);
            egui::SidePanel::right("panel")
                .exact_width(PANEL)
                .resizable(false)
                .show(context, |ui| {
                    add_head(ui, clock, head);
                    egui::ScrollArea::vertical()
                        .auto_shrink(false)
                        .show(ui, |ui| scene.panel(ui));
                });
            if help {
                add_help(context, scene.keys());
            }
        });
        let platform = output.platform_output.clone();
        self.state.handle_platform_output(window, platform);
        output
    }

    /// Uploads the textures of a layout, and frees those that are no longer used. Every picture before must be drawn.
    pub(super) fn upload(&mut self, output: &egui::FullOutput) -> Result<(), GpuError> {
        let textures = &output.textures_delta;
        let freed = std::mem::replace(&mut self.freed, textures.free.clone());
        self.renderer.free_textures(&freed).map_err(failed)?;
        self.renderer
            .set_textures(self.queue, self.pool, &textures.set)
            .map_err(failed)
    }

    /// Records the drawing of a layout over a picture.
    ///
    /// # Safety
    /// `cmd` is being recorded, outside of rendering; the target is a colour attachment of [`Offscreen::FORMAT`].
    pub(super) unsafe fn draw(
        &mut self,
        cmd: vk::CommandBuffer,
        target: &Target,
        output: egui::FullOutput,
    ) -> Result<(), GpuError> {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stages};
        let device = self.device.device();
        let drawn = [vk::MemoryBarrier2::default()
            .src_stage_mask(Stages::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
            .dst_stage_mask(Stages::COLOR_ATTACHMENT_OUTPUT)
            .dst_access_mask(Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE)];
        let barrier = vk::DependencyInfo::default().memory_barriers(&drawn);
        let [width, height] = target.size;
        let extent = vk::Extent2D { width, height };
        let colours = [vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(extent))
            .layer_count(1)
            .color_attachments(&colours);
        let shapes = self
            .context
            .tessellate(output.shapes, output.pixels_per_point);
        // SAFETY: the caller vouches for `cmd` and the target.
        unsafe {
            device.cmd_pipeline_barrier2(cmd, &barrier);
            device.cmd_begin_rendering(cmd, &info);
            let drawn = self
                .renderer
                .cmd_draw(cmd, extent, output.pixels_per_point, &shapes);
            device.cmd_end_rendering(cmd);
            drawn.map_err(failed)
        }
    }

    /// Frees what the renderer has. The device must have drawn every picture.
    pub(super) fn destroy(self) {
        drop(self.renderer);
        // SAFETY: the pool is of this device, which is done with it.
        unsafe { self.device.device().destroy_command_pool(self.pool, None) };
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

/// The panel's head: times, device, and the clock's buttons.
fn add_head(ui: &mut egui::Ui, clock: &mut Clock, (device, times): (&str, &Times)) {
    ui.add_space(4.0);
    let median = times.median();
    let rate = if median > 0.0 { 1e3 / median } else { 0.0 };
    ui.horizontal(|ui| {
        ui.label(RichText::new(format!("{rate:.0} pictures/s")).strong());
        ui.label(format!("{median:.1} ms"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(RichText::new("H: keys").weak());
        });
    });
    ui.label(RichText::new(device).small().weak());
    ui.horizontal(|ui| {
        let word = if clock.paused { "go on" } else { "pause" };
        if ui.button(word).clicked() {
            clock.paused = !clock.paused;
        }
        if ui.button("step").clicked() {
            clock.step();
        }
        let speed = egui::Slider::new(&mut clock.speed, 0.05..=1.0);
        ui.add(speed.text("speed").fixed_decimals(2));
    });
    ui.separator();
}

/// The keys, over the picture.
fn add_help(context: &egui::Context, keys: &[(&str, &str)]) {
    let window = egui::Window::new("Keys")
        .collapsible(false)
        .resizable(false);
    window
        .anchor(Align2::LEFT_TOP, [12.0, 12.0])
        .show(context, |ui| {
            egui::Grid::new("keys").num_columns(2).show(ui, |ui| {
                for (key, what) in KEYS.iter().chain(keys) {
                    ui.label(RichText::new(*key).monospace().strong());
                    ui.label(*what);
                    ui.end_row();
                }
            });
        });
}

fn visuals() -> egui::Visuals {
    let mut visuals = egui::Visuals::dark();
    visuals.panel_fill = Color32::from_rgb(27, 30, 36);
    visuals.window_fill = Color32::from_rgb(27, 30, 36);
    visuals.override_text_color = Some(Color32::from_gray(225));
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(60));
    visuals
}

/// Writes text to the right of a point, dark on light.
pub(super) fn write_beside(painter: &egui::Painter, at: egui::Pos2, text: String, colour: Color32) {
    let halo = Color32::from_rgba_unmultiplied(235, 240, 246, 150);
    let galley = painter.layout_no_wrap(text, FontId::proportional(17.0), colour);
    let size = galley.size();
    let corner = at - egui::vec2(0.0, 0.5 * size.y);
    let around = egui::Rect::from_min_size(corner, size).expand2(egui::vec2(5.0, 2.0));
    painter.rect_filled(around, 4.0, halo);
    painter.galley(corner, galley, colour);
}

/// Writes a line in the upper left corner of the picture.
pub(super) fn write_in_corner(painter: &egui::Painter, text: String, colour: Color32) {
    let at = painter.clip_rect().left_top() + egui::vec2(18.0, 14.0);
    painter.text(
        at,
        Align2::LEFT_TOP,
        text,
        FontId::proportional(22.0),
        colour,
    );
}

/// Draws times as bars, the latest one on the right.
pub(super) fn bars(ui: &mut egui::Ui, times: &Times) {
    let top = times.all().fold(0.0, f32::max);
    let wide = ui.available_width();
    let (rect, _) = ui.allocate_exact_size(egui::vec2(wide, 44.0), egui::Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, Color32::from_gray(18));
    if top <= 0.0 {
        return;
    }
    let step = rect.width() / times.all().len().max(30) as f32;
    for (index, value) in times.all().rev().enumerate() {
        let right = rect.right() - index as f32 * step;
        let low = egui::pos2(right - step.max(1.5) + 1.0, rect.bottom());
        let high = egui::pos2(right, rect.bottom() - (rect.height() - 14.0) * value / top);
        let bar = egui::Rect::from_two_pos(low, high);
        painter.rect_filled(bar, 0.0, Color32::from_rgb(96, 150, 214));
    }
    let text = format!("{top:.1} ms at most");
    let font = FontId::proportional(11.0);
    let corner = rect.left_top() + egui::vec2(4.0, 1.0);
    let grey = Color32::from_gray(190);
    painter.text(corner, Align2::LEFT_TOP, text, font, grey);
}
