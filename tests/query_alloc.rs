//! Promise: a query allocates nothing once its memory has seen others like it.
#![cfg(feature = "demo")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use common::baked::embedded;
use sabaki::avoid::{Answer, Enumerate, Lookup, Query, QueryContext, QuerySettings};
use sabaki::demo::throw::{Throw, ThrowSettings, throw};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts this thread's allocations.
struct Counting;

// SAFETY: everything is passed on to the system's allocator; the count neither allocates nor
// unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_query_allocates_nothing() {
    let baked = embedded();
    let throws: Vec<Throw> = (0..60)
        .map(|index| throw(baked, &ThrowSettings::default(), 3, index).unwrap())
        .collect();
    for enumerate in [
        Enumerate::Grid(Lookup::Union),
        Enumerate::Grid(Lookup::Nearest),
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
            let before = ALLOCATIONS.get();
            for throw in &throws {
                query.answer(throw.playhead, &throw.attack, &mut context, &mut answer);
            }
            ALLOCATIONS.get() - before
        };
        assert!(round() > 0, "the counter counts");
        assert_eq!(round(), 0, "{enumerate:?}");
    }
}
