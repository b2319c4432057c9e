//! Characters in a game: [`Characters`] steers them, avoids threats, plans again when threats change, and reports events.
//!
//! ```no_run
//! use std::sync::Arc;
//! use glam::Vec3;
//! use sabaki::anim::JointTransform;
//! use sabaki::character::{CharacterSettings, Characters, Goal, Threat};
//! use sabaki::math::Rigid2;
//!
//! # fn game(baked: sabaki::BakedGraph) -> Result<(), Box<dyn std::error::Error>> {
//! let mut fighters = Characters::new(Arc::new(baked), CharacterSettings::default())?;
//! let me = fighters.spawn(Rigid2::IDENTITY)?;
//! let mut joints = vec![JointTransform::IDENTITY; fighters.baked().graph().skeleton().len()];
//! let mut events = Vec::new();
//! let velocity = Vec3::new(0.0, 0.0, 1.3);
//! fighters.steer(me, Goal::Walk { velocity, facing: None })?;
//! let from = Vec3::new(0.0, 1.5, 8.0);
//! fighters.threaten(Threat::ball(fighters.now(), from, Vec3::new(0.0, 0.0, -7.0), 0.1))?;
//! loop {
//!     events.clear();
//!     fighters.step(1.0 / 60.0, &[], &mut events);
//!     fighters.pose(me, &mut joints)?;
//!     # if fighters.now() > 3.0 { return Ok(()); }
//! }
//! # }
//! ```
//!
//! A character always has a position in the graph, so that a query can start from its motion. Every plan avoids all known threats.
//! Walls, furniture and other bodies are [`Obstacle`](crate::query::Obstacle)s, which are passed to each step: no plan enters one, steering
//! goes around them, and the body is kept out of them. Nothing pops: each new motion starts at the present pose, and the difference fades out.
//!
//! # Crowds
//! [`Characters::pose_all`] poses thousands of characters. The kernels of [`crowd`](crate::crowd) pose distant characters on levels of
//! detail; the graph poses near ones and those that turn, blend or dodge. All poses are in one buffer, in one format.
//!
//! ```no_run
//! # use sabaki::character::{CharacterError, CharacterId, Characters, CrowdPoseSettings, KindId};
//! # use sabaki::lod::{LevelSettings, Levels, SwitchSettings, Switching};
//! # fn frame(fighters: &mut Characters, me: CharacterId) -> Result<(), Box<dyn std::error::Error>> {
//! let baked = fighters.baked().clone();
//! let graph = baked.graph();
//! let levels = Levels::build(graph.skeleton(), graph.clips(), &LevelSettings::default())?;
//! let switching = Switching::new(&levels, &SwitchSettings::default())?;
//! fighters.use_crowd(KindId::default(), &levels, CrowdPoseSettings { near: 5.0, switching, ..CrowdPoseSettings::default() })?;
//! // As long as there are no more than 1000 characters, this is enough.
//! let mut out = vec![sabaki::math::F32x16::ZERO; fighters.max_output_len(KindId::default(), 1000)];
//! // Every frame:
//! fighters.step(1.0 / 60.0, &[], &mut Vec::new());
//! fighters.pose_all(KindId::default(), glam::Vec3::new(0.0, 1.6, 8.0), &mut out)?;
//! let x = fighters.pose_slice(me)?.number(&out, 0, 3);
//! # Ok(())
//! # }
//! ```

mod characters;
mod crowd_poses;
mod error;
mod event;
mod flights;
mod goal;
mod keep_out;
mod kind;
mod obstacles;
mod plan;
mod playing;
mod pose_all;
mod saved;
mod settings;
mod slot;
mod state;
mod steer;
mod steer_around;
mod strike;
mod threat;
mod walk_past;
mod watch;
mod world;

pub use characters::Characters;
pub use crowd_poses::CrowdPoseSettings;
pub use error::CharacterError;
pub use event::{CharacterEvent, CharacterEventKind, CharacterId, ThreatId};
pub use goal::{Goal, StrikeAt, StrikeKind};
pub use kind::KindId;
pub use saved::CharactersState;
pub use settings::{CharacterSettings, SteerSettings};
pub use threat::Threat;
