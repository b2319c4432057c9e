//! Queries: find a path through the graph, and its playback rate, that avoids an attack.
//!
//! Source: Masaoka & Oshita, sections 3.3 and 5. A [`Query`] takes a [`Request`] through these stages: gather the candidates of the
//! next node, retime them, [`cull`] them by maps, evaluate the rest exactly (`clearance`), score them, and select one for
//! the [`Answer`]. [`Query::answer`] does all of it on the CPU. To cull on a device, use a [`Session`].
//!
//! Architecture invariant: no file of this module uses the GPU. It hands out maps as plain data, and takes counts.

pub(crate) mod answer;
mod ask;
mod attack;
mod blocked;
mod candidate;
mod candidate_motion;
mod candidate_tests;
pub(crate) mod clearance;
mod context;
pub mod cull;
mod entries;
mod entry_candidate;
mod entry_use;
mod enumerate;
mod evaluate;
mod evaluated;
mod evaluation;
mod evaluation_input;
mod gather;
mod gather_moves;
mod layer_candidate;
mod layer_ranking;
mod layers;
pub(crate) mod moves;
mod near_ties;
pub(crate) mod obstacle;
mod place;
mod prefix_cache;
mod report;
mod request;
pub(crate) mod retime;
mod score;
mod select;
mod session;
mod settings;
mod source;
mod state;
pub(crate) mod warp;
mod workers;

pub use answer::{Answer, CandidateReport, CandidateResult, Counts};
pub use ask::Query;
pub use attack::{Attack, AttackBegin, AttackError};
pub use clearance::Clearance;
pub use context::QueryContext;
pub use cull::CullPath;
pub use entry_use::EntryUse;
pub use enumerate::Enumerate;
pub use evaluation::Evaluation;
pub(crate) use evaluation_input::evasions_end;
pub(crate) use moves::MoveSettings;
pub use obstacle::{Obstacle, ObstacleError};
pub(crate) use request::PlanScope;
pub use request::Request;
pub use retime::RateSettings;
pub use score::{Score, Weights};
pub use session::{Session, SessionId, Step};
pub use settings::{QuerySettings, QuerySettingsError};
pub use source::Source;
pub use warp::WarpSettings;
