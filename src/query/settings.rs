//! The settings of a query: which paths are candidates, how they are retimed, scored and warped.
//!
//! Source of the terms and the default limits: Masaoka & Oshita, sections 5.1 to 5.4. Entries, layers and warps are not part of the paper.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::anim::Rig;

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

/// Name of a setting, its value, its valid range, and the range in words.
type RangedSetting = (&'static str, f64, (RangeInclusive<f64>, &'static str));

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

/// The set that candidates come from.
///
/// All sets except [`Enumerate::Whole`] come from the node's grid, from cells that the attack touches. If these have no path in time, or no
/// clean path, the candidates are those of [`Enumerate::Whole`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub enum Enumerate {
    /// The touched cell nearest to the character's root, as in the paper.
    NearestCell,
    /// The nearest touched cell that has a path in time.
    NearestFiledCell,
    /// All touched cells.
    #[default]
    TouchedCells,
    /// All paths from the node to an evasion, and moves if those could be better.
    Whole,
}

impl Enumerate {
    /// Whether the set comes from the node's grid.
    #[must_use]
    pub fn uses_grid(self) -> bool {
        self != Self::Whole
    }
}

/// Serialized form, for example `{"grid":"union"}`.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Stored {
    Grid(StoredCells),
    Whole,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredCells {
    Nearest,
    NearestFiled,
    Union,
}

impl From<Stored> for Enumerate {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Grid(StoredCells::Nearest) => Self::NearestCell,
            Stored::Grid(StoredCells::NearestFiled) => Self::NearestFiledCell,
            Stored::Grid(StoredCells::Union) => Self::TouchedCells,
            Stored::Whole => Self::Whole,
        }
    }
}

impl From<Enumerate> for Stored {
    fn from(enumerate: Enumerate) -> Self {
        match enumerate {
            Enumerate::NearestCell => Self::Grid(StoredCells::Nearest),
            Enumerate::NearestFiledCell => Self::Grid(StoredCells::NearestFiled),
            Enumerate::TouchedCells => Self::Grid(StoredCells::Union),
            Enumerate::Whole => Self::Whole,
        }
    }
}

/// Limits of the playback rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateSettings {
    /// Slowest rate. Default 0.5.
    pub slowest: f32,
    /// Fastest rate. Default 2.
    pub fastest: f32,
    /// Maximum time between the starts of evasion and attack without a change of rate, in seconds. Default 1/60, half a frame.
    pub tolerance: f32,
    /// Maximum time between the starts of evasion and attack if no path is in time, in seconds. Default 0.5.
    ///
    /// The paths that are nearest to being in time then become candidates. With 0, as in the paper, there are no candidates.
    pub nearest: f32,
}

impl Default for RateSettings {
    fn default() -> Self {
        Self {
            slowest: 0.5,
            fastest: 2.0,
            tolerance: 1.0 / 60.0,
            nearest: 0.5,
        }
    }
}

/// Settings of entries and layered evasions in a query.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntryUse {
    /// Maximum number of candidates that enter an evasion. 0 means none, as in the paper. Default 128.
    pub most: usize,
    /// Slowest playback rate of an entered evasion. Default 0.75.
    pub slowest: f32,
    /// Fastest playback rate of an entered evasion. Each entry also has its own limit. Default 1.5.
    pub fastest: f32,
    /// Longest time that the natural motion continues before an entry, in seconds. Default 0.8.
    pub longest_delay: f32,
    /// Maximum number of candidates that layer the upper body of an evasion over the natural motion. 0 disables layers; recordings without the
    /// setting are read as 0. Default 3.
    #[serde(default)]
    pub layers: usize,
}

impl Default for EntryUse {
    fn default() -> Self {
        Self {
            most: 128,
            slowest: 0.75,
            fastest: 1.5,
            longest_delay: 0.8,
            layers: 3,
        }
    }
}

impl EntryUse {
    /// Settings without entries, as in the paper.
    #[must_use]
    pub fn none() -> Self {
        Self {
            most: 0,
            layers: 0,
            ..Self::default()
        }
    }
}

/// Limits of the search for moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveSettings {
    /// Maximum number of paths that are followed at a time. Default 12. Larger numbers do not avoid more attacks.
    pub width: usize,
    /// Maximum number of moves. Default 48. With 24, 1% more of all attacks hit (thrown balls, the fighter of the benches).
    pub candidates: usize,
    /// Cell size for positions, in metres, at least 0.001. Default 0.10. Of all paths that end in the same part of a clip and in the same cells,
    /// one is followed.
    pub alike_distance: f32,
    /// Cell size for headings, in radians, at least 0.001. Default 15°.
    pub alike_angle: f32,
}

impl Default for MoveSettings {
    fn default() -> Self {
        Self {
            width: 12,
            candidates: 48,
            alike_distance: 0.10,
            alike_angle: 15f32.to_radians(),
        }
    }
}

