//! Links: additional transitions from and to events, with looser thresholds and adapted lengths.
//! They are added until enough moments of the graph reach an evasion soon.
//!
//! Source: the idea that interesting motion attracts transitions is from Lee & Lee (2004), who use
//! precomputed probabilities. The method here is our own. First, every event that the graph would
//! drop gets its best link in and its best link out ([`join`]). Then, for one goal after another,
//! the closest link is added that brings evasions within reach of moments that lack them
//! ([`choose`]).
//!
//! Architecture invariant: a link is an ordinary [`Transition`]. Code that reads a graph does not
//! know which transitions are links.

use crate::graph::build::candidates::{Lengths, LinkSource};
use crate::graph::build::darts::DartTest;
use crate::graph::build::join::LinkSearch;
use crate::graph::build::moments::Jump;
use crate::graph::build::nearest::Candidates;
use crate::graph::build::report::LinkReport;
use crate::graph::build::{choose, join};
use crate::graph::search::transition::Transition;
use crate::graph::watch::Stopped;

/// Adds links to the transitions of a graph, and returns what was added. It does nothing if the settings disable links. Links in which a foot
/// darts are avoided; without a test, none are.
pub(crate) fn add(
    source: LinkSource<'_>,
    transitions: &mut Vec<Transition>,
    darts: &mut Option<DartTest>,
) -> Result<LinkReport, Stopped> {
    let Some(settings) = &source.settings.links else {
        return Ok(LinkReport::default());
    };
    let candidates = Candidates::new(source, Lengths::new(source.settings, settings));
    let moments = &candidates.space.moments;
    let jumps: Vec<Jump> = transitions.iter().map(|t| moments.jump(t)).collect();
    let mut search = LinkSearch {
        candidates,
        settings,
        jumps,
        links: Vec::new(),
        most: LinkSearch::most(source.clips, settings),
        darts,
        darting: 0,
    };
    let unlinked = {
        let _span = tracing::trace_span!("bake: join events").entered();
        join::join(&mut search)?
    };
    let joins = search.links.len();
    let goals = {
        let _span = tracing::trace_span!("bake: choose links").entered();
        choose::choose(&mut search)?
    };
    let frame_rate = source.settings.frame_rate;
    let report = LinkReport {
        joins,
        links: search.links.len(),
        darting: search.darting,
        loosest: search.links.iter().map(|t| t.distance).fold(0.0, f32::max),
        longest: search.longest() as f64 / frame_rate,
        goals,
        unlinked,
    };
    transitions.append(&mut search.links);
    Ok(report)
}
