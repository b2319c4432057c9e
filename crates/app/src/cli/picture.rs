//! Pictures in memory, with lines and text drawn by plotters, and as PNG files.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Once;

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use sabaki::archive;
use sabaki_app::film::png;

use super::canvas::Canvas;

/// The colour of text and axes.
pub(crate) const INK: RGBColor = RGBColor(38, 44, 56);

/// The name under which the embedded font is registered; an SVG names it, too.
pub(crate) const FONT: &str = "sans-serif";

/// Pixels of a picture: red, green and blue (sRGB), row by row from the upper left.
pub(crate) struct Picture {
    size: [u32; 2],
    pixels: Vec<u8>,
}

/// Size and colour of a line of text.
#[derive(Clone, Copy)]
pub(crate) struct TextLook {
    /// Height of a line, in pixels.
    pub(crate) height: u32,
    pub(crate) colour: RGBColor,
}

/// Makes the embedded font known to plotters. No font of the system is read.
pub(crate) fn embed_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        if register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT).is_err() {
            tracing::error!("the embedded font cannot be read");
        }
    });
}

impl Picture {
    /// A white picture.
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let count = size[0] as usize * size[1] as usize;
        Self {
            size,
            pixels: vec![255; 3 * count],
        }
    }

    /// A picture from pixels of four bytes, the last of which is dropped.
    pub(crate) fn from_rgba(size: [u32; 2], pixels: &[u8]) -> Self {
        let rgb = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2]];
        Self {
            size,
            pixels: pixels.chunks_exact(4).flat_map(rgb).collect(),
        }
    }

    /// A picture from pixels of three bytes.
    pub(crate) fn from_rgb(size: [u32; 2], pixels: Vec<u8>) -> Self {
        Self { size, pixels }
    }

    pub(crate) fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// What plotters draws into. The embedded font is registered.
    pub(crate) fn canvas(&mut self) -> Canvas<'_> {
        embed_font();
        Canvas(BitMapBackend::with_buffer(
            &mut self.pixels,
            (self.size[0], self.size[1]),
        ))
    }

    /// Copies another picture into this one. What would lie outside is cut off.
    pub(crate) fn place(&mut self, [x, y]: [u32; 2], other: &Self) {
        let columns = other.size[0].min(self.size[0].saturating_sub(x)) as usize;
        let rows = other.size[1].min(self.size[1].saturating_sub(y));
        for row in 0..rows {
            let to = 3 * ((y + row) * self.size[0] + x) as usize;
            let from = 3 * (row * other.size[0]) as usize;
            self.pixels[to..to + 3 * columns]
                .copy_from_slice(&other.pixels[from..from + 3 * columns]);
        }
    }

    /// Writes a line of text; the place is its upper left corner.
    pub(crate) fn text(&mut self, at: (i32, i32), text: &str, look: TextLook) {
        // Before the style, which looks the font up.
        embed_font();
        let style = (FONT, look.height).into_font().color(&look.colour);
        // A bitmap in memory has no errors.
        let _ = self.canvas().draw_text(text, &style, at);
    }

    /// Draws a straight line, two pixels wide.
    pub(crate) fn line(&mut self, from: (i32, i32), to: (i32, i32), colour: RGBColor) {
        let _ = self.canvas().draw_line(from, to, &colour.stroke_width(2));
    }

    /// Fills a rectangle, with a thin border.
    pub(crate) fn swatch(&mut self, from: (i32, i32), to: (i32, i32), colour: RGBColor) {
        let mut canvas = self.canvas();
        let _ = canvas.draw_rect(from, to, &colour, true);
        let _ = canvas.draw_rect(from, to, &INK, false);
    }

    /// Writes the picture as a PNG file.
    pub(crate) fn write(&self, path: &Path) -> io::Result<()> {
        let bytes = png(self.size, &self.pixels).map_err(io::Error::other)?;
        archive::write_atomically(path, |file| file.write_all(&bytes))
    }
}
