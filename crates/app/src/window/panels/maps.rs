//! Small pictures of the maps of the last throw.

use egui::{Color32, ColorImage, RichText, TextureHandle, TextureOptions};

use crate::live::Throw;
use sabaki::maps::{BitMap, MapRect};
use sabaki_draw::scene::SlabPicture;

/// Pictures of the slabs that the ball passed through.
#[derive(Default)]
pub(in crate::window) struct Thumbnails {
    of: u32,
    slabs: Vec<(f32, TextureHandle)>,
}

/// Largest side of a picture, in points.
const SIDE: f32 = 92.0;
const BODY: [u8; 3] = [70, 190, 95];
const EVASION: [u8; 3] = [75, 120, 235];
const ATTACK: [u8; 3] = [225, 60, 45];
const BOTH: [u8; 3] = [250, 215, 70];

impl Thumbnails {
    /// The maps of `last` at the moment when the ball is nearest.
    pub(in crate::window) fn show(&mut self, ui: &mut egui::Ui, last: Option<&Throw<'_>>) {
        let Some(last) = last else {
            ui.label(RichText::new("nothing was thrown yet").weak());
            return;
        };
        if self.of != last.number {
            self.of = last.number;
            let slabs = last.dodge.slabs(last.dodge.clearance().time);
            self.slabs = slabs
                .iter()
                .rev()
                .map(|slab| (slab.height, texture(ui.ctx(), slab)))
                .collect();
        }
        if self.slabs.is_empty() {
            ui.label(RichText::new("the answer only moves: it has no maps").weak());
        }
        ui.horizontal_wrapped(|ui| {
            for (height, texture) in &self.slabs {
                ui.vertical(|ui| {
                    let size = texture.size_vec2();
                    let scale = SIDE / size.max_elem().max(1.0);
                    ui.image((texture.id(), size * scale));
                    ui.label(RichText::new(format!("{height:.2} m")).small());
                });
            }
        });
    }
}

fn texture(context: &egui::Context, slab: &SlabPicture) -> TextureHandle {
    let all = [&slab.body, &slab.evasion];
    // The attack starts far away; only its part near the body is shown.
    let rect = all
        .iter()
        .fold(MapRect::default(), |rect, map| rect.union(map.rect()));
    let rect = match rect.is_empty() {
        true => slab.attack.rect(),
        false => grown(rect, 8),
    };
    let at = |map: &BitMap, column: i32, row: i32| {
        let own = map.rect();
        map.get(column + rect.u - own.u, row + rect.v - own.v)
    };
    let (width, height) = (rect.width as i32, rect.height as i32);
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let colour = |(column, row): (i32, i32)| {
        let body = at(&slab.body, column, row);
        let [red, green, blue] = match (at(&slab.attack, column, row), body) {
            (true, true) => BOTH,
            (true, false) => ATTACK,
            (false, true) => BODY,
            _ if at(&slab.evasion, column, row) => EVASION,
            _ => [44, 48, 56],
        };
        Color32::from_rgb(red, green, blue)
    };
    let image = ColorImage::new(
        [rect.width as usize, rect.height as usize],
        pixels.map(colour).collect(),
    );
    context.load_texture("slab", image, TextureOptions::NEAREST)
}

/// Enlarges a rectangle by texels on each side.
fn grown(rect: MapRect, texels: i32) -> MapRect {
    let more = 2 * texels.unsigned_abs();
    MapRect {
        u: rect.u - texels,
        v: rect.v - texels,
        width: rect.width + more,
        height: rect.height + more,
    }
}
