//! Pictures one after the other, as animated GIF or APNG; one picture, as PNG.

mod apng;
mod gif;
mod palette;

use thiserror::Error;

pub use apng::png;

/// Pictures of one size.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Film {
    /// Columns and rows.
    pub size: [u32; 2],
    /// How long each picture is shown, hundredths of a second.
    pub delay: u16,
    /// Of each picture three bytes a pixel: red, green and blue (sRGB), row by row from the upper left.
    pub pictures: Vec<Vec<u8>>,
}

/// Why a film was not made.
#[derive(Debug, Error)]
pub enum FilmError {
    /// There is no picture.
    #[error("a film needs a picture")]
    Empty,
    /// A picture is not of the film's size.
    #[error("picture {index} has {found} bytes, not {wanted}")]
    Size {
        /// Zero-based.
        index: usize,
        /// How many bytes it has.
        found: usize,
        /// How many it should have.
        wanted: usize,
    },
    /// A side of no pixels, or of more than the format can say.
    #[error("{0} by {1} pixels are no picture")]
    Side(u32, u32),
    /// The PNG encoder's.
    #[error(transparent)]
    Png(#[from] ::png::EncodingError),
    /// The GIF encoder's.
    #[error(transparent)]
    Gif(#[from] ::gif::EncodingError),
}

impl Film {
    /// The bytes of an animated GIF that plays for ever. The same bytes each time.
    ///
    /// # Errors
    /// No picture, or one of another size.
    pub fn gif(&self) -> Result<Vec<u8>, FilmError> {
        self.check()?;
        gif::encode(self)
    }

    /// The bytes of an animated PNG that plays for ever. Nothing is lost.
    ///
    /// # Errors
    /// No picture, or one of another size.
    pub fn apng(&self) -> Result<Vec<u8>, FilmError> {
        self.check()?;
        apng::encode(self)
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
