//! The tests of the component. Folders mirror `src`.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod archive;
mod capi;
mod character;
mod crowd;
mod duel;
mod gpu;
mod graph;
mod guide;
mod lod;
mod maps;
mod query;
