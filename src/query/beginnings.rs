//! What moves have in common: those that begin alike are hit alike, for as long as they do.

use rustc_hash::FxHashMap;

use super::case::Case;
use super::clearance::{Clearance, SAMPLE_RATE};
use super::moves::MoveId;
use crate::maps::BodyTrack;

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

    /// Of a move what was noted of one that begins alike; else what `test` finds, noted for all that are like it `until` the
    /// moment that decides it, seconds since the query, if there is one.
    pub(super) fn of_or(
        &mut self,
        case: &Case<'_>,
        index: usize,
        (test, until): (
            impl FnOnce() -> Clearance,
            impl FnOnce(&Clearance) -> Option<f32>,
        ),
    ) -> Clearance {
        let Some(path) = case.move_of(index) else {
            return test();
        };
        let mut beginnings = case.moves.beginnings(path);
        let known = beginnings.find_map(|(beginning, _)| self.known.get(&beginning).copied());
        known.unwrap_or_else(|| {
            let found = test();
            if let Some(until) = until(&found) {
                self.note(case, (path, until), found);
            }
            found
        })
    }

    fn note(&mut self, case: &Case<'_>, (path, until): (MoveId, f32), found: Clearance) {
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
