//! An allocator that counts: a test that wants it takes this file as a module of its own.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicU64, Ordering},
};

/// Of all threads.
static ALL: AtomicU64 = AtomicU64::new(0);

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts this thread's allocations.
struct Counting;

// SAFETY: everything is passed on to the system's allocator; the count neither allocates nor
// unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALL.fetch_add(1, Ordering::Relaxed);
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

/// How often this thread has allocated so far.
#[allow(dead_code, reason = "some count all threads")]
pub fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

/// How often all threads have allocated so far: for a test that is alone in its program.
#[allow(dead_code, reason = "most count their own thread")]
pub fn all_allocations() -> u64 {
    ALL.load(Ordering::Relaxed)
}
