use glam::Vec3;

use super::ask::Query;
use super::blocked::is_sought;
use super::candidate::{Candidate, CandidateKind};
use super::moves::MoveSearchDesc;
use super::retime::Rate;
use super::state::QueryState;

/// Maximum duration of the search for moves, in seconds. Longer moves continue along the natural edges.
const LONGEST_MOVE: f32 = 4.0;

/// Maximum number of moves if there are obstacles, because their tests cost more.
const AMONG_OBSTACLES: usize = 24;

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
    let to_world = request.playhead.next_clip_to_world(query.baked.graph());
    let is_blocked = |root: Vec3, seconds: f32| {
        let root = to_world.point(root);
        is_sought(request)
            && request
                .obstacles
                .of_root(root, request.wait + seconds)
                .is_some()
    };
    let mut settings = query.settings.moves;
    if is_sought(request) {
        settings.candidates = settings.candidates.min(AMONG_OBSTACLES);
    }
    let desc = MoveSearchDesc {
        start: request.node,
        seconds,
        settings,
        is_blocked: &is_blocked,
    };
    *search += moves.run(query.baked.graph(), desc, |path| {
        candidates.list.push(Candidate {
            kind: CandidateKind::Move(path),
            rate: Rate::UNCHANGED,
        });
    });
}
