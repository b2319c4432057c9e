//! Attack in, path and playback rates out.
//!
//! Source: Masaoka & Oshita, sections 3.3 and 5. A query goes [`enumerate`] → [`retime`] → [`cull`]
//! → [`clearance`] and
//! [`score`] → [`Answer`]; [`Query`] takes it through all of them. Whoever culls on a device stops between
//! [`Query::prepare`] and [`Prepared::decide`].
//!
//! Architecture invariant: nothing here knows of a device.

mod answer;
mod attack;
pub mod clearance;
pub mod cull;
pub mod enumerate;
mod judge;
mod placement;
mod prepared;
mod query;
pub mod retime;
pub mod score;

pub use answer::{Answer, CandidateReport, Counts, Fate};
pub use attack::{Attack, AttackError};
pub use judge::Judging;
pub use prepared::Prepared;
pub use query::{Query, QuerySettings};
