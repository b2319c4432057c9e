//! **sabaki-motion**: skeletons and clips, level of detail of motion, and crowds of ten thousand characters, for people who write their own
//! renderer.
//!
//! The package [`sabaki`](https://docs.rs/sabaki), which avoids attacks on motion graphs, builds on it and exports its modules as its own. A
//! renderer that wants crowds alone takes this package: it knows no graph, no attack, no graphics interface and no file format.
//!
//! ```text
//! clip ─▶ joint energy ─▶ levels ─▶ crowd: SIMD pose evaluation ─▶ joint matrices in the caller's buffer
//! ```
//!
//! | module | content |
//! | --- | --- |
//! | [`crowd`] | poses of ten thousand characters: keys, SIMD kernels, schedule |
//! | [`lod`] | joint energy, levels of detail, switching between them |
//! | [`anim`] | skeleton, clip, pose, forward kinematics |
//! | [`math`] | rigid transforms of the ground plane, instruction sets, threads |
//!
//! A module uses those below it in this table, never one above it.
//!
//! - Architecture invariant: `unsafe` is used in the SIMD and thread files of [`math`] alone.
//! - Architecture invariant: nothing here reads files, parses arguments, or names a graphics interface.
//!
//! # Units
//! Metres, seconds, radians; right-handed, +Y up, the ground is y = 0; unit quaternions, xyzw.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used))]
#![warn(unreachable_pub)]

pub mod anim;
pub mod crowd;
pub mod lod;
pub mod math;
