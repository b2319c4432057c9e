//! The tests of the component. Folders mirror `src`.
#![allow(clippy::unwrap_used, clippy::expect_used)]
// The files mirror those of `src`, and a test uses an example's memory.
#![allow(clippy::module_inception, clippy::duplicate_mod)]

mod archive;
mod capi;
mod character;
mod gpu;
mod graph;
mod guide;
mod limits;
mod maps;
mod query;

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;
