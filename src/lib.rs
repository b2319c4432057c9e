//! **sabaki** — dodging by a hair's breadth, for people who write their own renderer.
//!
//! From motion capture it builds a motion graph; when an attack comes, it finds the path through
//! the graph, and the playback rates, that avoid it. The candidates are culled on the device with
//! height-slab maps, the stencil buffer and occlusion queries, or by the same maps on the CPU.
//!
//! # The way that data flows
//! ```text
//! clips + events ─▶ graph ─▶ maps, paths, grid ─▶ one immutable BakedGraph (a file, or memory)
//!                                                    │
//! where the character is now + attack ─▶ enumerate ─▶ retime ─▶ cull ─▶ score ─▶ choose ─▶ play
//!                                                                ▲
//!                               cpu │ stencil │ compute: same maps in, same counts out
//! ```
//!
//! # Where to begin
//! [`guide::from_clips`] goes all the way from clips to a dodging character; [`guide::paper`] says where the papers stand in the
//! code, [`guide::culling`] which culling path to take, [`guide::limits`] what is refused.
//!
//! # The rooms
//! Arrows go down only: a module uses those below it, never those above or beside it.
//!
//! | room | what stands in it |
//! | --- | --- |
//! | `view` | pictures of fighters and crowds, by the device into an image, a file or a window |
//! | `capi` | the same for C and C++ (`sabaki.h`) |
//! | [`io`], `gpu`, `demo` | files; the Vulkan device; the embedded motions |
//! | [`troupe`] | characters of one graph: near ones posed by it, far ones by the crowd |
//! | [`avoid`] | attack, candidates, retime, cull, exact test, score, answer; duels |
//! | [`region`] | spheres, slabs and slices, the rasterizer that the shaders mirror, paths and grids of evasions and attacks, the baked graph |
//! | [`graph`] | distance map, transitions, links, prune, events, feet, playback |
//! | [`crowd`] | ten thousand characters at once: keys, kernels, schedule |
//! | [`lod`] | joint energy, levels of detail, switching between them |
//! | [`anim`] | skeleton, clip, pose, forward kinematics |
//! | [`math`] | rigid transforms of the ground plane, instruction sets, threads |
//!
//! # Invariants
//! - Architecture invariant: [`avoid`] does not know that a GPU exists. It hands out plain data
//!   (maps and candidates) and takes plain data back (counts).
//! - Architecture invariant: `vk::` and `ash` stand in `gpu` and `view` alone; `unsafe` too, but for `capi`, whose
//!   callers hand over pointers, and one file of `math`.
//! - Architecture invariant: coverage of a texel is decided in integers, so that no two rasterizers
//!   can differ.
//!
//! # Units
//! Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod anim;
pub mod archive;
#[cfg(feature = "capi")]
mod capi;
pub mod character;
pub mod crowd;
pub mod duel;
#[cfg(feature = "vulkan")]
pub mod gpu;
pub mod graph;
pub mod guide;
pub mod lod;
pub mod maps;
pub mod math;
pub mod query;

/// The README's code, compiled with the tests of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
