//! Writes pictures and films to files, whole or not at all.

use std::io::Write;
use std::path::Path;

use sabaki::archive;
use sabaki_app::film::{Film, FilmError, png};

use crate::cli::{Failure, cancel};

/// The format of a file, by the ending of its name.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Png,
    Gif,
    Apng,
}

impl Kind {
    pub(super) fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_ref().and_then(|ending| ending.to_str()) {
            Some("png") => Ok(Self::Png),
            Some("gif") => Ok(Self::Gif),
            Some("apng") => Ok(Self::Apng),
            _ => Err(Failure::Usage(format!(
                "{}: its name must end in .png, .gif or .apng",
                path.display()
            ))),
        }
    }

    pub(super) fn is_film(self) -> bool {
        self != Self::Png
    }

    /// Refuses a rate for a picture.
    pub(super) fn check_rate(self, path: &Path) -> Result<(), Failure> {
        match self.is_film() {
            true => Ok(()),
            false => Err(Failure::Usage(format!(
                "--rate is of a film (.gif, .apng); {} is a picture",
                path.display()
            ))),
        }
    }
}

/// Writes a film, or its only picture. Returns the number of bytes.
pub(super) fn write(path: &Path, kind: Kind, film: &Film) -> Result<usize, Failure> {
    let failed = |source| Failure::Write {
        path: path.to_owned(),
        source,
    };
    let encoded = match (kind, film.pictures.first()) {
        (Kind::Gif, _) => film.gif(),
        (Kind::Apng, _) => film.apng(),
        (Kind::Png, Some(picture)) => png(film.size, picture),
        (Kind::Png, None) => Err(FilmError::Empty),
    };
    let bytes = encoded.map_err(|error| failed(std::io::Error::other(error)))?;
    cancel::check()?;
    archive::write_atomically(path, |file| file.write_all(&bytes)).map_err(failed)?;
    Ok(bytes.len())
}
