//! Tests of `sabaki-import`.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod annotate;
mod asf;
mod body_file;
mod body_fit;
mod bvh;
mod bvh_reference;
mod bvh_round_trip;
mod cases;
mod clip_sets;
mod common;
mod corpora;
mod doubtful_rigs;
mod events_file;
mod export;
#[cfg(feature = "fbx")]
mod fbx;
mod gltf;
mod gltf_bad_input;
mod gltf_events;
mod gltf_mesh;
mod memory_limits;
mod mirror;
mod props;
mod readme;
mod refused;
mod retarget;
mod rigs;
mod targets;
mod units;

#[global_allocator]
static COUNTING: sabaki_fixtures::memory::Counting = sabaki_fixtures::memory::Counting;
