//! Tests of `sabaki::maps`.
mod attack_grid;
mod grid;
mod onto;
mod paths;
mod records;
mod regions;
mod slices;
mod strikes;
