//! The tests of `sabaki-motion`. Folders mirror `src`.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod anim;
mod crowd;
mod lod;

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;
