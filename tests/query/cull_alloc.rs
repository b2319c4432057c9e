//! Promise: drawing up a query's maps and counting on the CPU allocate nothing, from the second
//! time on.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;
use sabaki_fixtures::memory as counting;

use common::small::small;
use counting::allocations;
use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::SphereKey;
use sabaki::math::Rigid2;
use sabaki::query::cull::cpu::Culler;
use sabaki::query::{Attack, Enumerate, Query, QueryContext, QuerySettings, Request};

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
