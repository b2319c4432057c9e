//! Pictures of rectangles, lines and letters, as PNG files.

use std::io::Write;
use std::path::Path;

use font8x8::UnicodeFonts;
use sabaki::archive;

use super::Failure;

/// Of the rules across a chart.
pub(crate) const RULE: [u8; 3] = [60, 64, 72];
/// Of the lines of a chart, one after the other.
pub(crate) const COLOURS: [[u8; 3]; 5] = [
    [225, 80, 70],
    [92, 190, 110],
    [90, 140, 235],
    [250, 205, 70],
    [200, 120, 220],
];
const BACKGROUND: [u8; 3] = [24, 26, 30];
const INK: [u8; 3] = [220, 222, 226];

/// How letters look.
#[derive(Clone, Copy)]
pub(crate) struct Letters {
    /// Pixels of a dot's side; a letter has 8 by 8 dots.
    pub(crate) zoom: usize,
    pub(crate) colour: [u8; 3],
}

pub(crate) struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    /// A dark one.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            pixels: BACKGROUND.repeat(width * height),
        }
    }

    /// Of pixels that are there: four bytes each, the last of which is left out.
    pub(crate) fn of_pixels([width, height]: [u32; 2], pixels: &[u8]) -> Self {
        Self {
            width: width as usize,
            height: height as usize,
            pixels: pixels
                .chunks_exact(4)
                .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
                .collect(),
        }
    }

    /// Three bytes of each pixel, row by row.
    pub(crate) fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// Puts another picture into this one, as far as it lies in it.
    pub(crate) fn place(&mut self, (x, y): (usize, usize), other: &Self) {
        let columns = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let (to, from) = (3 * ((y + row) * self.width + x), 3 * row * other.width);
            self.pixels[to..to + 3 * columns]
                .copy_from_slice(&other.pixels[from..from + 3 * columns]);
        }
    }

    /// Fills a rectangle as far as it lies in the picture.
    pub(crate) fn fill(
        &mut self,
        (x, y): (usize, usize),
        (width, height): (usize, usize),
        colour: [u8; 3],
    ) {
        for row in y..(y + height).min(self.height) {
            for column in x..(x + width).min(self.width) {
                let start = 3 * (row * self.width + column);
                self.pixels[start..start + 3].copy_from_slice(&colour);
            }
        }
    }

    /// Writes in letters of 8 by 8 pixels; what the font does not have is left out.
    pub(crate) fn text(&mut self, x: usize, y: usize, text: &str) {
        self.text_in(
            (x, y),
            text,
            Letters {
                zoom: 1,
                colour: INK,
            },
        );
    }

    /// Writes in letters of a size and a colour.
    pub(crate) fn text_in(&mut self, (x, y): (usize, usize), text: &str, letters: Letters) {
        let Letters { zoom, colour } = letters;
        for (index, letter) in text.chars().enumerate() {
            let Some(rows) = font8x8::BASIC_FONTS.get(letter) else {
                continue;
            };
            for (row, bits) in rows.iter().enumerate() {
                for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                    let at = (x + zoom * (index * 8 + column), y + zoom * row);
                    self.fill(at, (zoom, zoom), colour);
                }
            }
        }
    }

    /// The bytes of a PNG file.
    fn encode(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        bytes.flush()?;
        Ok(bytes)
    }

    /// Draws a straight line, two pixels thick.
    pub(crate) fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: [u8; 3]) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let steps = dx.abs().max(dy.abs()).ceil().max(1.0) as usize;
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let (x, y) = (from.0 + dx * share, from.1 + dy * share);
            if x >= 0.0 && y >= 0.0 {
                self.fill((x as usize, y as usize), (2, 2), colour);
            }
        }
    }

    /// Writes the PNG file.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let failed = |source| Failure::Write {
            path: path.to_owned(),
            source,
        };
        let bytes = self
            .encode()
            .map_err(|error| failed(std::io::Error::other(error)))?;
        archive::write_atomically(path, |file| file.write_all(&bytes)).map_err(failed)
    }
}
