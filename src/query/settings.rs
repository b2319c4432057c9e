use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::entry_use::EntryUse;
use super::enumerate::Enumerate;
use super::moves::MoveSettings;
use super::retime::RateSettings;
use super::score::Weights;
use super::warp::WarpSettings;

/// Settings of a query.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuerySettings {
    /// The set that candidates come from. Default [`Enumerate::TouchedCells`].
    pub enumerate: Enumerate,
    /// Limits of the playback rate.
    pub rates: RateSettings,
    /// Cell size for positions, in metres, at least 0.001. Default 0.05. Of all candidates that perform the same evasion in the same cells, one
    /// is kept.
    pub alike_distance: f32,
    /// Cell size for headings, in radians, at least 0.001. Default 5°.
    pub alike_angle: f32,
    /// Maximum number of candidates that end in an evasion. Default 256. Those with rates nearest to 1 are kept.
    pub most_evasions: usize,
    /// Limits of the evasions that are entered without an edge. Recordings without the setting are read as having none.
    #[serde(default = "EntryUse::none")]
    pub entries: EntryUse,
    /// Limits of the search for moves.
    #[doc(hidden)]
    pub moves: MoveSettings,
    /// Weights of the score.
    pub weights: Weights,
    /// Whether the answer lists the paths that are not in time, with the reasons. If not, they are only counted. Default false.
    pub list_late: bool,
    /// Number of threads that test candidates exactly, or 0 for one thread per core. Default 1. The answer does not depend on it.
    ///
    /// Only independent tests are divided among threads: those before the first clean candidate is found, and all tests of
    /// [`Evaluation::Exhaustive`](super::Evaluation::Exhaustive). The threads belong to the
    /// [`QueryContext`](super::QueryContext).
    pub threads: usize,
    /// Settings of warps, which make motions clean. Recordings without the setting are read as having no warps.
    #[serde(default = "WarpSettings::off")]
    pub warp: WarpSettings,
}

impl Default for QuerySettings {
    fn default() -> Self {
        Self {
            enumerate: Enumerate::default(),
            rates: RateSettings::default(),
            alike_distance: 0.05,
            alike_angle: 5f32.to_radians(),
            most_evasions: 256,
            entries: EntryUse::default(),
            moves: MoveSettings::default(),
            weights: Weights::default(),
            list_late: false,
            threads: 1,
            warp: WarpSettings::default(),
        }
    }
}

/// A setting of a query that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("query setting {name} is {value}; it must be {range}")]
pub struct QuerySettingsError {
    /// Name of the setting.
    pub name: &'static str,
    /// Value of the setting.
    pub value: f64,
    /// Range of valid values, in words.
    pub range: &'static str,
}

impl QuerySettings {
    /// Upper limit of the settings that count candidates or paths.
    pub const MOST_CANDIDATES: usize = 1 << 16;

    /// Upper limit of [`QuerySettings::threads`].
    pub const MOST_THREADS: usize = 1024;

    /// Checks that every setting is in range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), QuerySettingsError> {
        type Range = (RangeInclusive<f64>, &'static str);
        const CELL: Range = (0.001..=1000.0, "0.001 to 1000");
        const RATE: Range = (0.01..=100.0, "0.01 to 100");
        const WEIGHT: Range = (-1e6..=1e6, "-1000000 to 1000000");
        const COUNT: Range = (1.0..=QuerySettings::MOST_CANDIDATES as f64, "1 to 65536");
        const ENTRIES: Range = (0.0..=QuerySettings::MOST_CANDIDATES as f64, "0 to 65536");
        const THREADS: Range = (0.0..=QuerySettings::MOST_THREADS as f64, "0 to 1024");
        const TIME: Range = (0.0..=10.0, "0 to 10 s");
        let (rates, moves, weights) = (&self.rates, &self.moves, &self.weights);
        let number = |name, value: f32, range| (name, f64::from(value), range);
        let count = |name, value: usize, range| (name, value as f64, range);
        let checks = [
            number("rates.slowest", rates.slowest, RATE),
            number("rates.fastest", rates.fastest, RATE),
            number("rates.tolerance", rates.tolerance, TIME),
            number("rates.nearest", rates.nearest, TIME),
            number("alike_distance", self.alike_distance, CELL),
            number("alike_angle", self.alike_angle, CELL),
            count("most_evasions", self.most_evasions, COUNT),
            ("entries.most", self.entries.most as f64, ENTRIES),
            ("entries.layers", self.entries.layers as f64, ENTRIES),
            number("entries.slowest", self.entries.slowest, RATE),
            number("entries.fastest", self.entries.fastest, RATE),
            number("entries.longest_delay", self.entries.longest_delay, TIME),
            count("moves.width", moves.width, COUNT),
            count("moves.candidates", moves.candidates, COUNT),
            number("moves.alike_distance", moves.alike_distance, CELL),
            number("moves.alike_angle", moves.alike_angle, CELL),
            number("weights.avoid", weights.avoid, WEIGHT),
            number("weights.distance", weights.distance, WEIGHT),
            number("weights.time", weights.time, WEIGHT),
            number("weights.warp", weights.warp, WEIGHT),
            count("threads", self.threads, THREADS),
        ];
        let wrong = checks
            .into_iter()
            .chain(self.warp.ranges())
            .find(|(_, value, (range, _))| !range.contains(value));
        match wrong {
            Some((name, value, (_, range))) => Err(QuerySettingsError { name, value, range }),
            None => Ok(()),
        }
    }
}
