//! The path table equals a naive search along all edges, up to similar paths. Each path is
//! connected, has the stated length and retimable share, and ends at the stated place.

use std::collections::BTreeSet;

use sabaki::graph::NodeId;
use sabaki::maps::{BakeSettings, BakedGraph, MapGrid, NodePath, PathId, PathSettings};
use sabaki::math::Rigid2;
use sabaki_fixtures::baked::{bake, embedded};
use sabaki_fixtures::small::small;
use sabaki_fixtures::with;

use super::{nodes, play};

/// Everything that the table may know of a path: its evasion, frames, retimable frames and place.
type Facts = (u32, u32, u32, u32, [i32; 3]);

fn facts(path: &NodePath) -> Facts {
    let [frames, faster, slower] = [path.frames, path.faster, path.slower].map(u32::from);
    let cell = path.alike_cell(0.05, 5f32.to_radians());
    (path.goal, frames, faster, slower, cell)
}

/// A bake with few maps and without entries, which paths do not depend on.
fn with_paths(baked: &BakedGraph, paths: PathSettings) -> BakedGraph {
    let settings = BakeSettings {
        maps: MapGrid::PAPER,
        without_entries: true,
        threads: paths.threads,
        paths,
        ..BakeSettings::default()
    };
    bake(baked.graph().clone(), settings)
}

/// All paths from a node, by following every edge.
fn search(baked: &BakedGraph, node: NodeId, longest: u32, found: &mut BTreeSet<Facts>) {
    let graph = baked.graph();
    let start = baked.placement(node);
    let some = baked.paths().path(PathId(0));
    let mut open = vec![(node, Rigid2::IDENTITY, [0u32; 3])];
    while let Some((node, to_start, [frames, faster, slower])) = open.pop() {
        let starting = (0..).zip(baked.evasions());
        for (index, _) in starting.filter(|(_, e)| graph.edge(e.edge).from == node) {
            let mut here = some;
            here.placement = start.inverse() * to_start * baked.placement(node);
            let cell = here.alike_cell(0.05, 5f32.to_radians());
            found.insert((index, frames, faster, slower, cell));
        }
        for edge in graph.edges_from(node) {
            let length = graph.edge(edge).frames;
            if frames + length <= longest {
                let retimable = baked.retimable(edge);
                let of = |changes: bool| if changes { length } else { 0 };
                open.push((
                    graph.edge(edge).to,
                    to_start * graph.clip_change(edge),
                    [
                        frames + length,
                        faster + of(retimable.faster),
                        slower + of(retimable.slower),
                    ],
                ));
            }
        }
    }
}

#[test]
fn a_search_along_all_edges_finds_no_other_path() {
    let settings = with(|s: &mut PathSettings| (s.horizon, s.most) = (1.4, 1_000_000));
    let baked = with_paths(small(), settings);
    let longest = (settings.horizon * baked.graph().frame_rate() as f32).round() as u32;
    let (mut all, mut kept) = (0, 0);
    for node in nodes(&baked, 1) {
        let mut found = BTreeSet::new();
        search(&baked, node, longest, &mut found);
        let table: BTreeSet<Facts> = baked.paths().from_node(node).iter().map(facts).collect();
        assert!(table.is_subset(&found), "{node:?}: a path that is none");
        // What the table lacks is alike to what it has: same evasion and time, and a place that a
        // merged beginning has moved by a cell at most.
        for (evasion, frames, _, _, cell) in &found {
            let near = |other: &Facts| {
                let turns = (other.4[2] - cell[2]).rem_euclid(72);
                (other.0, other.1) == (*evasion, *frames)
                    && (other.4[0] - cell[0]).abs() <= 3
                    && (other.4[1] - cell[1]).abs() <= 3
                    && (turns <= 3 || turns >= 69)
            };
            assert!(table.iter().any(near), "{node:?}: {frames} frames missing");
        }
        (all, kept) = (all + found.len(), kept + table.len());
    }
    assert_eq!(baked.paths().report().cut, 0);
    assert!(kept > 100 && all >= kept, "{kept} of {all}");
    let most = 3;
    let few = with_paths(small(), PathSettings { most, ..settings });
    assert!(few.paths().report().cut > 0);
}

#[test]
fn a_path_leads_where_it_says() {
    let (baked, mut checked) = (embedded(), 0);
    let (graph, table) = (baked.graph(), baked.paths());
    for node in nodes(baked, 37) {
        let paths = table.from_node(node);
        assert!(paths.is_sorted_by_key(|path| path.frames));
        for (id, path) in table.ids(node).zip(paths).step_by(11) {
            let edges: Vec<_> = table.edges(id).collect();
            let mut at = node;
            for &edge in &edges {
                assert_eq!(graph.edge(edge).from, at);
                at = graph.edge(edge).to;
            }
            let evasion = baked.evasions()[path.goal as usize];
            assert_eq!(graph.edge(evasion.edge).from, at);
            let frames: u32 = edges.iter().map(|&edge| graph.edge(edge).frames).sum();
            assert_eq!(frames, u32::from(path.frames));
            checked += usize::from(ends_at(baked, node, id));
        }
    }
    assert!(checked > 200, "{checked}");
}

/// Plays a path and looks where it ends; false for one without an edge.
fn ends_at(baked: &BakedGraph, node: NodeId, id: PathId) -> bool {
    let path = baked.paths().path(id);
    if path.frames == 0 {
        return false;
    }
    let evasion = baked.evasions()[path.goal as usize].edge;
    let edges: Vec<_> = baked.paths().edges(id).chain([evasion]).collect();
    let motion = play(baked, node, &edges);
    let seconds = f32::from(path.frames) / baked.graph().frame_rate() as f32;
    let end = motion.playhead(baked.graph(), seconds + 1e-3);
    let apart = path.placement.inverse() * end.placement(baked.graph());
    let is_there = apart.ground().length() < 0.02 && apart.heading().abs() < 0.02;
    assert!(is_there, "{apart:?}");
    true
}
