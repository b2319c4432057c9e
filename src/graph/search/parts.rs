//! Parts: runs of bands that are searched together.

use std::iter::Peekable;

use super::MapBand;
use crate::math::thread_count;

/// Runs of neighbouring bands. They are long enough that several clips are compared with the same windows while those are in the cache, and
/// short enough that a search can be watched and stopped.
#[derive(Debug)]
pub(super) struct BandParts<I: Iterator<Item = MapBand>> {
    bands: Peekable<I>,
    /// Maximum number of window pairs of a part with several bands.
    most_pairs: u64,
}

impl<I: Iterator<Item = MapBand>> BandParts<I> {
    /// Maximum number of bands of a part.
    const MOST_BANDS: usize = 1 << 17;
    /// Maximum number of window pairs for each thread.
    const MOST_PAIRS: u64 = 1 << 28;

    /// Divides bands into parts that give `threads` threads work, in their order.
    pub(super) fn new(bands: I, threads: usize) -> Self {
        Self {
            bands: bands.peekable(),
            most_pairs: Self::MOST_PAIRS * thread_count(threads) as u64,
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
                .next_if(|band| pairs + band.pairs() <= self.most_pairs)
        {
            pairs += band.pairs();
            part.push(band);
        }
        Some(part)
    }
}
