//! Tests of `sabaki::graph`.

mod build;
mod distance_map;
mod feet;
mod links;
mod overlapping_events;
mod search;
