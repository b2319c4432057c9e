use super::ask::Query;
use super::candidate::{Candidate, CandidateKind};
use super::moves::MoveSearchDesc;
use super::retime::Rate;
use super::state::QueryState;

/// The search for moves ends here, seconds. Longer moves continue along the natural edges.
const LONGEST_MOVE: f32 = 4.0;

/// Adds moves to the candidates: paths without an evasion.
pub(super) fn gather_moves(query: Query<'_>, state: &mut QueryState) {
    let QueryState {
        request,
        candidates,
        moves,
        search,
        ..
    } = state;
    let seconds = (request.attack.end() - request.wait).min(LONGEST_MOVE);
    let desc = MoveSearchDesc {
        start: request.node,
        seconds,
        settings: query.settings.moves,
    };
    *search += moves.run(query.baked.graph(), desc, |path| {
        candidates.list.push(Candidate {
            kind: CandidateKind::Move(path),
            rate: Rate::UNCHANGED,
        });
    });
}
