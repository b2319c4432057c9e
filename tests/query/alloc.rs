//! Promise: drawing up a query's maps, counting on the CPU and whole queries allocate nothing, from the second time on.

use sabaki::query::cull::cpu::Culler;
use sabaki::query::{Answer, Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::memory::allocations;
use sabaki_fixtures::throw::{Throw, throws};
use sabaki_fixtures::with;

#[test]
fn neither_a_query_nor_counting_allocates() {
    let baked = embedded();
    let throws: Vec<Throw> = throws(baked, 3, 60).collect();
    for enumerate in [
        Enumerate::TouchedCells,
        Enumerate::NearestCell,
        Enumerate::Whole,
    ] {
        let settings = with(|s: &mut QuerySettings| (s.enumerate, s.list_late) = (enumerate, true));
        let query = Query::new(baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        let (mut culler, mut overlaps) = (Culler::default(), Vec::new());
        let mut met = 0;
        let mut round = || {
            let before = allocations();
            for throw in &throws {
                let mut session = query.start(throw.request(), &mut context);
                session.draw_outer_maps();
                culler.count(&session.cull_input(), &mut overlaps);
                met += overlaps.iter().filter(|overlap| overlap.outer > 0).count();
                query.answer(throw.request(), &mut context, &mut answer);
            }
            allocations() - before
        };
        assert!(round() > 0, "the counter counts");
        assert_eq!(round(), 0, "{enumerate:?}");
        assert!(met > 0);
    }
}
