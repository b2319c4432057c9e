//! Parts: runs of bands that are searched together.

use std::iter::Peekable;

use super::MapBand;

/// Runs of neighbouring bands. They are long enough that several clips are compared with the same windows while those are in the cache, and
/// short enough that a search can be watched and stopped.
#[derive(Debug)]
pub struct BandParts<I: Iterator<Item = MapBand>> {
    bands: Peekable<I>,
}

impl<I: Iterator<Item = MapBand>> BandParts<I> {
    /// Maximum number of bands of a part.
    const MOST_BANDS: usize = 1 << 17;
    /// Maximum number of window pairs of a part with several bands.
    const MOST_PAIRS: u64 = 1 << 29;

    /// Divides bands into parts, in their order.
    pub fn new(bands: I) -> Self {
        Self {
            bands: bands.peekable(),
        }
    }
}

impl<I: Iterator<Item = MapBand>> Iterator for BandParts<I> {
    type Item = Vec<MapBand>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut part = vec![self.bands.next()?];
        let mut pairs = part[0].pairs();
        while part.len() < Self::MOST_BANDS
            && let Some(band) = self
                .bands
                .next_if(|band| pairs + band.pairs() <= Self::MOST_PAIRS)
        {
            pairs += band.pairs();
            part.push(band);
        }
        Some(part)
    }
}
