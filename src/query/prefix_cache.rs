//! Test results that moves with a common prefix share: moves that begin with the same edges have the same hits until the prefix ends.

use rustc_hash::FxHashMap;

use super::clearance::{Clearance, SAMPLE_RATE};
use super::evaluation_input::EvaluationInput;
use super::moves::MoveId;
use crate::maps::BodyTrack;

/// Results by prefix. The memory is kept from one query to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct PrefixCache {
    results: FxHashMap<MoveId, Clearance>,
}

/// Maximum time from the time of a test's result to the last sample that the test reads, in seconds: to the end of the next interval.
const AHEAD: f32 = (2 * BodyTrack::INTERVAL + 1) as f32 / SAMPLE_RATE;

impl PrefixCache {
    pub(super) fn clear(&mut self) {
        self.results.clear();
    }

    /// The result of a move with a known prefix. Otherwise runs the test, and stores a hit for the shortest prefix that decides it.
    pub(super) fn get_or_test(
        &mut self,
        input: &EvaluationInput<'_>,
        index: usize,
        test: impl FnOnce() -> Clearance,
    ) -> Clearance {
        let Some(path) = input.move_of(index) else {
            return test();
        };
        let known = input
            .state
            .moves
            .prefixes(path)
            .find_map(|(prefix, _)| self.results.get(&prefix).copied());
        known.unwrap_or_else(|| {
            let result = test();
            if !result.is_clean() {
                let prefix = shortest_prefix(input, path, result.time + AHEAD);
                self.results.insert(prefix, result);
            }
            result
        })
    }
}

/// The shortest prefix that lasts until `time`, in seconds since the query, or the whole path if it ends earlier.
fn shortest_prefix(input: &EvaluationInput<'_>, path: MoveId, time: f32) -> MoveId {
    let frame_rate = input.query.baked.graph().frame_rate();
    let lasts = |frames: u32| {
        let seconds = f64::from(frames) / frame_rate;
        input.state.request.wait + seconds as f32 >= time
    };
    let prefixes = input.state.moves.prefixes(path);
    let shortest = prefixes.take_while(|&(_, frames)| lasts(frames)).last();
    // The motion after the end of a path belongs to that path alone.
    shortest.map_or(path, |(prefix, _)| prefix)
}
