//! Lays out panels with egui; the presenter draws them.

use egui::{Align2, Color32, FontId, RichText, Stroke};
use winit::event::WindowEvent;
use winit::window::Window;

use super::View;
use super::times::Times;
use super::view::Projection;
use crate::live::Clock;
use crate::present::GuiOutput;

/// The layout of one picture.
pub(super) struct GuiFrame<'a> {
    pub(super) view: &'a mut dyn View,
    pub(super) clock: &'a mut Clock,
    pub(super) times: &'a Times,
    pub(super) device: &'a str,
    pub(super) help: bool,
    pub(super) seen: Projection,
}

/// egui with its window.
pub(super) struct Gui {
    context: egui::Context,
    state: egui_winit::State,
}

/// Width of the panel, in points.
pub(super) const PANEL: f32 = 318.0;

/// The keys of every view.
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

impl Gui {
    pub(super) fn new(window: &Window, most_side: u32) -> Self {
        let context = egui::Context::default();
        context.set_visuals(visuals());
        context.all_styles_mut(|style| {
            style.spacing.item_spacing = egui::vec2(6.0, 4.0);
            style.spacing.slider_width = 130.0;
        });
        let scale = window.scale_factor() as f32;
        let state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(scale),
            None,
            Some(most_side as usize),
        );
        Self { context, state }
    }

    /// Handles an event; returns whether a panel used it.
    pub(super) fn hears(&mut self, window: &Window, event: &WindowEvent) -> bool {
        self.state.on_window_event(window, event).consumed
    }

    /// Pixels per point.
    pub(super) fn scale(&self) -> f32 {
        self.context.pixels_per_point()
    }

    pub(super) fn layout(&mut self, window: &Window, mut frame: GuiFrame<'_>) -> GuiOutput {
        let input = self.state.take_egui_input(window);
        let output = self.context.run(input, |context| frame.layout(context));
        self.state
            .handle_platform_output(window, output.platform_output);
        GuiOutput {
            primitives: self
                .context
                .tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
        }
    }
}

impl GuiFrame<'_> {
    fn layout(&mut self, context: &egui::Context) {
        let over = egui::LayerId::background();
        self.view.label(&context.layer_painter(over), &self.seen);
        egui::SidePanel::right("panel")
            .exact_width(PANEL)
            .resizable(false)
            .show(context, |ui| {
                self.head(ui);
                egui::ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| self.view.panel(ui, self.clock));
            });
        if self.help {
            self.help(context);
        }
    }

    fn head(&mut self, ui: &mut egui::Ui) {
        ui.add_space(4.0);
        let median = self.times.median();
        let rate = if median > 0.0 { 1e3 / median } else { 0.0 };
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("{rate:.0} pictures/s")).strong());
            ui.label(format!("{median:.1} ms"));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.label(RichText::new("H: keys").weak());
            });
        });
        ui.label(RichText::new(self.device).small().weak());
        ui.horizontal(|ui| {
            let word = if self.clock.paused { "go on" } else { "pause" };
            if ui.button(word).clicked() {
                self.clock.paused = !self.clock.paused;
            }
            if ui.button("step").clicked() {
                self.clock.step();
            }
            let speed = egui::Slider::new(&mut self.clock.speed, 0.05..=1.0);
            ui.add(speed.text("speed").fixed_decimals(2));
        });
        ui.separator();
    }

    fn help(&self, context: &egui::Context) {
        let window = egui::Window::new("Keys")
            .collapsible(false)
            .resizable(false);
        window
            .anchor(Align2::LEFT_TOP, [12.0, 12.0])
            .show(context, |ui| {
                egui::Grid::new("keys").num_columns(2).show(ui, |ui| {
                    for (key, what) in KEYS.iter().chain(self.view.keys()) {
                        ui.label(RichText::new(*key).monospace().strong());
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            });
    }
}

fn visuals() -> egui::Visuals {
    let mut visuals = egui::Visuals::dark();
    visuals.panel_fill = Color32::from_rgb(27, 30, 36);
    visuals.window_fill = Color32::from_rgb(27, 30, 36);
    visuals.override_text_color = Some(Color32::from_gray(225));
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(60));
    visuals
}

/// Text over the picture, dark on light.
pub(super) struct Label {
    pub(super) text: String,
    pub(super) colour: Color32,
}

impl Label {
    /// Draws it to the right of a point.
    pub(super) fn paint(self, painter: &egui::Painter, at: egui::Pos2) {
        let font = FontId::proportional(17.0);
        let halo = Color32::from_rgba_unmultiplied(235, 240, 246, 150);
        let galley = painter.layout_no_wrap(self.text, font, self.colour);
        let size = galley.size();
        let corner = at - egui::vec2(0.0, 0.5 * size.y);
        let around = egui::Rect::from_min_size(corner, size).expand2(egui::vec2(5.0, 2.0));
        painter.rect_filled(around, 4.0, halo);
        painter.galley(corner, galley, self.colour);
    }
}

/// Draws values as bars, the latest one on the right.
pub(super) fn bars(ui: &mut egui::Ui, values: impl ExactSizeIterator<Item = f32>, unit: &str) {
    let values: Vec<f32> = values.collect();
    let top = values.iter().copied().fold(0.0, f32::max);
    let wide = ui.available_width();
    let (rect, _) = ui.allocate_exact_size(egui::vec2(wide, 44.0), egui::Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, Color32::from_gray(18));
    if top <= 0.0 {
        return;
    }
    let step = rect.width() / values.len().max(30) as f32;
    for (index, value) in values.iter().rev().enumerate() {
        let right = rect.right() - index as f32 * step;
        let low = egui::pos2(right - step.max(1.5) + 1.0, rect.bottom());
        let high = egui::pos2(right, rect.bottom() - (rect.height() - 14.0) * value / top);
        let bar = egui::Rect::from_two_pos(low, high);
        painter.rect_filled(bar, 0.0, Color32::from_rgb(96, 150, 214));
    }
    let text = format!("{top:.1} {unit} at most");
    let font = FontId::proportional(11.0);
    let corner = rect.left_top() + egui::vec2(4.0, 1.0);
    painter.text(
        corner,
        Align2::LEFT_TOP,
        text,
        font,
        Color32::from_gray(190),
    );
}
