//! Which paths from a node could answer the attack?
//!
//! Source: Masaoka & Oshita, sections 3.2 and 5.1: every path within a time horizon. Differs: a
//! graph of real motion has millions of them within two seconds, nearly all of them different
//! routes to the same answer. What matters of a path is which evasion starts when, where and facing
//! where, and how much of the way can be retimed; so of paths that are alike in all of that one is
//! kept, and what a limit drops is counted.

use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};

use super::retime::{Durations, RateSettings};
use crate::graph::{EdgeId, NodeId};
use crate::math::Rigid2;
use crate::region::BakedGraph;

/// How far and how wide the search goes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnumerateSettings {
    /// Paths last at most this long at rate 1 until their evasion starts, seconds. Default 2.
    pub horizon: f32,
    /// Paths to the same node at the same time are alike when they end in one cell of a grid with
    /// this side, metres; 0.0001 at least. Default 0.05.
    pub alike_distance: f32,
    /// And when their headings lie in one cell of this size, radians; 0.0001 at least. Default 5°.
    pub alike_angle: f32,
    /// Most paths that are followed at a time on the way to an evasion. Default 256.
    pub evasion_width: usize,
    /// Most paths that are followed at a time where any motion will do. Default 64.
    pub plain_width: usize,
    /// Most candidates that end in an evasion, those first whose rate is nearest to 1. Default 256.
    pub evasion_candidates: usize,
    /// Most candidates without an evasion. Default 64.
    pub plain_candidates: usize,
}

impl Default for EnumerateSettings {
    fn default() -> Self {
        Self {
            horizon: 2.0,
            alike_distance: 0.05,
            alike_angle: 5f32.to_radians(),
            evasion_width: 256,
            evasion_candidates: 256,
            plain_width: 64,
            plain_candidates: 64,
        }
    }
}

/// A path that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPath {
    /// From the start node to the evasion's start, or to the end of the attack where there is no
    /// evasion.
    pub edges: Vec<EdgeId>,
    /// Position in [`BakedGraph::evasions`] of the evasion that follows; `None` for a path that
    /// only moves.
    pub evasion: Option<usize>,
    /// Of `edges`.
    pub durations: Durations,
    /// Takes the space of the clip in which `edges` end to that of the start node's clip.
    pub to_start: Rigid2,
}

/// How the search went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SearchReport {
    /// Paths that were followed.
    pub followed: usize,
    /// Paths that were not followed since an alike one was.
    pub alike: usize,
    /// Paths that a limit of the settings cut off.
    pub cut: usize,
}

impl std::ops::AddAssign for SearchReport {
    fn add_assign(&mut self, other: Self) {
        self.followed += other.followed;
        self.alike += other.alike;
        self.cut += other.cut;
    }
}

/// All paths from `start` to an evasion that some rate within the limits can bring to start after
/// `available` seconds.
#[must_use]
pub fn paths_to_evasions(
    baked: &BakedGraph,
    start: NodeId,
    available: f32,
    (settings, rates): (&EnumerateSettings, &RateSettings),
) -> (Vec<FoundPath>, SearchReport) {
    let fps = baked.graph().frame_rate() as f32;
    let budget = (available + rates.tolerance) * fps;
    let limit = (settings.horizon * fps).min(budget * rates.fastest);
    let mut search = Search::new(baked, settings, settings.evasion_width, Alike::Exact);
    let mut paths = Vec::new();
    search.run(start, limit, |search, index| {
        let state = search.states[index];
        let node = state.node;
        let evasion = baked.graph().edges_from(node).find_map(|edge| {
            baked
                .evasions()
                .binary_search_by_key(&edge, |evasion| evasion.edge)
                .ok()
        });
        if evasion.is_some() {
            paths.push(search.path(index, evasion));
        }
        // Played as fast as it may be, can the rest still be in time?
        let hurried =
            |frames: u32, faster: u32| (frames - faster) as f32 + faster as f32 / rates.fastest;
        let wait = baked
            .frames_to_evasion(node)
            .map_or(f32::INFINITY, |wait| wait as f32 / rates.fastest);
        if hurried(state.frames, state.faster) + wait <= budget {
            Follow::On
        } else {
            Follow::No
        }
    });
    (paths, search.report)
}

