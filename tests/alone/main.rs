//! Tests that measure the whole process: nothing else may run beside them.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod limits;

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;
