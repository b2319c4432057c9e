use gif::{DisposalMethod, Encoder, Frame, Repeat};

use super::palette::{COLOURS, Palette};
use super::{Delay, FilmError};

/// Palette index of pixels that do not change.
const STAYS: u8 = COLOURS as u8;

/// Stores of each picture only the rectangle with changes, and in it only the pixels that change.
pub(super) fn encode(
    size: [u16; 2],
    delay: Delay,
    pictures: &[Vec<u8>],
) -> Result<Vec<u8>, FilmError> {
    let [width, height] = size.map(usize::from);
    let mut palette = Palette::of(pictures);
    let mut colours = palette.colours();
    colours.resize(3 * (COLOURS + 1), 0);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, size[0], size[1], &colours)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut before: Option<Vec<u8>> = None;
    for (index, picture) in pictures.iter().enumerate() {
        let places = palette.places(picture, width);
        let changed = match &before {
            None => Area::whole(width, height),
            Some(before) => Area::of_changes(before, &places, width),
        };
        let area = changed
            .rows()
            .map(|row| row * width + changed.left..row * width + changed.end);
        let mut buffer = Vec::new();
        for row in area {
            buffer.extend(row.map(|at| match &before {
                Some(before) if before[at] == places[at] => STAYS,
                _ => places[at],
            }));
        }
        encoder.write_frame(&Frame {
            delay: delay.hundredths(index),
            dispose: DisposalMethod::Keep,
            transparent: before.as_ref().map(|_| STAYS),
            left: changed.left as u16,
            top: changed.top as u16,
            width: (changed.end - changed.left) as u16,
            height: (changed.bottom - changed.top) as u16,
            buffer: buffer.into(),
            ..Frame::default()
        })?;
        before = Some(places);
    }
    drop(encoder);
    Ok(bytes)
}

/// A rectangle of a picture.
struct Area {
    left: usize,
    top: usize,
    end: usize,
    bottom: usize,
}

impl Area {
    fn whole(width: usize, height: usize) -> Self {
        Self {
            left: 0,
            top: 0,
            end: width,
            bottom: height,
        }
    }

    /// The bounds of all pixels that differ; one pixel if none does.
    fn of_changes(before: &[u8], after: &[u8], width: usize) -> Self {
        let mut area = Self {
            left: width,
            top: usize::MAX,
            end: 0,
            bottom: 0,
        };
        for (at, _) in before
            .iter()
            .zip(after)
            .enumerate()
            .filter(|(_, pair)| pair.0 != pair.1)
        {
            let (row, column) = (at / width, at % width);
            area.left = area.left.min(column);
            area.end = area.end.max(column + 1);
            area.top = area.top.min(row);
            area.bottom = area.bottom.max(row + 1);
        }
        match area.end {
            0 => Self::whole(1, 1),
            _ => area,
        }
    }

    fn rows(&self) -> std::ops::Range<usize> {
        self.top..self.bottom
    }
}
