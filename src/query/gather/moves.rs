//! Moves: paths without an evasion that last as long as the attack.
//!
//! Source: Masaoka & Oshita, section 5.1: if no evasion works, every path within the horizon is a candidate. Differs: of paths that
//! lead to nearly the same posture at nearly the same place and time, only one is followed. The search follows a limited number of
//! paths at a time, evenly chosen, and counts the paths that it cuts off.

use glam::{Vec2, Vec3};
use rustc_hash::FxHashSet;

use super::candidates::{Candidate, CandidateKind, CandidateList, MoveId, SearchReport};
use crate::graph::{EdgeId, MotionGraph, NodeId};
use crate::math::{Rigid2, floor};
use crate::query::request::{ActiveRequest, Query};
use crate::query::retime::Rate;
use crate::query::settings::MoveSettings;

pub(in crate::query) fn gather_moves(
    query: Query<'_>,
    request: &ActiveRequest,
    moves: &mut MoveSearch,
    candidates: &mut CandidateList,
) {
    /// Maximum duration of the search, in seconds. Longer moves continue along the natural edges.
    const LONGEST: f32 = 4.0;
    /// Maximum number of moves if there are obstacles, because their tests cost more.
    const AMONG_OBSTACLES: usize = 24;
    let graph = query.baked.graph();
    let seconds = (request.attack.end() - request.wait).min(LONGEST);
    let to_world = request.playhead.next_clip_to_world(graph);
    let is_blocked = |root: Vec3, seconds: f32| {
        let root = to_world.point(root);
        request.removes_blocked()
            && request
                .obstacles
                .at_root(root, request.wait + seconds)
                .is_some()
    };
    let mut settings = query.settings.moves;
    if request.removes_blocked() {
        settings.candidates = settings.candidates.min(AMONG_OBSTACLES);
    }
    let add = |path| {
        candidates.list.push(Candidate {
            kind: CandidateKind::Move(path),
            rate: Rate::UNCHANGED,
        });
    };
    let report = moves.search(graph, request.node, seconds, settings, &is_blocked, add);
    let search = &mut candidates.search;
    search.followed += report.followed;
    search.alike += report.alike;
    search.cut += report.cut;
}

/// The end of a path, linked to the path that it extends.
#[derive(Clone, Copy, Debug)]
struct State {
    node: NodeId,
    frames: u32,
    to_start: Rigid2,
    /// The path without its last edge, and that edge.
    before: Option<(MoveId, EdgeId)>,
}

/// A search for moves. Its memory is kept from one search to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct MoveSearch {
    states: Vec<State>,
    /// Indices in `states`, for each number of frames since the start.
    layers: Vec<Vec<u32>>,
    seen: FxHashSet<[i32; 6]>,
    /// Paths that are long enough: distance on the ground from the start, in metres, and index in `states`.
    ends: Vec<(f32, u32)>,
    report: SearchReport,
    settings: MoveSettings,
}

/// Cell size for times, in frames.
const ALIKE_FRAMES: u32 = 5;

impl MoveSearch {
    /// Finds paths from a node that last `seconds`, as different from each other as the settings allow. Calls `found` with each, first with the
    /// path of natural edges, which is played if there is no attack.
    ///
    /// `is_blocked` returns whether the root cannot be at a position of the first clip's space at a time in seconds since the start. Paths that
    /// lead there are not followed.
    pub(crate) fn search(
        &mut self,
        graph: &MotionGraph,
        start: NodeId,
        seconds: f32,
        settings: MoveSettings,
        is_blocked: &dyn Fn(Vec3, f32) -> bool,
        mut found: impl FnMut(MoveId),
    ) -> SearchReport {
        self.clear();
        self.settings = settings;
        let frames = (seconds * graph.frame_rate() as f32).ceil().max(1.0) as u32;
        self.states.push(State {
            node: start,
            frames: 0,
            to_start: Rigid2::IDENTITY,
            before: None,
        });
        let natural = self.natural(graph, frames);
        self.place(0, 0);
        let from = ground(graph, &self.states[0]);
        let mut time = 0;
        while time < self.layers.len() {
            let open = std::mem::take(&mut self.layers[time]);
            if time as u32 >= frames {
                self.ends.extend(open.iter().map(|&state| {
                    let end = ground(graph, &self.states[state as usize]);
                    (end.distance(from), state)
                }));
            } else {
                self.report.followed += open.len().min(settings.width);
                self.report.cut += open.len().saturating_sub(settings.width);
                for index in evenly(&open, settings.width) {
                    self.extend(graph, is_blocked, index);
                }
            }
            self.layers[time] = open;
            time += 1;
        }
        found(natural);
        self.hand_out(natural, &mut found);
        self.report
    }

