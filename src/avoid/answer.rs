use serde::{Deserialize, Serialize};

use super::clearance::Clearance;
use super::cull::Overlap;
use super::enumerate::SearchReport;
use super::retime::{Rate, RateError};
use super::score::Score;
use crate::graph::{EdgeId, Motion};

/// What a query answers.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Position of the chosen candidate in `candidates`.
    pub chosen: usize,
    /// Whether the chosen motion avoids the attack: exactly tested, not by maps.
    pub avoided: bool,
    /// The smallest distance of body and attack on the chosen motion.
    pub clearance: Clearance,
    /// What to play, from the moment of the query on.
    pub motion: Motion,
    /// Every candidate with what became of it.
    pub candidates: Vec<CandidateReport>,
    /// How many of each.
    pub counts: Counts,
    /// How the search for candidates went.
    pub search: SearchReport,
}

/// One candidate and what became of it.
#[derive(Clone, Debug, PartialEq)]
pub struct CandidateReport {
    /// From the next node to the evasion's start, or to the attack's end.
    pub path: Vec<EdgeId>,
    /// The evasion's edge, which follows the path; `None` for a path that only moves.
    pub evasion: Option<EdgeId>,
    /// The rate of the retimable edges, or why there is none.
    pub rate: Result<Rate, RateError>,
    /// Texels of the attack on its maps; `None` where nothing was counted.
    pub overlap: Option<Overlap>,
    /// The exact distance; `None` where it was not needed. Of a hit that was not chosen it may be
    /// that of its first moment only.
    pub clearance: Option<Clearance>,
    /// Its score; `None` for a hit and for what was not tested.
    pub score: Option<Score>,
    /// What became of it.
    pub fate: Fate,
}

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// It is the answer.
    Chosen,
    /// Another one scored better; where it has no clearance, it could not have scored better with
    /// any.
    Outscored,
    /// No rate brings its evasion in time.
    NotInTime,
    /// Its body map meets the attack.
    Culled,
    /// The exact test finds a hit.
    Hit,
}

/// How many candidates of each fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// That an evasion ends and that a rate brings in time, and those that only move.
    pub candidates: usize,
    /// Of these, how many end in an evasion.
    pub with_evasion: usize,
    /// Paths to an evasion that no rate brings in time.
    pub not_in_time: usize,
    /// Removed by the maps.
    pub culled: usize,
    /// Of the culled ones, how many the exact test was asked about after all, since it found
    /// nothing clean among the others.
    pub reconsidered: usize,
    /// Exact hits among those tested.
    pub hits: usize,
    /// Exactly clean among those tested.
    pub clean: usize,
}
