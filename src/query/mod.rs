//! Queries: find a path through the graph, and its playback rate, that avoids an attack.
//!
//! Source: Masaoka & Oshita, sections 3.3 and 5. A [`Query`] takes a [`Request`] through these stages:
//!
//! 1. **gather** the candidates: paths from the next node of the character to an evasion;
//! 2. **retime** them, so that the evasion starts when the attack does;
//! 3. **cull** them by maps ([`cull`]), on the CPU or on a device, where that pays;
//! 4. **evaluate** the rest exactly ([`clearance`]) and score them ([`Score`]);
//! 5. **warp** the shallowest hit, if no candidate is clean ([`WarpSettings`]);
//! 6. **select** one for the [`Answer`].
//!
//! Create the [`QuerySettings`], a [`QueryContext`] and an [`Answer`] once. Then, for each attack, call [`Query::answer`] and play
//! [`Answer::motion`]:
//!
//! ```
//! # use sabaki::{graph::Playhead, maps::BakedGraph, maps::SphereKey};
//! use sabaki::query::{Answer, Attack, AttackError, Query, QueryContext, QuerySettings, Request};
//!
//! # fn dodge(baked: &BakedGraph, playhead: Playhead, keys: Vec<SphereKey>) -> Result<(), AttackError> {
//! let settings = QuerySettings::default();
//! let (mut context, mut answer) = (QueryContext::default(), Answer::default());
//! // For each attack: the keys of one ball, whose times count from now.
//! let attack = Attack::new(vec![keys])?;
//! let query = Query::new(baked, &settings);
//! query.answer(Request::new(playhead, &attack), &mut context, &mut answer);
//! println!("avoided: {}, by {} m", answer.avoided, answer.clearance().metres);
//! # Ok(())
//! # }
//! ```
//!
//! To cull, on the CPU or on a device, or to answer in another frame than the one that asks, use a [`Session`]: [`Query::start`] gives it, its
//! [`cull_input`](Session::cull_input) is what a culling path counts, and [`submit`](Session::submit) continues with the counts until it
//! returns [`Step::Done`].
//!
//! ```
//! # use sabaki::query::{Answer, Query, QueryContext, Request, Step};
//! # fn dodge(query: Query<'_>, request: Request<'_>, context: &mut QueryContext, answer: &mut Answer) {
//! let mut session = query.start(request, context);
//! let mut counts = Vec::new();
//! loop {
//!     // A culler of `gpu` does this on a device.
//!     sabaki::query::cull::cpu::count(&session.cull_input(), &mut counts);
//!     if session.submit(&counts, answer) == Step::Done {
//!         break;
//!     }
//! }
//! # }
//! ```
//!
//! Architecture invariant: no file of this module uses the GPU. It hands out maps as plain data, and takes counts.

mod answer;
mod attack;
pub mod clearance;
pub mod cull;
mod evaluate;
#[cfg(test)]
pub(crate) mod fixture;
mod gather;
mod obstacle;
mod request;
mod retime;
mod score;
mod select;
mod session;
mod settings;
mod state;
mod warp;
mod workers;

pub use answer::{Answer, CandidateReport, CandidateResult, Counts, EnteredAt};
pub use attack::{Attack, AttackError};
pub use clearance::Clearance;
pub use cull::CullPath;
pub(crate) use evaluate::evasions_end;
pub use gather::SearchReport;
pub use obstacle::{Obstacle, ObstacleError};
pub use request::{Evaluation, Query, Request};
pub(crate) use request::{PlanScope, PlanStage};
pub use retime::{Rate, RateError};
pub use score::Score;
pub use session::{QueryContext, Session, SessionId, Step};
pub use settings::{
    EntryUse, Enumerate, MoveSettings, QuerySettings, QuerySettingsError, RateSettings, WarpBounds,
    WarpLimits, WarpSettings, Weights,
};
pub use state::Source;