    /// A path and all its prefixes, the longest first, each with its duration in frames.
    pub(crate) fn prefixes(&self, path: MoveId) -> impl Iterator<Item = (MoveId, u32)> + '_ {
        let before = |at: &MoveId| Some(self.states[at.0 as usize].before?.0);
        let all = std::iter::successors(Some(path), before);
        all.map(|at| (at, self.states[at.0 as usize].frames))
    }

    /// Calls `visit` with each edge of a path, from its start on. It recurs once for each edge, of which a path has a few.
    pub(crate) fn for_each_edge(&self, path: MoveId, visit: &mut dyn FnMut(EdgeId)) {
        if let Some((before, edge)) = self.states[path.0 as usize].before {
            self.for_each_edge(before, visit);
            visit(edge);
        }
    }

    fn clear(&mut self) {
        self.states.clear();
        self.layers.iter_mut().for_each(Vec::clear);
        self.seen.clear();
        self.ends.clear();
        self.report = SearchReport::default();
    }

    fn place(&mut self, frames: u32, state: u32) {
        let time = frames as usize;
        if self.layers.len() <= time {
            self.layers.resize_with(time + 1, Vec::new);
        }
        self.layers[time].push(state);
    }

    fn natural(&mut self, graph: &MotionGraph, frames: u32) -> MoveId {
        let mut at = MoveId(0);
        while self.states[at.0 as usize].frames < frames {
            let edge = graph.natural_edge(self.states[at.0 as usize].node);
            at = self.push(graph, at, edge);
        }
        at
    }

    fn push(&mut self, graph: &MotionGraph, before: MoveId, edge: EdgeId) -> MoveId {
        let state = self.states[before.0 as usize];
        self.states.push(State {
            node: graph.edge(edge).to,
            frames: state.frames + graph.edge(edge).frames,
            to_start: state.to_start * graph.clip_change(edge),
            before: Some((before, edge)),
        });
        MoveId(self.states.len() as u32 - 1)
    }

    fn extend(&mut self, graph: &MotionGraph, is_blocked: &dyn Fn(Vec3, f32) -> bool, index: u32) {
        let node = self.states[index as usize].node;
        for edge in graph.edges_from(node) {
            let next = self.push(graph, MoveId(index), edge);
            let state = self.states[next.0 as usize];
            let seconds = (f64::from(state.frames) / graph.frame_rate()) as f32;
            if is_blocked(root(graph, &state), seconds) {
                self.states.pop();
                continue;
            }
            if self.seen.insert(key(graph, &state, &self.settings)) {
                self.place(state.frames, next.0);
            } else {
                self.states.pop();
                self.report.alike += 1;
            }
        }
    }

    /// Returns a limited number of paths, evenly spread by the distance that they travel.
    fn hand_out(&mut self, natural: MoveId, found: &mut impl FnMut(MoveId)) {
        let mut ends = std::mem::take(&mut self.ends);
        ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let most = self.settings.candidates.saturating_sub(1);
        self.report.cut += ends.len().saturating_sub(most);
        let last_edge = |(at, _): (MoveId, u32)| Some(self.states[at.0 as usize].before?.1);
        let edges = |path| self.prefixes(path).map(last_edge);
        for (_, end) in evenly(&ends, most) {
            if !edges(MoveId(end)).eq(edges(natural)) {
                found(MoveId(end));
            }
        }
        self.ends = ends;
    }
}

fn root(graph: &MotionGraph, state: &State) -> Vec3 {
    let node = graph.node(state.node);
    let root = graph.clip(node.clip).root(node.frame as usize);
    state.to_start.point(root)
}

fn ground(graph: &MotionGraph, state: &State) -> Vec2 {
    let place = root(graph, state);
    Vec2::new(place.x, place.z)
}

fn key(graph: &MotionGraph, state: &State, settings: &MoveSettings) -> [i32; 6] {
    /// Smallest cell size. With 0 all values would lie in one infinite cell.
    const SHORTEST: f32 = 1e-3;
    let cell = |value: f32, side: f32| floor(value / side.max(SHORTEST));
    let (node, place) = (graph.node(state.node), ground(graph, state));
    [
        node.clip.0 as i32,
        (node.frame / ALIKE_FRAMES) as i32,
        (state.frames / ALIKE_FRAMES) as i32,
        cell(place.x, settings.alike_distance),
        cell(place.y, settings.alike_distance),
        cell(state.to_start.heading(), settings.alike_angle),
    ]
}

/// Up to `count` elements, evenly spread.
fn evenly<T: Copy>(all: &[T], count: usize) -> impl Iterator<Item = T> + '_ {
    let kept = all.len().min(count);
    (0..kept).map(move |i| all[i * all.len() / kept.max(1)])
}