/// Paths from `start` that last `seconds`, whatever they play, as different from each other as the
/// limits allow. The first is what would be played without an attack.
#[must_use]
pub fn plain_paths(
    baked: &BakedGraph,
    start: NodeId,
    seconds: f32,
    settings: &EnumerateSettings,
) -> (Vec<FoundPath>, SearchReport) {
    let frames = (seconds * baked.graph().frame_rate() as f32)
        .ceil()
        .max(1.0);
    let mut search = Search::new(baked, settings, settings.plain_width, Alike::Roughly);
    let mut ends = Vec::new();
    search.run(start, f32::INFINITY, |search, index| {
        if search.states[index].frames as f32 >= frames {
            ends.push(index);
            Follow::No
        } else {
            Follow::On
        }
    });
    // By how far they lead, so that even steps through the list keep near ones and far ones.
    let travelled = |&index: &usize| search.ground(index).distance(search.ground(0));
    ends.sort_by(|a, b| travelled(a).total_cmp(&travelled(b)));
    let kept = evenly(&ends, settings.plain_candidates.saturating_sub(1));
    let mut report = search.report;
    report.cut += ends.len() - kept.len();
    let natural = natural_path(baked, start, frames as u32);
    let others = kept
        .into_iter()
        .map(|index| search.path(index, None))
        .filter(|path| path.edges != natural.edges);
    let paths = std::iter::once(natural.clone()).chain(others).collect();
    (paths, report)
}

fn natural_path(baked: &BakedGraph, start: NodeId, frames: u32) -> FoundPath {
    let graph = baked.graph();
    let mut path = FoundPath {
        edges: Vec::new(),
        evasion: None,
        durations: Durations::default(),
        to_start: Rigid2::IDENTITY,
    };
    let (mut node, mut played) = (start, 0);
    while played < frames {
        let edge = graph.natural_edge(node);
        path.edges.push(edge);
        path.durations.total += graph.seconds(edge);
        path.to_start = path.to_start * graph.clip_change(edge);
        played += graph.edge(edge).frames;
        node = graph.edge(edge).to;
    }
    path
}

/// Which stretch of length `side` a value lies in. Places and headings in one cell count as alike.
pub(super) fn cell(value: f32, side: f32) -> i32 {
    /// Of a side: with none at all everything would be infinitely far, and so all in one cell.
    const SHORTEST: f32 = 1e-4;
    (value / side.max(SHORTEST)).floor() as i32
}

/// At most `count` of `all`, evenly spread.
fn evenly<T: Copy>(all: &[T], count: usize) -> Vec<T> {
    if all.len() <= count {
        return all.to_vec();
    }
    (0..count).map(|i| all[i * all.len() / count]).collect()
}

/// Whether a path is followed beyond its end.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Follow {
    On,
    No,
}

/// What makes two paths alike, beside where they lead.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Alike {
    /// The same node at the same time, with nearly the same retimable share.
    Exact,
    /// Nearly the same posture at nearly the same time.
    Roughly,
}

/// The end of a path, linked to the path that it extends.
#[derive(Clone, Copy)]
struct State {
    node: NodeId,
    frames: u32,
    faster: u32,
    slower: u32,
    to_start: Rigid2,
    before: u32,
    edge: EdgeId,
}

const NO_STATE: u32 = u32::MAX;

struct Search<'a> {
    baked: &'a BakedGraph,
    settings: &'a EnumerateSettings,
    width: usize,
    alike: Alike,
    states: Vec<State>,
    /// Positions in `states`, by frames since the start.
    layers: Vec<Vec<u32>>,
    seen: FxHashSet<[i32; 7]>,
    report: SearchReport,
}

impl<'a> Search<'a> {
    fn new(
        baked: &'a BakedGraph,
        settings: &'a EnumerateSettings,
        width: usize,
        alike: Alike,
    ) -> Self {
        Self {
            baked,
            settings,
            width,
            alike,
            states: Vec::new(),
            layers: Vec::new(),
            seen: FxHashSet::default(),
            report: SearchReport::default(),
        }
    }

