//! Characters that live in a game: [`Characters`] steers them, answers threats, plans again when these change, and says what happened.
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
//! A character is always somewhere in the graph, so that a query can start from what it plays. All threats that are known count in every
//! plan. Walls, furniture and other bodies are [`Obstacle`](crate::query::Obstacle)s that each step is given: no plan enters one, steering
//! goes around them, and the body is kept out of them. Nothing pops: whatever takes over starts where the character is, and the difference fades out.
//!
//! # Hybrid crowds
//! Many characters of one motion graph: members near the camera, and members that avoid something, are posed by the graph; all others
//! by the crowd's kernels, on levels of detail.
//!
//! Beyond both papers, which this module combines. A member is always a position in the graph ([`Playhead`](crate::graph::Playhead)),
//! so every member can answer an attack, and goes on along natural edges. Within a clip the crowd plays the same clip from the same
//! time at the same place. Transitions between clips are posed by the graph, with the joints of the member's level. A member
//! therefore moves smoothly when its poser changes.
//!
//! ```no_run
//! # use sabaki::character::HybridCrowd;
//! # use sabaki::crowd::MemberId;
//! # use sabaki::maps::BakedGraph;
//! # use sabaki::query::{Answer, Attack, Query, QueryContext, QuerySettings, Request};
//! # fn frame(baked: &BakedGraph, attack: &Attack, crowd: &mut HybridCrowd<'_>, member: MemberId)
//! # -> Result<(), Box<dyn std::error::Error>> {
//! // A member is attacked: it plays the answer, near or far.
//! let settings = QuerySettings::default();
//! let (mut context, mut answer) = (QueryContext::default(), Answer::default());
//! if let Some(playhead) = crowd.playhead(member) {
//!     Query::new(baked, &settings).answer(Request::new(playhead, attack), &mut context, &mut answer);
//!     crowd.play(member, &answer.motion);
//! }
//! // Every frame.
//! crowd.advance(1.0 / 60.0)?;
//! crowd.look_from(glam::Vec3::new(0.0, 1.6, 8.0))?;
//! let mut out = vec![sabaki::math::F32x16::ZERO; crowd.lines()];
//! crowd.pose(&mut out)?;
//! # Ok(())
//! # }
//! ```

mod characters;
mod error;
mod event;
mod goal;
mod hybrid_crowd;
mod ids;
mod keep_out;
mod obstacles;
mod plan;
mod playing;
mod saved;
mod scratch;
mod settings;
mod slot;
mod state;
mod steer;
mod steer_around;
mod threat;
mod world;

pub use characters::Characters;
pub use error::CharacterError;
pub use event::{CharacterEvent, CharacterEventKind};
pub use goal::Goal;
pub use hybrid_crowd::{HybridCrowd, HybridCrowdSettings};
pub use ids::{CharacterId, ThreatId};
pub use saved::CharactersState;
pub use settings::CharacterSettings;
pub use steer::SteerSettings;
pub use threat::Threat;
