//! Links: transitions that are made for the sake of events, with looser thresholds and blends that
//! fit, until enough moments of the graph reach an evasion soon.
//!
//! Source: the idea that interesting places of a motion pull transitions is Lee & Lee's (2004),
//! there by precomputed chances; the way taken here is our own. First every event that the graph
//! would drop gets the best way in and the best way out ([`join`]). Then, goal after goal, the
//! closest link is taken that brings evasions near to moments that lack them ([`choose`]).
//!
//! Architecture invariant: a link is a [`Transition`] like all others. Nothing that reads a graph
//! knows of links.

mod candidates;
mod choose;
mod join;
mod lengths;
mod report;
mod rooms;
mod settings;

pub use report::{GoalReport, LinkObstacle, LinkReport, UnlinkedEvent};
pub use settings::{LinkGoal, LinkSettings};

use candidates::Candidates;
use lengths::Lengths;

use super::distance::Windows;
use super::moments::{Jump, Moments};
use super::{GraphEvent, GraphSettings, PointCloud, Transition};
use crate::anim::Clip;

/// What links are sought in.
#[derive(Clone, Copy)]
pub(super) struct LinkSource<'a> {
    /// At the graph's frame rate.
    pub(super) clips: &'a [Clip],
    /// Of each clip.
    pub(super) clouds: &'a [PointCloud],
    /// Of each cloud, as long as transitions are.
    pub(super) windows: &'a [Windows],
    /// In frames of the clips; none overlap.
    pub(super) events: &'a [GraphEvent],
    /// Of the graph.
    pub(super) settings: &'a GraphSettings,
}

/// Adds links to the transitions of a graph; nothing where the settings have links switched off.
pub(super) fn add(source: LinkSource<'_>, transitions: &mut Vec<Transition>) -> LinkReport {
    let Some(settings) = &source.settings.links else {
        return LinkReport::default();
    };
    let moments = Moments::new(source.clouds.iter().map(PointCloud::frames));
    let jumps: Vec<Jump> = transitions.iter().map(|t| moments.jump(t)).collect();
    let mut work = Work {
        candidates: Candidates::new(source, Lengths::new(source.settings, settings)),
        source,
        settings,
        moments,
        jumps,
        links: Vec::new(),
    };
    let unlinked = join::join(&mut work);
    let joins = work.links.len();
    let goals = choose::choose(&mut work);
    let frame_rate = source.settings.frame_rate;
    let report = LinkReport {
        joins,
        links: work.links.len(),
        loosest: work.links.iter().map(|t| t.distance).fold(0.0, f32::max),
        longest: work.longest() as f64 / frame_rate,
        goals,
        unlinked,
    };
    transitions.append(&mut work.links);
    report
}

/// The state of the search.
struct Work<'a> {
    source: LinkSource<'a>,
    settings: &'a LinkSettings,
    candidates: Candidates<'a>,
    moments: Moments,
    /// All transitions and links so far.
    jumps: Vec<Jump>,
    /// Those of them that are links.
    links: Vec<Transition>,
}

impl Work<'_> {
    fn take(&mut self, link: Transition) {
        self.jumps.push(self.moments.jump(&link));
        self.links.push(link);
    }

    /// The first and the last moment of an event.
    fn ends(&self, event: &GraphEvent) -> [u32; 2] {
        [event.first, event.last].map(|frame| self.moments.at(event.clip.index(), frame as usize))
    }

    /// How many links may be made.
    fn most(&self) -> usize {
        let seconds: f64 = self.source.clips.iter().map(Clip::duration).sum();
        (seconds * self.settings.most_per_second) as usize
    }

    fn longest(&self) -> usize {
        self.links.iter().map(|t| t.frames).max().unwrap_or(0)
    }
}
