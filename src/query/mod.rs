//! Attack in, path and playback rates out.
//!
//! Source: Masaoka & Oshita, sections 3.3 and 5. A query goes from where the character is to the candidates that its
//! node holds, [`retime`]s them, has them [`cull`]ed, tests them ([`clearance`]) and [`score`]s them, to an
//! [`Answer`]; [`Query`] takes it through all of that. Whoever culls on a device stops between
//! [`Query::prepare`] and [`Prepared::decide`].
//!
//! Architecture invariant: nothing here knows of a device.

mod answer;
mod attack;
mod beginnings;
mod candidate;
mod case;
pub mod clearance;
mod context;
pub mod cull;

mod gather;
mod judge;
mod jury;
pub mod measure;
pub(crate) mod moves;
mod placement;
mod played;
mod prepared;
mod query;
pub mod retime;
pub mod score;
mod situation;

pub use answer::{Answer, CandidateReport, Counts, Fate, Source};
pub use attack::{Attack, AttackError};
pub use context::QueryContext;
pub use judge::Judging;
pub use moves::{MoveSettings, SearchReport};
pub use prepared::{Paused, Prepared, Verdict};
pub use query::{Enumerate, Lookup, Query, QuerySettings, QuerySettingsError};
