//! Finds the closest links of events.

use super::candidate::Candidate;
use super::candidates::Candidates;
use super::margin::{EventMargin, Side};
use super::near_margins::NearMargins;
use super::source::LinkSource;
use crate::graph::watch::{BakeStage, Stopped};
use crate::math::in_parallel;

impl Candidates<'_> {
    /// Finds the closest links of `events` on one side, closest first. `events` are in ascending order. At most one link of each event is
    /// kept in each `spread` frames of a clip, and at most the [`MOST`] closest links of all events. Only moments that `allowed` contains are
    /// linked; `None` allows all moments.
    pub(super) fn find(
        &mut self,
        events: &[usize],
        side: Side,
        allowed: Option<&[bool]>,
    ) -> Result<Vec<Candidate>, Stopped> {
        let margins = self.margins(events, side);
        let near = NearMargins::new(self, &margins, allowed);
        let LinkSource {
            watch, settings, ..
        } = self.space.source;
        let stage = watch.stage(BakeStage::Links, settings.threads);
        let clips = self.space.source.aligner.clouds.len();
        let found = stage.in_parallel(clips, |clip| near.closest(clip));
        watch.check()?;
        Ok(self.sorted(&found))
    }

    /// The ranges beside events. Creates the windows for them.
    fn margins(&mut self, events: &[usize], side: Side) -> Vec<EventMargin> {
        let margins = events
            .iter()
            .filter_map(|&event| self.space.margin(event, side));
        let margins: Vec<EventMargin> = margins.collect();
        self.make_windows(margins.iter());
        margins
    }

    /// All links with their refined distances, closest first.
    fn sorted(&self, found: &[Vec<Vec<Candidate>>]) -> Vec<Candidate> {
        let refined = in_parallel(self.space.source.settings.threads, found.len(), |clip| {
            let links = found[clip].iter().flatten();
            links.filter_map(|&link| self.space.refined(link)).collect()
        });
        let mut found: Vec<Candidate> = refined
            .into_iter()
            .flat_map(|links: Vec<_>| links)
            .collect();
        // The sort is stable, so that ties keep the order of clips and frames.
        found.sort_by(Candidate::closest_first);
        found
    }
}
