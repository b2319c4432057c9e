//! The settings of a query: which paths are candidates, how they are retimed, scored and warped.
//!
//! Source of the terms and the default limits: Masaoka & Oshita, sections 5.1 to 5.4. Entries, layers and warps are not part of the paper.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::anim::Rig;
use crate::maps::BakedGraph;

/// Settings of a query.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuerySettings {
    /// The set that candidates come from. Default [`Enumerate::TouchedCells`].
    pub enumerate: Enumerate,
    /// Limits of the playback rate.
    pub rates: RateSettings,
    /// Cell size for positions, in metres, at least 0.001. Default 0.05. Of all candidates that perform the same evasion in the same cells,
    /// one is kept.
    pub alike_distance: f32,
    /// Cell size for headings, in radians, at least 0.001. Default 5°.
    pub alike_angle: f32,
    /// Maximum number of candidates that end in an evasion. Default 256. Those with rates nearest to 1 are kept.
    pub most_evasions: usize,
    /// Limits of the evasions that are entered without an edge.
    pub entries: EntryUse,
    /// Limits of the search for moves.
    pub moves: MoveSettings,
    /// Weights of the score.
    pub weights: Weights,
    /// Whether the answer lists the paths that are not in time, with the reasons. If not, they are only counted. Default false.
    pub list_late: bool,
    /// Number of threads that test candidates exactly, or 0 for one thread per core; at most 1024. Default 1. The answer does not depend
    /// on it.
    ///
    /// Only independent tests are divided among threads: those before the first clean candidate is found, and all tests of
    /// [`Evaluation::Exhaustive`](super::Evaluation::Exhaustive). The threads belong to the [`QueryContext`](super::QueryContext).
    pub threads: usize,
    /// Settings of warps, which make motions clean.
    pub warp: WarpSettings,
    /// How hard the body may push off in an answer, as a multiple of what it does in the clips ([`BakedGraph::push_limit`]); 0 for no
    /// limit. Default 1. A motion that pushes harder is chosen only if all do, or if the body does so anyway when it goes on as it is. Against
    /// an attack that arrives later than in 0.4 s, the body may push four fifths as hard.
    pub push_off: f32,
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
            push_off: 1.0,
        }
    }
}

/// A setting of a query that is out of range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("query setting {name} is {value}; it must be {least} to {most}")]
pub struct QuerySettingsError {
    /// Name of the setting.
    pub name: String,
    /// Value of the setting.
    pub value: f64,
    /// Smallest valid value.
    pub least: f64,
    /// Largest valid value.
    pub most: f64,
}

impl QuerySettings {
    /// Upper limit of the settings that count candidates or paths.
    pub const MOST_CANDIDATES: usize = 1 << 16;

    /// How hard the body may push off, in metres per second squared, against an attack that hits it `contact` seconds from now.
    pub(crate) fn allowed_push(&self, baked: &BakedGraph, contact: f32) -> f32 {
        /// Time to the contact of an urgent attack, in seconds, and the share of the limit against others.
        const URGENT: f32 = 0.4;
        const GENTLE: f32 = 0.8;
        let share = if contact < URGENT { 1.0 } else { GENTLE };
        match self.push_off {
            0.0 => f32::INFINITY,
            multiple => multiple * share * baked.push_limit(),
        }
    }

