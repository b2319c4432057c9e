//! Interactive simulations without a window: a character that walks until a ball is thrown, a duel, a crowd, with camera and clock.
//! [`window`](super::window) shows them; another window can show them, too, with a [`Stage`](sabaki_draw::Stage).
//!
//! Architecture invariant: this module uses no window system and draws nothing.

mod aim;
mod clock;
mod crowd;
mod cullers;
mod drive;
mod duel;
mod event;
mod fighter;
mod map_choices;
mod orbit;
mod query_worker;
mod room;
mod sight_line;
mod throw;
mod walker;
mod worker_request;

pub use aim::{Ball, BallSettings};
pub use clock::Clock;
pub use crowd::{CameraPath, LiveCrowd, LiveCrowdError};
pub use drive::{Drive, DriveScore};
pub use duel::LiveDuel;
pub use event::Event;
pub use fighter::{Fighter, FighterSettings};
pub use map_choices::{MapChoice, MapChoices, map_name};
pub use orbit::Orbit;
pub use query_worker::{QueryWorker, with_query_worker};
pub use throw::Throw;
pub use walker::Walker;
pub use worker_request::{QueryWorkerDesc, WorkerRequest, WorkerResponse};
