//! Jobs: runs of bands that one thread searches one after another.

use std::iter::Peekable;

use super::MapBand;

/// Runs of neighbouring bands. They are long enough to amortise the scratch of a search, and short enough that threads finish at about the
/// same time.
#[derive(Debug)]
pub struct BandJobs<I: Iterator<Item = MapBand>> {
    bands: Peekable<I>,
}

impl<I: Iterator<Item = MapBand>> BandJobs<I> {
    /// Maximum number of bands of a job.
    const MOST_BANDS: usize = 1024;
    /// Maximum number of window pairs of a job with several bands.
    const MOST_PAIRS: u64 = 1 << 24;

    /// Divides bands into jobs, in their order.
    pub fn new(bands: I) -> Self {
        Self {
            bands: bands.peekable(),
        }
    }
}

impl<I: Iterator<Item = MapBand>> Iterator for BandJobs<I> {
    type Item = Vec<MapBand>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut job = vec![self.bands.next()?];
        let mut pairs = job[0].pairs();
        while job.len() < Self::MOST_BANDS
            && let Some(band) = self
                .bands
                .next_if(|band| pairs + band.pairs() <= Self::MOST_PAIRS)
        {
            pairs += band.pairs();
            job.push(band);
        }
        Some(job)
    }
}
