//! Promise: drawing up a query's maps, counting on the CPU and whole queries allocate nothing, from the second time on.

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::SphereKey;
use sabaki::math::Rigid2;
use sabaki::query::cull::cpu::Culler;
use sabaki::query::{Answer, Attack, Enumerate, Query, QueryContext, QuerySettings, Request};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::small::small;
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};

/// An attack that comes from a side, at a time.
fn attack(from: f32, t: f32) -> Attack {
    let key = |t, x: f32| SphereKey {
        t,
        center: Vec3::new(x, 0.9, 0.1),
        radius: 0.15,
    };
    Attack::new(vec![vec![key(t, from), key(t + 0.4, -from)]]).unwrap()
}

#[test]
fn counting_allocates_nothing() {
    let settings = QuerySettings {
        enumerate: Enumerate::Whole,
        ..QuerySettings::default()
    };
    let query = Query::new(small(), &settings);
    let playhead = Playhead::at(small().graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let attacks: Vec<Attack> = (0..12)
        .map(|index| attack(1.5 - 0.02 * index as f32, 0.6 + 0.1 * index as f32))
        .collect();
    let mut context = QueryContext::default();
    let (mut culler, mut overlaps) = (Culler::default(), Vec::new());
    let (mut candidates, mut met) = (0, 0);
    for round in 0..2 {
        for attack in &attacks {
            let before = allocations();
            let mut session = query.start(Request::new(playhead, attack), &mut context);
            session.draw_outer_maps();
            culler.count(&session.cull_input(), &mut overlaps);
            let after = allocations();
            candidates += overlaps.len();
            met += overlaps.iter().filter(|overlap| overlap.outer > 0).count();
            assert!(
                round == 0 || after == before,
                "{} allocations",
                after - before
            );
        }
    }
    assert!(candidates > 10 && met > 0, "{candidates} {met}");
}

#[test]
fn a_query_allocates_nothing() {
    let baked = embedded();
    let throws: Vec<Throw> = (0..60)
        .map(|index| throw(baked, &ThrowSettings::default(), 3, index).unwrap())
        .collect();
    for enumerate in [
        Enumerate::TouchedCells,
        Enumerate::NearestCell,
        Enumerate::Whole,
    ] {
        let settings = QuerySettings {
            enumerate,
            list_late: true,
            ..QuerySettings::default()
        };
        let query = Query::new(baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let mut round = || {
            let before = allocations();
            for throw in &throws {
                query.answer(throw.request(), &mut context, &mut answer);
            }
            allocations() - before
        };
        assert!(round() > 0, "the counter counts");
        assert_eq!(round(), 0, "{enumerate:?}");
    }
}
