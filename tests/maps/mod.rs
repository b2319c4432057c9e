//! Tests of `sabaki::maps`.
mod attack_grid;
mod grid;
mod paths;
mod regions;
mod slices;
mod strikes;
