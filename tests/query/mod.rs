//! Tests of `sabaki::query`.
mod answer;
mod coarse;
mod cull_alloc;
mod cull_cpu;
mod culling;
mod determinism;
mod entries;
mod exits;
mod feet;
mod first_use;
mod layers;
mod obstacles;
mod pause;
mod query_alloc;
mod spans;
mod tracks;
mod warp;
