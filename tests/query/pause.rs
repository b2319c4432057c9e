//! Promise: a session that is dropped and resumed in each round ends like one that is not. A context resumes only its last session.

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::math::Rigid2;
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request, Step};
use sabaki_fixtures::small::small;
use sabaki_fixtures::throw::key;

fn attack(x: f32) -> Attack {
    let at = |t, x| key(t, Vec3::new(x, 0.9, 0.0), 0.1);
    Attack::new(vec![vec![at(0.9, x), at(1.1, -x)]]).unwrap()
}

fn playhead(edge: u32) -> Playhead {
    Playhead::at(small().graph(), EdgeId(edge), 0.0, Rigid2::IDENTITY)
}

#[test]
fn a_paused_query_ends_as_if_it_had_not_been() {
    let (baked, settings) = (small(), QuerySettings::default());
    let query = Query::new(baked, &settings);
    let mut paused_at = 0;
    for edge in 0..baked.graph().edges().len().min(40) {
        let playhead = playhead(edge as u32);
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
        let [straight, paused] = [straight, paused].map(|answer| format!("{answer:?}"));
        assert_eq!(straight, paused, "edge {edge}");
    }
    assert!(paused_at > 3);
}

#[test]
fn a_context_serves_one_query_at_a_time() {
    let (baked, settings) = (small(), QuerySettings::default());
    let query = Query::new(baked, &settings);
    let playhead = playhead(0);
    let (first, second) = (attack(1.0), attack(0.5));
    let mut context = QueryContext::default();
    let [one, two] = [&first, &second].map(|attack| {
        let session = query.start(Request::new(playhead, attack), &mut context);
        session.id()
    });
    assert!(query.resume(one, &mut context).is_none());
    assert!(query.resume(two, &mut context).is_some());
}