/// Weights of the score's terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Weight of V_a. Default 1.
    pub avoid: f32,
    /// Weight of V_d. Default 4, with which 0.1 m weighs as much as missing 0.4 of the evasion region.
    ///
    /// With a negative weight the widest miss wins, and every candidate is tested.
    pub distance: f32,
    /// Weight of V_t. Default 1, with which double rate weighs as much as missing the whole evasion region.
    pub time: f32,
    /// Weight of V_w. Default 0.5, with which a warp that uses one bound completely weighs as much as missing half of the evasion region.
    #[serde(default)]
    pub warp: f32,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            avoid: 1.0,
            distance: 4.0,
            time: 1.0,
            warp: 0.5,
        }
    }
}

/// Settings of warps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpSettings {
    /// Maximum number of candidates that are warped if no candidate is clean, the shallowest hits first. 0 disables warps. Default 2. Of a
    /// fighter's hits by thrown balls, a value of 1 avoids 67%, 2 avoids 72% and 4 avoids 73%.
    pub candidates: usize,
    /// Maximum depth of a hit that is warped, in metres. Default 0.3.
    pub deepest: f32,
    /// Clearance below which a clean answer is warped away from the attack, in metres. Default 0, which never warps it away.
    pub nearest: f32,
    /// Clearance above which a clean answer is warped towards the attack if that lowers its score, in metres. Default `None`, which never warps it
    /// towards the attack.
    pub widest: Option<f32>,
    /// Wanted clearance of a warped motion, in metres. Default 0.01.
    pub margin: f32,
    /// Maximum number of linearisations. Default 5.
    pub rounds: usize,
    /// Maximum displacements.
    pub bounds: WarpBounds,
    /// Maximum speeds and durations.
    pub limits: WarpLimits,
}

impl Default for WarpSettings {
    fn default() -> Self {
        Self {
            candidates: 2,
            deepest: 0.3,
            nearest: 0.0,
            widest: None,
            margin: 0.01,
            rounds: 5,
            bounds: WarpBounds::default(),
            limits: WarpLimits::default(),
        }
    }
}

impl WarpSettings {
    /// Settings without warps.
    #[must_use]
    pub fn off() -> Self {
        Self::OFF
    }

    /// All settings with their names and ranges.
    fn ranges(&self) -> [RangedSetting; 25] {
        let (bounds, limits) = (&self.bounds, &self.limits);
        let number =
            |name, value: f32, most: f64, range| (name, f64::from(value), (0.0..=most, range));
        let metres = |name, value| number(name, value, 1.0, "0 to 1 m");
        let angle = |name, value| number(name, value, 1.6, "0 to 1.6 rad");
        let seconds = |name, value| number(name, value, 10.0, "0 to 10 s");
        let speed = |name, value| number(name, value, 1e6, "0 to 1000000");
        let count = |name, value: usize| (name, value as f64, (0.0..=1e3, "0 to 1000"));
        [
            count("warp.candidates", self.candidates),
            metres("warp.deepest", self.deepest),
            metres("warp.nearest", self.nearest),
            number(
                "warp.widest",
                self.widest.unwrap_or(0.0),
                100.0,
                "0 to 100 m",
            ),
            metres("warp.margin", self.margin),
            count("warp.rounds", self.rounds),
            angle("warp.bounds.spine", bounds.spine),
            metres("warp.bounds.pelvis", bounds.pelvis),
            metres("warp.bounds.foot", bounds.foot),
            metres("warp.bounds.hand", bounds.hand),
            seconds("warp.bounds.time", bounds.time),
            seconds("warp.limits.way_in", limits.way_in),
            seconds("warp.limits.shortest_way_in", limits.shortest_way_in),
            seconds("warp.limits.way_out", limits.way_out),
            seconds("warp.limits.reaction", limits.reaction),
            seconds("warp.limits.hold", limits.hold),
            speed("warp.limits.angular_velocity", limits.angular_velocity),
            speed(
                "warp.limits.angular_acceleration",
                limits.angular_acceleration,
            ),
            speed("warp.limits.root_speed", limits.root_speed),
            speed("warp.limits.root_acceleration", limits.root_acceleration),
            speed("warp.limits.end_speed", limits.end_speed),
            number("warp.limits.rate", limits.rate, 0.9, "0 to 0.9"),
            metres("warp.limits.balance", limits.balance),
            number("warp.limits.folded", limits.folded, 3.2, "0 to 3.2 rad"),
            metres("warp.limits.slide", limits.slide),
        ]
    }

    /// Settings without warps.
    pub const OFF: Self = Self {
        candidates: 0,
        deepest: 0.0,
        nearest: 0.0,
        widest: None,
        margin: 0.0,
        rounds: 0,
        bounds: WarpBounds::NONE,
        limits: WarpLimits::STILL,
    };
}

