//! A path is filed in the cells that the body vacates, and look-ups equal a naive search of all
//! cells. A query loses no result if the grid lacks an entry.

use std::collections::BTreeSet;

use glam::Vec3;
use sabaki::maps::{CellColumn, NodePath, TouchedCells};
use sabaki::query::{Enumerate, Evaluation, Query, QueryContext, QuerySettings, Source};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::throw::throws;
use sabaki_fixtures::with;

use super::nodes;

type Cell = (i32, i32, u32);

fn cells_of(columns: impl Iterator<Item = CellColumn>) -> BTreeSet<Cell> {
    let bits = |c: CellColumn| (0..64).filter(move |bit| c.heights >> bit & 1 == 1);
    columns
        .flat_map(|c| bits(c).map(move |bit| (c.x, c.z, bit)))
        .collect()
}

/// How deep a point is inside the body at one sample of an evasion, metres; negative outside.
fn depth(path: &NodePath, tick: usize, point: Vec3) -> f32 {
    let baked = embedded();
    let local = path.placement.inverse().point(point);
    let track = baked.track(path.goal as usize);
    let spheres = baked.body().spheres.iter().enumerate();
    spheres
        .map(|(index, sphere)| sphere.radius - track.centre(tick, index).distance(local))
        .fold(f32::NEG_INFINITY, f32::max)
}

#[test]
fn a_path_is_filed_where_the_body_was_and_is_no_more() {
    let baked = embedded();
    let cell = baked.grid().cell();
    // Half a cell's diagonal, and what filing by whole degrees and half cells moves a limb.
    let slack = 0.5 * 3f32.sqrt() * cell + 0.06;
    let mut filed_cells = 0;
    for node in nodes(baked, 101) {
        for path in baked.paths().from_node(node).iter().step_by(53) {
            let evasion = baked.evasions()[path.goal as usize];
            let track = baked.track(path.goal as usize);
            let seconds = baked.graph().seconds(evasion.edge);
            let [start, end] = [0.0, seconds].map(|seconds| track.nearest_tick(seconds));
            for (x, z, bit) in cells_of(baked.grid().cells(path)) {
                let column = CellColumn {
                    x,
                    z,
                    heights: 1 << bit,
                };
                let middle = column.middle(cell);
                assert!(depth(path, start, middle) > -slack, "{column:?} was free");
                assert!(depth(path, end, middle) < slack, "{column:?} is occupied");
                filed_cells += 1;
            }
            assert!(filed_cells > 0);
        }
    }
    assert!(filed_cells > 1000, "{filed_cells}");
}

#[test]
fn looking_up_columns_is_looking_at_every_cell() {
    let baked = embedded();
    let cell = baked.grid().cell();
    let (mut hits, mut misses) = (0, 0);
    for throw in throws(baked, 19, 30) {
        let node = throw.playhead.next_node(baked.graph());
        let mut touched = TouchedCells::default();
        for sphere in throw.attack.spheres() {
            sphere.for_each_step(|ball| touched.add(ball, cell, 3.0));
        }
        let columns = touched.merge();
        let attack = cells_of(columns.iter().copied());
        for path in baked.paths().from_node(node).iter().step_by(7) {
            let filed = cells_of(baked.grid().cells(path));
            let meets = !filed.is_disjoint(&attack);
            assert_eq!(baked.grid().vacates_any(path, columns), meets);
            hits += usize::from(meets);
            misses += usize::from(!meets);
        }
    }
    assert!(hits > 100 && misses > 100, "{hits} and {misses}");
}

#[test]
fn a_narrower_lookup_finds_a_part_of_a_wider_one_and_none_loses_an_answer() {
    let baked = embedded();
    let settings = |enumerate| with(|s: &mut QuerySettings| s.enumerate = enumerate);
    let (mut context, mut from_grid) = (QueryContext::default(), 0);
    let wide = settings(Enumerate::Whole);
    for (index, throw) in throws(baked, 23, 40).enumerate() {
        let whole = answer_throw(&Query::new(baked, &wide), &throw, Evaluation::Lazy);
        let mut found = Vec::new();
        for enumerate in [
            Enumerate::NearestCell,
            Enumerate::NearestFiledCell,
            Enumerate::TouchedCells,
        ] {
            let settings = settings(enumerate);
            let query = Query::new(baked, &settings);
            let answer = answer_throw(&query, &throw, Evaluation::Lazy);
            let both = [answer.avoided, whole.avoided];
            assert_eq!(both[0], both[1], "{enumerate:?}, attack {index}");
            from_grid += usize::from(answer.source == Source::Grid);
            let session = query.start(throw.request(), &mut context);
            if session.source() == Source::Grid {
                found.push(session.cull_input().candidates.len());
            }
        }
        assert!(found.is_sorted(), "{found:?}");
    }
    assert!(from_grid > 20, "{from_grid}");
}
