//! Films as animated GIF or APNG, and pictures as PNG.

mod apng;
mod delay;
mod gif;
mod palette;

use thiserror::Error;

pub use apng::png;
pub use delay::Delay;

/// A sequence of pictures of one size.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Film {
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// Time that each picture is shown.
    pub delay: Delay,
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
        gif::encode([width, height], self.delay, &self.pictures)
    }

    /// Encodes an animated PNG that repeats for ever, without loss.
    ///
    /// # Errors
    /// The film has no pictures, or pictures of another size.
    pub fn apng(&self) -> Result<Vec<u8>, FilmError> {
        self.check()?;
        apng::encode(self.size, self.delay, &self.pictures)
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
