//! Promise: a session that is dropped and resumed in each round ends like one that is not. A context resumes only its last session.

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::SphereKey;
use sabaki::math::Rigid2;
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request, Step};
use sabaki_fixtures::small::small;

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
        let request = Request::new(playhead, &attack);
        query
            .start(request, &mut context)
            .run_on_cpu(&mut cpu::Culler::default(), &mut straight);
        let mut waiting = query.start(request, &mut context).id();
        drop(attack);
        loop {
            let mut session = query.resume(waiting, &mut context).unwrap();
            cpu::count(&session.cull_input(), &mut overlaps);
            paused_at += 1;
            match session.submit(&overlaps, &mut paused) {
                Step::Done => break,
                Step::Recount => waiting = session.id(),
            }
        }
        assert!(query.resume(waiting, &mut context).is_none());
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
    let one = query
        .start(Request::new(playhead, &first), &mut context)
        .id();
    let two = query
        .start(Request::new(playhead, &second), &mut context)
        .id();
    assert!(query.resume(one, &mut context).is_none());
    assert!(query.resume(two, &mut context).is_some());
}
