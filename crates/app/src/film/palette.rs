//! One palette for all pictures of a film.
//!
//! With one palette and a fixed dither pattern, parts that do not move keep their pixels from picture to picture, so that a GIF
//! need not store them again.

use std::collections::BTreeMap;

use color_quant::NeuQuant;

/// Number of colours. One more index marks pixels that do not change.
pub(super) const COLOURS: usize = 255;

/// Bits of a channel that distinguish colours.
const BITS: u32 = 6;

/// Largest shift of a channel by dithering, in either direction, of 256 steps.
const SHIFT: i32 = 2;

/// Bayer's ordered dither matrix.
const BAYER: [[i32; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

pub(super) struct Palette {
    quantiser: NeuQuant,
    /// Palette index of each colour of [`BITS`] bits per channel that has been looked up.
    known: Vec<u16>,
}

const UNKNOWN: u16 = u16::MAX;

impl Palette {
    /// Fits the palette to a film. A colour counts by the square root of its pixels, so that small areas get colours, too.
    pub(super) fn of(pictures: &[Vec<u8>]) -> Self {
        let mut counts: BTreeMap<[u8; 3], u32> = BTreeMap::new();
        let keep = !((1u8 << (8 - BITS)) - 1);
        let step = (pictures.len() / 24).max(1);
        for picture in pictures.iter().step_by(step) {
            for pixel in picture.chunks_exact(3) {
                let colour = [pixel[0] & keep, pixel[1] & keep, pixel[2] & keep];
                *counts.entry(colour).or_default() += 1;
            }
        }
        let half = 1u8 << (7 - BITS);
        let mut sample = Vec::new();
        for (colour, count) in &counts {
            let [red, green, blue] = colour.map(|channel| channel + half);
            for _ in 0..f64::from(*count).sqrt().ceil() as usize {
                sample.extend([red, green, blue, 255]);
            }
        }
        // The quantiser needs some thousands of pixels to learn from.
        let once = sample.clone();
        while sample.len() < 4 * 4096 && !once.is_empty() {
            sample.extend_from_slice(&once);
        }
        Self {
            quantiser: NeuQuant::new(1, COLOURS, &sample),
            known: vec![UNKNOWN; 1 << (3 * BITS)],
        }
    }

    /// Red, green and blue of each colour.
    pub(super) fn colours(&self) -> Vec<u8> {
        self.quantiser.color_map_rgb()
    }

    /// The palette indices of a picture's pixels.
    pub(super) fn places(&mut self, picture: &[u8], width: usize) -> Vec<u8> {
        let pixels = picture.chunks_exact(3).enumerate();
        let place = |(at, pixel): (usize, &[u8])| {
            let shift = BAYER[at / width % 4][at % width % 4] * 2 * SHIFT / 15 - SHIFT;
            let channel = |index: usize| (i32::from(pixel[index]) + shift).clamp(0, 255) as u32;
            let colour = [channel(0), channel(1), channel(2)];
            self.place(colour)
        };
        pixels.map(place).collect()
    }

    fn place(&mut self, colour: [u32; 3]) -> u8 {
        let drop = 8 - BITS;
        let key = colour
            .iter()
            .fold(0, |key, channel| key << BITS | channel >> drop) as usize;
        if self.known[key] == UNKNOWN {
            let [red, green, blue] =
                colour.map(|channel| ((channel >> drop << drop) + (1 << (drop - 1))) as u8);
            self.known[key] = self.quantiser.index_of(&[red, green, blue, 255]) as u16;
        }
        self.known[key] as u8
    }
}
