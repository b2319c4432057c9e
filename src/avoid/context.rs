use rustc_hash::FxHashSet;

use super::attack::QueryAttack;
use super::candidate::Candidate;
use super::cull::{Counted, CullInput, Overlap, cpu};
use super::judge::CourtScratch;
use super::moves::{MoveSearch, SearchReport};
use super::placement::{CullMaps, PlacedRegion};
use super::retime::RateError;
use crate::region::{CellColumn, PathId, TouchedCells};

/// What a query works with; kept from one query to the next, so that after some of them nothing is
/// allocated any more. Of no use to read; each thread has its own.
#[derive(Clone, Debug, Default)]
pub struct QueryContext {
    /// Of the query that it was last used for.
    pub(super) serial: u64,
    /// Those with maps come first.
    pub(super) candidates: Vec<Candidate>,
    /// Paths to an evasion that no rate brings in time, where they are listed.
    pub(super) late: Vec<(PathId, RateError)>,
    pub(super) late_count: usize,
    pub(super) search: SearchReport,
    pub(super) touched: TouchedCells,
    /// Columns by how near they are.
    pub(super) nearest: Vec<(f32, CellColumn)>,
    pub(super) seen: FxHashSet<[i32; 4]>,
    pub(super) attack: QueryAttack,
    pub(super) placed: Vec<PlacedRegion>,
    pub(super) clocks: Vec<f32>,
    pub(super) maps: CullMaps,
    pub(super) moves: MoveSearch,
    pub(super) court: CourtScratch,
    pub(super) counting: Counting,
}

/// Counting on the CPU.
#[derive(Clone, Debug)]
pub(super) struct Counting {
    pub overlaps: Vec<Overlap>,
    culler: cpu::Culler,
}

impl Default for Counting {
    fn default() -> Self {
        Self {
            overlaps: Vec::new(),
            culler: cpu::Culler::default().counting(Counted::FOR_A_CHOICE),
        }
    }
}

impl Counting {
    pub(super) fn count(&mut self, input: &CullInput<'_>) {
        self.culler.count(input, &mut self.overlaps);
    }
}
