use super::settings::{QuerySettings, QuerySettingsError};
use crate::maps::BakedGraph;

/// Finds motions of a baked graph that avoid attacks.
///
/// ```
/// # fn ask(baked: &sabaki::maps::BakedGraph, playhead: sabaki::graph::Playhead, attack: &sabaki::query::Attack) {
/// use sabaki::query::{Answer, Query, QueryContext, QuerySettings, Request};
///
/// let settings = QuerySettings::default();
/// // Keep both from one query to the next. After a few queries nothing is allocated.
/// let (mut context, mut answer) = (QueryContext::default(), Answer::default());
/// Query::new(baked, &settings).answer(Request::new(playhead, attack), &mut context, &mut answer);
/// println!("avoided: {}, by {} m", answer.avoided, answer.clearance().metres);
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    pub(super) baked: &'a BakedGraph,
    pub(super) settings: &'a QuerySettings,
}

impl<'a> Query<'a> {
    /// Creates a query with settings that the program has chosen.
    ///
    /// Settings out of range (see [`QuerySettings::check`]) are used as they are. Nothing panics, but the query is slow or the
    /// answer is poor. Use [`Query::checked`] for settings from other sources.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, settings: &'a QuerySettings) -> Self {
        Self { baked, settings }
    }

    /// Creates a query with settings from a file or a user.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn checked(
        baked: &'a BakedGraph,
        settings: &'a QuerySettings,
    ) -> Result<Self, QuerySettingsError> {
        settings.check()?;
        Ok(Self::new(baked, settings))
    }
}
