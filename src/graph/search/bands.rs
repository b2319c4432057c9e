//! The search for transitions, in bands: a band is a range of rows of one distance map.
//!
//! Source: Kovar, Gleicher & Pighin (2002), section 3.2: transitions are the local minima of the distance map under a
//! threshold. Differs: the map is cut into bands, so that threads, or processes that share no memory, can divide the search.
//!
//! The bands depend on the lengths of the clips alone, and the minima of a band on the points of its two clips alone. The
//! transitions therefore do not depend on who searches a band, nor on the order.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Settings of the search, in frames and metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchSettings {
    /// Number of frames in a window, at least 1.
    pub window: usize,
    /// Minimum separation of two minima along either clip, in frames. Of closer minima the smaller
    /// one is kept.
    pub separation: usize,
    /// Maximum distance, in metres.
    pub threshold: f32,
}

/// A range of rows of the distance map of two clips, or of one clip with itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapBand {
    /// Index of the clip of the rows.
    pub a: usize,
    /// Index of the clip of the columns, at least `a`.
    pub b: usize,
    /// First row.
    pub first: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
}

impl SearchSettings {
    /// Number of rows of a band. The last band of a map may have fewer rows.
    const ROWS: usize = 1024;

    /// All bands, for clips of `frames` frames. Bands of one map are neighbours, in the order of their rows.
    pub fn bands(self, frames: &[usize]) -> impl Iterator<Item = MapBand> + Clone + use<> {
        let windows: Vec<usize> = frames
            .iter()
            .map(|&frames| (frames + 1).saturating_sub(self.window))
            .collect();
        let clips = windows.len();
        let maps = (0..clips).flat_map(move |a| (a..clips).map(move |b| (a, b)));
        maps.flat_map(move |(a, b)| {
            let (rows, columns) = (windows[a], windows[b]);
            (0..rows).step_by(Self::ROWS).map(move |first| MapBand {
                a,
                b,
                first,
                rows: Self::ROWS.min(rows - first),
                columns,
            })
        })
        .filter(|band| band.columns > 0)
    }
}

/// A pair of similar windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Minimum {
    /// First frame of the first clip's window.
    pub a: u32,
    /// First frame of the second clip's window.
    pub b: u32,
    /// Root of the mean squared point distance, in metres.
    pub distance: f32,
}

impl MapBand {
    /// Number of window pairs.
    pub fn pairs(&self) -> u64 {
        self.rows as u64 * self.columns as u64
    }

    /// Whether a list can be the minima of this band: each lies in the band, and its distance is not negative and below the
    /// threshold. Minima that come from a file are checked with it.
    pub fn admits(&self, minima: &[Minimum], settings: &SearchSettings) -> bool {
        let rows = self.rows();
        minima.iter().all(|minimum| {
            rows.contains(&(minimum.a as usize))
                && (minimum.b as usize) < self.columns
                && (0.0..=settings.threshold).contains(&minimum.distance)
        })
    }

    pub(crate) fn rows(&self) -> Range<usize> {
        self.first..self.first + self.rows
    }
}
