//! Promise: a query that was paused between its halves ends as one that was not; a context that has served another one since
//! says so.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_testing as common;

use common::small::small;
use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::SphereKey;
use sabaki::math::Rigid2;
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Attack, Judging, Query, QueryContext, QuerySettings, Verdict};

fn attack(x: f32) -> Attack {
    let key = |t, x| SphereKey {
        t,
        center: Vec3::new(x, 0.9, 0.0),
        radius: 0.1,
    };
    Attack::new(vec![vec![key(0.9, x), key(1.1, -x)]]).unwrap()
}

#[test]
fn a_paused_query_ends_as_if_it_had_not_been() {
    let (baked, settings) = (small(), QuerySettings::default());
    let query = Query::new(baked, &settings);
    let mut paused_at = 0;
    for edge in 0..baked.graph().edges().len().min(40) {
        let playhead = Playhead::at(baked.graph(), EdgeId(edge as u32), 0.0, Rigid2::IDENTITY);
        let attack = attack(1.0);
        let (mut context, mut overlaps) = (QueryContext::default(), Vec::new());
        let (mut straight, mut paused) = (Answer::default(), Answer::default());
        let mut prepared = query.prepare(playhead, &attack, &mut context);
        loop {
            cpu::count(&prepared.cull_input(), &mut overlaps);
            match prepared.decide(&overlaps, Judging::Needed, &mut straight) {
                Verdict::Answered => break,
                Verdict::Widened(wider) => prepared = wider,
            }
        }
        let mut prepared = query.prepare(playhead, &attack, &mut context);
        loop {
            cpu::count(&prepared.cull_input(), &mut overlaps);
            let pause = prepared.pause();
            paused_at += 1;
            let resumed = query.resume(pause, &attack, &mut context).unwrap();
            match resumed.decide(&overlaps, Judging::Needed, &mut paused) {
                Verdict::Answered => break,
                Verdict::Widened(wider) => prepared = wider,
            }
        }
        assert_eq!(
            format!("{straight:?}"),
            format!("{paused:?}"),
            "edge {edge}"
        );
    }
    assert!(paused_at > 3);
}

#[test]
fn a_context_serves_one_query_at_a_time() {
    let (baked, settings) = (small(), QuerySettings::default());
    let query = Query::new(baked, &settings);
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let (first, second) = (attack(1.0), attack(0.5));
    let mut context = QueryContext::default();
    let one = query.prepare(playhead, &first, &mut context).pause();
    let two = query.prepare(playhead, &second, &mut context).pause();
    assert!(query.resume(one, &first, &mut context).is_none());
    assert!(query.resume(two, &second, &mut context).is_some());
}
