//! What moves have in common: those that begin alike are hit alike, for as long as they do.

use rustc_hash::FxHashMap;

use super::case::Case;
use super::clearance::{Clearance, SAMPLE_RATE};
use super::moves::MoveId;
use crate::region::BodyTrack;

/// What is known of all moves that begin in some way; kept from one query to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Beginnings {
    known: FxHashMap<MoveId, Clearance>,
}

/// A test looks this far beyond the moment that it speaks of, seconds: to the end of the stretch that comes next.
const AHEAD: f32 = (2 * BodyTrack::STRETCH + 1) as f32 / SAMPLE_RATE;

impl Beginnings {
    pub(super) fn clear(&mut self) {
        self.known.clear();
    }

    /// What was noted of a move that begins as this one does.
    pub(super) fn of(&self, case: &Case<'_>, path: MoveId) -> Option<Clearance> {
        let mut beginnings = case.moves.beginnings(path);
        beginnings.find_map(|(beginning, _)| self.known.get(&beginning).copied())
    }

    /// Notes of a move what its motion up to some moment decides, seconds since the query.
    pub(super) fn note(&mut self, case: &Case<'_>, (path, until): (MoveId, f32), found: Clearance) {
        let lasts = |frames: u32| {
            let seconds = f64::from(frames) / case.query.baked.graph().frame_rate();
            case.situation.wait + seconds as f32 >= until + AHEAD
        };
        let beginnings = case.moves.beginnings(path);
        let shortest = beginnings.take_while(|&(_, frames)| lasts(frames)).last();
        // What a path is continued by is its own.
        let beginning = shortest.map_or(path, |(beginning, _)| beginning);
        self.known.insert(beginning, found);
    }
}
