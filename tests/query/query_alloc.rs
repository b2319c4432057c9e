//! Promise: a query allocates nothing once its memory has seen others like it.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;
use sabaki_fixtures::memory as counting;

use common::baked::embedded;
use counting::allocations;
use sabaki::query::{Answer, Enumerate, Query, QueryContext, QuerySettings};
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};

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
