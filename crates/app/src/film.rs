//! Films as animated GIF or APNG, and pictures as PNG.
//!
//! A GIF has one palette and a fixed dither pattern for all pictures, so that parts that do not move keep their pixels from picture to
//! picture and need not be stored again.

use std::collections::BTreeMap;

use ::gif::{DisposalMethod, Frame, Repeat};
use ::png::{BitDepth, BlendOp, ColorType, Compression, DisposeOp, Encoder};
use color_quant::NeuQuant;
use thiserror::Error;

/// A sequence of pictures of one size.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Film {
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// Time that each picture is shown, in seconds, 2 at most.
    pub delay: f64,
    /// Pixels of each picture: red, green and blue (sRGB), row by row from the upper left.
    pub pictures: Vec<Vec<u8>>,
}

/// Why a film could not be encoded.
#[derive(Debug, Error)]
pub enum FilmError {
    /// The film has no pictures.
    #[error("a film needs a picture")]
    Empty,
    /// A picture has another size than the film.
    #[error("picture {index} has {found} bytes, not {wanted}")]
    Size {
        /// Index of the picture.
        index: usize,
        /// Number of bytes that it has.
        found: usize,
        /// Number of bytes that it should have.
        wanted: usize,
    },
    /// The width or height is 0, or above the format's limit.
    #[error("{0} by {1} pixels are no picture")]
    Side(u32, u32),
    /// An error of the PNG encoder.
    #[error(transparent)]
    Png(#[from] ::png::EncodingError),
    /// An error of the GIF encoder.
    #[error(transparent)]
    Gif(#[from] ::gif::EncodingError),
}

impl Film {
    /// Encodes an animated GIF that repeats for ever. Equal films give equal bytes.
    ///
    /// # Errors
    /// The film has no pictures, or pictures of another size.
    pub fn gif(&self) -> Result<Vec<u8>, FilmError> {
        self.check()?;
        let [width, height] = self.size.map(|side| side as u16);
        encode_gif([width, height], self.delay, &self.pictures)
    }

    /// Encodes an animated PNG that repeats for ever, without loss.
    ///
    /// # Errors
    /// The film has no pictures, or pictures of another size.
    pub fn apng(&self) -> Result<Vec<u8>, FilmError> {
        self.check()?;
        /// Parts of a second in which an APNG counts here.
        const PARTS: u16 = 30_000;
        let mut bytes = Vec::new();
        let mut encoder = png_encoder(&mut bytes, self.size);
        encoder.set_animated(self.pictures.len() as u32, 0)?;
        let parts = (self.delay * f64::from(PARTS)).round();
        encoder.set_frame_delay(parts as u16, PARTS)?;
        encoder.set_blend_op(BlendOp::Source)?;
        encoder.set_dispose_op(DisposeOp::None)?;
        let mut writer = encoder.write_header()?;
        for picture in &self.pictures {
            writer.write_image_data(picture)?;
        }
        writer.finish()?;
        Ok(bytes)
    }

    fn check(&self) -> Result<(), FilmError> {
        let [width, height] = self.size;
        let most = u32::from(u16::MAX);
        if width == 0 || height == 0 || width > most || height > most {
            return Err(FilmError::Side(width, height));
        }
        let wanted = 3 * width as usize * height as usize;
        let wrong = |picture: &Vec<u8>| picture.len() != wanted;
        match self.pictures.iter().position(wrong) {
            _ if self.pictures.is_empty() => Err(FilmError::Empty),
            Some(index) => Err(FilmError::Size {
                index,
                found: self.pictures[index].len(),
                wanted,
            }),
            None => Ok(()),
        }
    }
}

/// Encodes a PNG file. `pixels`: red, green and blue (sRGB), row by row from the upper left.
///
/// # Errors
/// The encoder's errors: the number of pixels must match the size.
pub fn png(size: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>, FilmError> {
    let mut bytes = Vec::new();
    let mut writer = png_encoder(&mut bytes, size).write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

fn png_encoder(bytes: &mut Vec<u8>, [width, height]: [u32; 2]) -> Encoder<'static, &mut Vec<u8>> {
    let mut encoder = Encoder::new(bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder
}

/// Stores of each picture only the rectangle with changes, and in it only the pixels that change.
fn encode_gif(size: [u16; 2], delay: f64, pictures: &[Vec<u8>]) -> Result<Vec<u8>, FilmError> {
    /// Palette index of pixels that do not change.
    const STAYS: u8 = COLOURS as u8;
    let [width, height] = size.map(usize::from);
    let mut palette = Palette::fitted(pictures);
    let mut colours = palette.quantiser.color_map_rgb();
    colours.resize(3 * (COLOURS + 1), 0);
    let mut bytes = Vec::new();
    let mut encoder = ::gif::Encoder::new(&mut bytes, size[0], size[1], &colours)?;
    encoder.set_repeat(Repeat::Infinite)?;
    // Ends of pictures are rounded, not delays, so that errors do not add up.
    let start = |picture: usize| (100.0 * delay * picture as f64).round() as u64;
    let mut before: Option<Vec<u8>> = None;
    for (index, picture) in pictures.iter().enumerate() {
        let places = palette.places(picture, width);
        let [left, top, end, bottom] = match &before {
            None => [0, 0, width, height],
            Some(before) => changed_area(before, &places, width),
        };
        let mut buffer = Vec::new();
        for row in top..bottom {
            let row = row * width + left..row * width + end;
            buffer.extend(row.map(|at| match &before {
                Some(before) if before[at] == places[at] => STAYS,
                _ => places[at],
            }));
        }
        encoder.write_frame(&Frame {
            delay: (start(index + 1) - start(index)) as u16,
            dispose: DisposalMethod::Keep,
            transparent: before.as_ref().map(|_| STAYS),
            left: left as u16,
            top: top as u16,
            width: (end - left) as u16,
            height: (bottom - top) as u16,
            buffer: buffer.into(),
            ..Frame::default()
        })?;
        before = Some(places);
    }
    drop(encoder);
    Ok(bytes)
}

/// Bounds of all pixels that differ: left, top, right and lower end. One pixel if none does.
fn changed_area(before: &[u8], after: &[u8], width: usize) -> [usize; 4] {
    let (mut low, mut high) = ([width, usize::MAX], [0, 0]);
    let pairs = before.iter().zip(after).enumerate();
    for (at, _) in pairs.filter(|(_, (before, after))| before != after) {
        let (column, row) = (at % width, at / width);
        low = [low[0].min(column), low[1].min(row)];
        high = [high[0].max(column + 1), row + 1];
    }
    match high[0] {
        0 => [0, 0, 1, 1],
        _ => [low[0], low[1], high[0], high[1]],
    }
}

/// Number of colours. One more index marks pixels that do not change.
const COLOURS: usize = 255;

/// Bits of a channel that distinguish colours.
const BITS: u32 = 6;

/// Largest shift of a channel by dithering, in either direction, of 256 steps.
const SHIFT: i32 = 2;

/// Bayer's ordered dither matrix.
const BAYER: [[i32; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

struct Palette {
    quantiser: NeuQuant,
    /// Palette index of each colour of [`BITS`] bits per channel that has been looked up.
    known: Vec<u16>,
}

const UNKNOWN: u16 = u16::MAX;

impl Palette {
    /// Fits the palette to a film. A colour counts by the square root of its pixels, so that small areas get colours, too.
    fn fitted(pictures: &[Vec<u8>]) -> Self {
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

    /// The palette indices of a picture's pixels.
    fn places(&mut self, picture: &[u8], width: usize) -> Vec<u8> {
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