/// Maximum displacements of a warp. 0 leaves a part unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpBounds {
    /// Maximum rotation of the whole spine, in radians. Default 15°.
    pub spine: f32,
    /// Maximum translation of the pelvis, in metres. Default 0.10.
    pub pelvis: f32,
    /// Maximum translation of a lifted foot, in metres. Default 0.25.
    pub foot: f32,
    /// Maximum translation of a hand, in metres. Default 0.20.
    pub hand: f32,
    /// Maximum offset in time, ahead or behind, in seconds. Default 0.04.
    pub time: f32,
}

impl Default for WarpBounds {
    fn default() -> Self {
        Self {
            spine: 15f32.to_radians(),
            pelvis: 0.10,
            foot: 0.25,
            hand: 0.20,
            time: 0.04,
        }
    }
}

impl WarpBounds {
    /// Bounds that allow no displacement.
    pub const NONE: Self = Self {
        spine: 0.0,
        pelvis: 0.0,
        foot: 0.0,
        hand: 0.0,
        time: 0.0,
    };

    /// The bound of a limb's end: a foot or a hand.
    #[must_use]
    pub fn end(&self, limb: usize) -> f32 {
        if limb < Rig::LEGS {
            self.foot
        } else {
            self.hand
        }
    }
}

/// Maximum speeds of a warp, and durations of its fades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WarpLimits {
    /// Duration of the fade-in if there is time, in seconds. Default 0.35.
    pub way_in: f32,
    /// Minimum duration of the fade-in, in seconds. Default 0.12.
    pub shortest_way_in: f32,
    /// Duration of the fade-out, in seconds. Default 0.4.
    pub way_out: f32,
    /// Minimum time from the query to the start of a warp, in seconds. Default 0.
    pub reaction: f32,
    /// Time at full weight before and after the attack is nearest, in seconds. Default 0.03.
    pub hold: f32,
    /// Maximum angular velocity of a joint in its parent's frame, in rad/s. It limits the velocity that a warp adds, and the velocity of the
    /// warped motion unless the motion itself exceeds it. Default 20.
    pub angular_velocity: f32,
    /// Maximum angular acceleration of a joint, in rad/s², limited in the same way. Default 500.
    pub angular_acceleration: f32,
    /// Maximum velocity that a warp adds to the pelvis, in m/s. Default 1.
    pub root_speed: f32,
    /// Maximum acceleration that a warp adds to the pelvis, in m/s². Default 12.
    pub root_acceleration: f32,
    /// Maximum velocity that a warp adds to a lifted foot or a hand, in m/s. Default 2.5.
    pub end_speed: f32,
    /// Maximum change of the playback rate. Default 0.25.
    pub rate: f32,
    /// Maximum distance of the centre of mass from the support while the body stands still, in metres, unless the motion itself exceeds
    /// it. Default 0.02.
    pub balance: f32,
    /// Minimum angle between the bones of a knee or an elbow, in radians. Default 35°.
    pub folded: f32,
    /// Maximum displacement of a planted foot, in metres. Default 0.001.
    pub slide: f32,
}

impl Default for WarpLimits {
    fn default() -> Self {
        Self {
            way_in: 0.35,
            shortest_way_in: 0.12,
            way_out: 0.4,
            reaction: 0.0,
            hold: 0.03,
            angular_velocity: 20.0,
            angular_acceleration: 500.0,
            root_speed: 1.0,
            root_acceleration: 12.0,
            end_speed: 2.5,
            rate: 0.25,
            balance: 0.02,
            folded: 35f32.to_radians(),
            slide: 0.001,
        }
    }
}

impl WarpLimits {
    /// Limits that allow no motion.
    pub const STILL: Self = Self {
        way_in: 0.0,
        shortest_way_in: 0.0,
        way_out: 0.0,
        reaction: 0.0,
        hold: 0.0,
        angular_velocity: 0.0,
        angular_acceleration: 0.0,
        root_speed: 0.0,
        root_acceleration: 0.0,
        end_speed: 0.0,
        rate: 0.0,
        balance: 0.0,
        folded: 0.0,
        slide: 0.0,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stored_form_is_that_of_a_grid_with_its_cells() {
        let forms: [(Enumerate, &[u8]); 4] = [
            (Enumerate::NearestCell, &[0, 0]),
            (Enumerate::NearestFiledCell, &[0, 1]),
            (Enumerate::TouchedCells, &[0, 2]),
            (Enumerate::Whole, &[1]),
        ];
        for (enumerate, bytes) in forms {
            assert_eq!(postcard::to_stdvec(&enumerate).unwrap(), bytes);
            assert_eq!(postcard::from_bytes::<Enumerate>(bytes), Ok(enumerate));
        }
    }
}
