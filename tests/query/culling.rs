//! Promise: what the maps remove is hit, and what they prove clean is clean.

use sabaki::maps::{BakedGraph, MapGrid, Section};
use sabaki::query::cull::cpu::Culler;
use sabaki::query::{Answer, Enumerate, Evaluation, Query, QueryContext, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::captures::fight;
use sabaki_fixtures::throw::throws;

use super::{of_edges, unwarped};

/// What the maps said of candidates, against the exact test.
#[derive(Debug, Default)]
struct Tally {
    hit: usize,
    hit_removed: usize,
    clean: usize,
    clean_removed: usize,
    /// By the outer maps.
    clean_proven: usize,
    hit_proven_clean: usize,
    open: usize,
}

fn tally(baked: &BakedGraph, attacks: u64) -> Tally {
    let mut settings = unwarped();
    settings.enumerate = Enumerate::Whole;
    let (mut culler, mut overlaps) = (Culler::default(), Vec::new());
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut tally = Tally::default();
    for throw in throws(baked, 23, attacks) {
        let mut request = throw.request();
        request.evaluation = Evaluation::Exhaustive;
        let mut session = Query::new(baked, &settings).start(request, &mut context);
        session.draw_outer_maps();
        culler.count(&session.cull_input(), &mut overlaps);
        let open: Vec<bool> = (session.cull_input().candidates.iter())
            .map(|candidate| candidate.open)
            .collect();
        let _ = session.submit(&overlaps, &mut answer);
        for (index, (overlap, open)) in overlaps.iter().zip(open).enumerate() {
            let clean = answer.candidates[index].clearance.unwrap().metres >= 0.0;
            let (removed, proven) = (overlap.body > 0, overlap.outer == 0 && !open);
            tally.open += usize::from(open);
            if clean {
                tally.clean += 1;
                tally.clean_removed += usize::from(removed);
                tally.clean_proven += usize::from(proven);
            } else {
                tally.hit += 1;
                tally.hit_removed += usize::from(removed);
                tally.hit_proven_clean += usize::from(proven);
            }
        }
    }
    println!("{tally:?}");
    tally
}

/// Maps that are finer in height and time than the default.
const FINE: MapGrid = MapGrid {
    slab_height: 0.05,
    section: Section::Plane,
    slices: 32,
    ..MapGrid::PAPER
};

/// Neither kind of map is ever wrong, and both are of use: the default maps remove a quarter of the hits, fine ones most.
fn is_certain(baked: &BakedGraph, attacks: u64) {
    for (tally, of_hits, of_misses) in [
        (tally(baked, attacks), 4, 20),
        (tally(&baked.with_maps(FINE).unwrap(), attacks), 2, 3),
    ] {
        assert_eq!(tally.clean_removed, 0, "a clean candidate is removed");
        assert_eq!(tally.hit_proven_clean, 0, "a hit is said to be clean");
        assert!(tally.hit > 100 && tally.clean > 100);
        assert!(of_hits * tally.hit_removed > tally.hit, "{tally:?}");
        assert!(of_misses * tally.clean_proven > tally.clean, "{tally:?}");
    }
}

#[test]
fn on_the_embedded_motions() {
    is_certain(embedded(), 200);
}

#[test]
fn the_papers_maps_are_weak_and_wrong() {
    let tally = tally(&embedded().with_maps(MapGrid::PAPER).unwrap(), 200);
    assert!(tally.hit_removed > 0 && tally.clean_removed > 0);
    assert_eq!(tally.hit_proven_clean, 0, "a hit is said to be clean");
}

/// An answer without culling is the same: what is culled is hit, and would not have been chosen.
#[test]
fn culling_changes_no_answer() {
    let settings = QuerySettings::default();
    let query = Query::new(embedded(), &settings);
    let (mut context, mut plain) = (QueryContext::default(), Answer::default());
    let mut culled = 0;
    for (index, throw) in throws(embedded(), 31, 200).enumerate() {
        query.answer(throw.request(), &mut context, &mut plain);
        let answer = answer_throw(&query, &throw, Evaluation::Lazy);
        assert_eq!(plain.chosen, answer.chosen, "throw {index}");
        assert_eq!(plain.avoided, answer.avoided, "throw {index}");
        // The samples of a test depend on whether another candidate is nearly tied.
        let [a, b] = [&plain, &answer].map(|one| one.clearance().metres);
        assert!((a - b).abs() < 1e-4, "throw {index}: {a}, {b}");
        assert_eq!(plain.counts.culled, 0);
        culled += answer.counts.culled;
    }
    assert!(culled > 100, "{culled}");
}

/// A culled candidate is tested where no other one is left, whatever the maps say.
#[test]
fn the_papers_maps_hide_no_way_out() {
    let baked = embedded().with_maps(MapGrid::PAPER).unwrap();
    let settings = of_edges();
    let query = Query::new(&baked, &settings);
    let mut reconsidered = 0;
    for (index, throw) in throws(&baked, 29, 300).enumerate() {
        let [lazy, all] = [Evaluation::Lazy, Evaluation::Exhaustive]
            .map(|evaluation| answer_throw(&query, &throw, evaluation));
        assert_eq!(lazy.avoided, all.avoided, "throw {index}");
        reconsidered += lazy.counts.reconsidered;
    }
    assert!(reconsidered > 0);
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn on_real_motion_capture() {
    is_certain(fight(), 300);
}
