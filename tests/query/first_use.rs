//! Promise: what a large graph computes when it is first needed changes no answer, and once it is prepared a query that has memory
//! from other queries allocates nothing.

use std::path::Path;
use std::sync::OnceLock;

use sabaki::anim::Event;
use sabaki::archive;
use sabaki::graph::NodeId;
use sabaki::maps::{BakedGraph, PathId, PathSettings};
use sabaki::query::{Answer, Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::small::{small_bake, small_evasion};
use sabaki_fixtures::throw::{Throw, throws};
use sabaki_fixtures::with;

/// A graph of more evasions than are prepared by loading.
fn built() -> &'static BakedGraph {
    static BUILT: OnceLock<BakedGraph> = OnceLock::new();
    BUILT.get_or_init(|| {
        let event = |index: usize| small_evasion(index % 4, 0.5 + 1.3 * (index / 4) as f64);
        let events: Vec<Event> = (0..40).map(event).collect();
        let seeds = [0.3, 0.4, 1.1, 0.6];
        let baked = small_bake(450, &seeds, &events, PathSettings::default());
        assert!(baked.evasions().len() > 32);
        baked
    })
}

fn bytes() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| archive::to_bytes(built()).unwrap())
}

fn loaded() -> BakedGraph {
    archive::from_bytes(bytes(), Path::new("many.sabaki")).unwrap()
}

fn prepared() -> BakedGraph {
    let baked = loaded();
    baked.prepare();
    baked
}

#[test]
fn answers_do_not_depend_on_what_is_prepared() {
    let (lazy, ready) = (loaded(), prepared());
    assert_eq!(lazy, ready);
    let throws: Vec<Throw> = throws(&ready, 3, 40).collect();
    let settings = with(|s: &mut QuerySettings| s.enumerate = Enumerate::TouchedCells);
    let answers = |baked: &BakedGraph| -> Vec<String> {
        let query = Query::new(baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let of = |throw: &Throw| {
            query.answer(throw.request(), &mut context, &mut answer);
            format!("{:?} {:?}", answer.candidates, answer.clearance())
        };
        throws.iter().map(of).collect()
    };
    // Several threads that need the same at the same time find the same.
    let [a, b, c] = std::thread::scope(|scope| {
        let own = [&lazy, &lazy, &ready].map(|baked| scope.spawn(|| answers(baked)));
        own.map(|thread| thread.join().unwrap())
    });
    assert!(a == c && b == c);
    assert_eq!(archive::to_bytes(&lazy).unwrap(), bytes());
}

#[test]
fn paths_that_are_restored_are_those_of_the_bake() {
    let expected = built().paths();
    let nodes = built().graph().nodes().len() as u32;
    let all: Vec<PathId> = (0..nodes)
        .flat_map(|node| expected.ids(NodeId(node)))
        .collect();
    assert!(all.len() > 1000, "{} paths", all.len());
    // Whichever of them is asked for first.
    for stride in [1, 7, 101] {
        let lazy = loaded();
        for first in 0..stride {
            for &id in all.iter().skip(first).step_by(stride) {
                assert_eq!(lazy.paths().path(id), expected.path(id));
            }
        }
    }
    for baked in [loaded(), prepared()] {
        for node in (0..nodes).map(NodeId) {
            assert_eq!(baked.paths().from_node(node), expected.from_node(node));
        }
    }
}

#[test]
fn after_preparing_a_query_allocates_nothing_wherever_it_begins() {
    let ready = prepared();
    let throws: Vec<Throw> = throws(&ready, 3, 40).collect();
    let settings = QuerySettings::default();
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    let mut round = |baked: &BakedGraph| {
        let query = Query::new(baked, &settings);
        let before = allocations();
        for throw in &throws {
            query.answer(throw.request(), &mut context, &mut answer);
        }
        allocations() - before
    };
    // The context gets its memory from another graph of the same contents.
    assert!(round(&ready) > 0);
    let (lazy, ready) = (loaded(), prepared());
    assert_eq!(round(&ready), 0);
    assert!(round(&lazy) > 0, "the counter counts");
    assert_eq!(round(&lazy), 0);
}
