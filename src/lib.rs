//! **sabaki**: avoidance on motion graphs and level of detail of motion, for people who write their own Vulkan renderer.
//!
//! From motion capture sabaki builds a motion graph. When an attack comes, it finds a path through the graph and a playback speed with which
//! the attack narrowly misses. Candidates are culled by maps of the ground at several heights: on the host's device with the stencil buffer and
//! occlusion queries or with a compute shader, or on the CPU.
//!
//! # Architecture
//! ```text
//! clips + events ─▶ graph ─▶ maps, grids, entries ─▶ one immutable BakedGraph (a file, or memory)
//!                                                       │
//! goals + threats + obstacles ─▶ Characters ─▶ request ─▶ gather ─▶ retime ─▶ cull ─▶ evaluate ─▶ warp ─▶ select ─▶ play
//!                                                                               ▲
//!                                             cpu │ stencil (the paper's) │ compute: same maps in, same counts out
//! ```
//!
//! | module | content |
//! | --- | --- |
//! | `capi` | the C interface (`sabaki.h`), with the feature `capi` |
//! | `gpu` | culling on the host's Vulkan device, with the feature `vulkan` |
//! | [`character`] | characters that are steered and threatened in a game, thousands of which are posed at once |
//! | [`query`] | one query: attack, candidates, retiming, culling, exact test, score, answer |
//! | [`archive`] | the baked file |
//! | [`maps`] | body and attack spheres, height slabs, time slices, the rasterizer that the shaders mirror, paths and grids, [`maps::BakedGraph`] |
//! | [`graph`] | distance map, transitions, links, pruning, events, feet, playback |
//! | [`crowd`] | poses of ten thousand characters: keys, SIMD kernels, schedule |
//! | [`lod`] | joint energy, levels of detail, switching between them |
//! | [`anim`] | skeleton, clip, pose, forward kinematics |
//! | [`math`] | rigid transforms of the ground plane, instruction sets, threads |
//!
//! A module uses those below it in this table, never one above it. [`crowd`], [`lod`], [`anim`] and [`math`] are modules of the
//! package `sabaki-motion`, which a renderer that wants crowds alone can depend on. The package `sabaki-import` reads motion files,
//! `sabaki-draw` draws pictures, and `sabaki-app` is the command.
//!
//! - Architecture invariant: [`query`] does not know that a GPU exists. It hands out plain data (maps and candidates) and takes
//!   plain data back (counts).
//! - Architecture invariant: `vk::` and `ash` are used in `gpu` alone. `unsafe` is used in `gpu`, in `capi`, and in the SIMD and
//!   thread files of [`math`].
//! - Architecture invariant: integer arithmetic decides whether a texel is covered, so that all rasterizers agree.
//! - Architecture invariant: nothing here reads JSON or motion files, parses arguments, or opens a window.
//!
//! # Where to begin
//! [`guide::from_clips`] leads from clips to a character that dodges. [`guide::game_loop`] puts it into a game. [`guide::culling`] compares the
//! culling paths, [`guide::paper`] maps the papers to the code, and [`guide::limits`] lists the limits on input. The folder `examples` has one
//! program for each concept.
//!
//! # Units
//! Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod archive;
#[cfg(feature = "capi")]
mod capi;
pub mod character;
#[cfg(feature = "vulkan")]
pub mod gpu;
pub mod graph;
pub mod guide;
pub mod maps;
pub mod query;

#[doc(inline)]
pub use sabaki_motion::{anim, crowd, lod, math};

pub use maps::BakedGraph;
pub use query::{Answer, Attack, CullPath, Query, QueryContext, QuerySettings, Request, Session};

/// The README's code, compiled with the tests of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
