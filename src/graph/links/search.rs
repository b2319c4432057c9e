use super::candidates::Candidates;
use super::settings::LinkSettings;
use super::source::LinkSource;
use crate::anim::Clip;
use crate::graph::feet::DartTest;
use crate::graph::moments::{Jump, Moments};
use crate::graph::{GraphEvent, Transition};

/// State of the search.
pub(super) struct LinkSearch<'a> {
    pub(super) settings: &'a LinkSettings,
    pub(super) candidates: Candidates<'a>,
    /// All transitions and links so far.
    pub(super) jumps: Vec<Jump>,
    /// All links so far.
    pub(super) links: Vec<Transition>,
    pub(super) darts: &'a mut Option<DartTest>,
    /// Maximum number of links.
    pub(super) most: usize,
    /// Number of links that were not taken because a foot darts.
    pub(super) darting: usize,
}

impl<'a> LinkSearch<'a> {
    pub(super) fn source(&self) -> LinkSource<'a> {
        self.candidates.space.source
    }

    pub(super) fn moments(&self) -> &Moments {
        &self.candidates.space.moments
    }

    pub(super) fn take(&mut self, link: Transition) {
        let jump = self.moments().jump(&link);
        self.jumps.push(jump);
        self.links.push(link);
    }

    /// Returns for each link whether a foot darts in it.
    pub(super) fn darts(&mut self, links: &[Transition]) -> Vec<bool> {
        let aligner = self.source().aligner;
        match &mut self.darts {
            Some(test) => test.darts(links, |link| aligner.align(link)),
            None => vec![false; links.len()],
        }
    }

    /// First and last moment of an event.
    pub(super) fn ends(&self, event: &GraphEvent) -> [u32; 2] {
        [event.first, event.last].map(|frame| self.moments().at(event.clip.index(), frame as usize))
    }

    /// Maximum number of links for the duration of some clips.
    pub(super) fn most(clips: &[Clip], settings: &LinkSettings) -> usize {
        let seconds: f64 = clips.iter().map(Clip::duration).sum();
        (seconds * settings.most_per_second) as usize
    }

    pub(super) fn longest(&self) -> usize {
        self.links.iter().map(|t| t.frames).max().unwrap_or(0)
    }
}