    /// Checks that every setting is in range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn check(&self) -> Result<(), QuerySettingsError> {
        /// Checks settings that share a range.
        macro_rules! in_range {
            ($least:expr, $most:expr, [$($($field:ident).+),+]) => {
                $(check(&[$(stringify!($field)),+], self.$($field).+ as f64, $least, $most)?;)+
            };
        }
        let most = Self::MOST_CANDIDATES as f64;
        in_range!(0.01, 100.0, [rates.slowest, rates.fastest]);
        in_range!(0.01, 100.0, [entries.slowest, entries.fastest]);
        in_range!(
            0.0,
            10.0,
            [rates.tolerance, rates.nearest, entries.longest_delay]
        );
        in_range!(0.001, 1000.0, [alike_distance, alike_angle]);
        in_range!(0.001, 1000.0, [moves.alike_distance, moves.alike_angle]);
        in_range!(1.0, most, [most_evasions, moves.width, moves.candidates]);
        in_range!(0.0, most, [entries.most, entries.layers]);
        in_range!(0.0, 1024.0, [threads]);
        in_range!(-1e6, 1e6, [weights.avoid, weights.distance]);
        in_range!(-1e6, 1e6, [weights.time, weights.warp]);
        in_range!(0.0, 1e6, [weights.goal]);
        in_range!(0.0, 1e3, [warp.candidates, warp.rounds]);
        in_range!(0.0, 100.0, [push_off]);
        in_range!(0.0, 1.0, [warp.nearest]);
        let widest = self.warp.widest.unwrap_or_default();
        check(&["warp", "widest"], widest.into(), 0.0, 100.0)?;
        in_range!(0.0, 1.0, [warp.deepest, warp.margin, warp.bounds.pelvis]);
        in_range!(0.0, 1.0, [warp.bounds.foot, warp.bounds.hand]);
        in_range!(0.0, 1.0, [warp.limits.balance, warp.limits.slide]);
        in_range!(0.0, 1.6, [warp.bounds.spine]);
        in_range!(0.0, 10.0, [warp.bounds.time, warp.limits.way_in]);
        in_range!(
            0.0,
            10.0,
            [warp.limits.shortest_way_in, warp.limits.way_out]
        );
        in_range!(0.0, 10.0, [warp.limits.reaction, warp.limits.hold]);
        in_range!(0.0, 1e6, [warp.limits.angular_velocity]);
        in_range!(0.0, 1e6, [warp.limits.angular_acceleration]);
        in_range!(0.0, 1e6, [warp.limits.root_speed, warp.limits.end_speed]);
        in_range!(0.0, 1e6, [warp.limits.root_acceleration]);
        in_range!(0.0, 0.9, [warp.limits.rate]);
        in_range!(0.0, 3.2, [warp.limits.folded]);
        Ok(())
    }
}

fn check(path: &[&str], value: f64, least: f64, most: f64) -> Result<(), QuerySettingsError> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => Err(QuerySettingsError {
            name: path.join("."),
            value,
            least,
            most,
        }),
    }
}

/// The set that candidates come from.
///
/// All sets except [`Enumerate::Whole`] come from the node's grid, from cells that the attack touches. If these have no path in time, or no
/// clean path, the candidates are those of [`Enumerate::Whole`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// Maximum number of candidates that layer the upper body of an evasion over the natural motion. 0 disables layers. Default
    /// 3.
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
    /// Cell size for positions, in metres, at least 0.001. Default 0.10. Of all paths that end in the same part of a clip and in the same
    /// cells, one is followed.
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
    pub warp: f32,
    /// Weight of V_g. Default 3: a motion that leads a third of the way further than another one may miss the whole evasion region instead.
    /// Only plans of [`Characters`](crate::character::Characters) know a goal.
    #[serde(default)]
    pub goal: f32,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            avoid: 1.0,
            distance: 4.0,
            time: 1.0,
            warp: 0.5,
            goal: 3.0,
        }
    }
}

/// Settings of warps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WarpSettings {
    /// Maximum number of candidates that are warped if no candidate is clean, the shallowest hits first. 0 disables warps. Default 4. Of
    /// balls that a fighter sees 0.3 s before they hit him, 2 avoid 65%, 4 avoid 68% and 8 avoid 69%.
    pub candidates: usize,
    /// Maximum depth of a hit that is warped, in metres. Default 0.3.
    pub deepest: f32,
    /// Clearance below which a clean answer is warped away from the attack, in metres. Default 0, which never warps it away.
    pub nearest: f32,
    /// Clearance above which a clean answer is warped towards the attack if that lowers its score, in metres. Default `None`, which never
    /// warps it towards the attack.
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
            candidates: 4,
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
        Self {
            candidates: 0,
            ..Self::default()
        }
    }
}

/// Maximum displacements of a warp. 0 leaves a part unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// The bound of a limb's end: a foot or a hand.
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
    /// Maximum angular velocity of a joint in its parent's frame, in rad/s. It limits the velocity that a warp adds, and the velocity of
    /// the warped motion unless the motion itself exceeds it. Default 20.
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