    /// Follows paths in the order of their time, up to `limit` frames. `arrive` is called at each
    /// path's end: the width limits how many of those that it lets go on do, never which ends it is
    /// told of.
    fn run(&mut self, start: NodeId, limit: f32, mut arrive: impl FnMut(&Self, usize) -> Follow) {
        let to_start = Rigid2::IDENTITY;
        let start = State {
            node: start,
            frames: 0,
            faster: 0,
            slower: 0,
            to_start,
            before: NO_STATE,
            edge: EdgeId(0),
        };
        self.states.push(start);
        self.layers.push(vec![0]);
        let mut time = 0;
        while time < self.layers.len() {
            let mut open = std::mem::take(&mut self.layers[time]);
            open.retain(|&index| arrive(self, index as usize) == Follow::On);
            let followed = evenly(&open, self.width);
            self.report.cut += open.len() - followed.len();
            self.report.followed += followed.len();
            for index in followed {
                self.extend(index, limit);
            }
            time += 1;
        }
    }

    fn extend(&mut self, index: u32, limit: f32) {
        let graph = self.baked.graph();
        let state = self.states[index as usize];
        for edge in graph.edges_from(state.node) {
            let length = graph.edge(edge).frames;
            if (state.frames + length) as f32 > limit {
                continue;
            }
            let retimable = self.baked.retimable(edge);
            let next = State {
                node: graph.edge(edge).to,
                frames: state.frames + length,
                faster: state.faster + if retimable.faster { length } else { 0 },
                slower: state.slower + if retimable.slower { length } else { 0 },
                to_start: state.to_start * graph.clip_change(edge),
                before: index,
                edge,
            };
            if !self.seen.insert(self.key(&next)) {
                self.report.alike += 1;
                continue;
            }
            let time = next.frames as usize;
            if self.layers.len() <= time {
                self.layers.resize(time + 1, Vec::new());
            }
            self.layers[time].push(self.states.len() as u32);
            self.states.push(next);
        }
    }

    /// Equal for paths that are alike.
    fn key(&self, state: &State) -> [i32; 7] {
        let node = self.baked.graph().node(state.node);
        let root = self
            .baked
            .graph()
            .clip(node.clip)
            .sample_root(node.frame as f32);
        let place = state.to_start.point(root);
        let at = |metres: f32, radians: f32| {
            [
                cell(place.x, metres),
                cell(place.z, metres),
                cell(state.to_start.heading(), radians),
            ]
        };
        let (clip, frame, frames) = (node.clip.0 as i32, node.frame as i32, state.frames as i32);
        match self.alike {
            Alike::Exact => {
                let [x, z, turn] = at(self.settings.alike_distance, self.settings.alike_angle);
                // A fifth of a second more or less that can be retimed makes a different path, and
                // so does having anything to retime at all.
                let fifth = ((self.baked.graph().frame_rate() / 5.0) as u32).max(1);
                let [faster, slower] = [state.faster, state.slower].map(|frames| match frames {
                    0 => -1,
                    some => (some / fifth) as i32,
                });
                [state.node.0 as i32, frames, x, z, turn, faster, slower]
            }
            Alike::Roughly => {
                let [x, z, turn] = at(
                    2.0 * self.settings.alike_distance,
                    3.0 * self.settings.alike_angle,
                );
                [clip, frame / 5, frames / 5, x, z, turn, 1]
            }
        }
    }

    fn ground(&self, index: usize) -> glam::Vec2 {
        let state = &self.states[index];
        let node = self.baked.graph().node(state.node);
        let root = state.to_start.point(
            self.baked
                .graph()
                .clip(node.clip)
                .sample_root(node.frame as f32),
        );
        glam::Vec2::new(root.x, root.z)
    }

    fn path(&self, end: usize, evasion: Option<usize>) -> FoundPath {
        let end = self.states[end];
        let mut edges = Vec::new();
        let mut state = end;
        while state.before != NO_STATE {
            edges.push(state.edge);
            state = self.states[state.before as usize];
        }
        edges.reverse();
        let seconds = |frames: u32| (f64::from(frames) / self.baked.graph().frame_rate()) as f32;
        let durations = Durations {
            total: seconds(end.frames),
            faster: seconds(end.faster),
            slower: seconds(end.slower),
        };
        FoundPath {
            edges,
            evasion,
            durations,
            to_start: end.to_start,
        }
    }
}
