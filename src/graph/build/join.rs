//! Links events that the graph would otherwise drop: each gets its best link in and its best link out.

use crate::graph::build::candidates::{Candidate, Side};
use crate::graph::build::moments::{Jump, Moments};
use crate::graph::build::nearest::Candidates;
use crate::graph::build::report::{LinkObstacle, UnlinkedEvent};
use crate::graph::build::transition_test::TransitionTest;
use crate::graph::search::transition::Transition;
use crate::graph::watch::Stopped;

/// State of the search.
pub(crate) struct LinkSearch<'a> {
    pub(crate) candidates: Candidates<'a>,
    /// All transitions and links so far.
    pub(crate) jumps: Vec<Jump>,
    /// All links so far.
    pub(crate) links: Vec<Transition>,
    pub(crate) test: &'a mut Option<TransitionTest>,
    /// Number of links that were not taken because a body cannot do them.
    pub(crate) impossible: usize,
}

impl LinkSearch<'_> {
    pub(crate) fn moments(&self) -> &Moments {
        &self.candidates.space.moments
    }

    pub(crate) fn take(&mut self, link: Transition) {
        let jump = self.moments().jump(&link);
        self.jumps.push(jump);
        self.links.push(link);
    }

    /// Returns for each link whether a body cannot do it.
    pub(crate) fn test_links(&mut self, links: &[Transition]) -> Vec<bool> {
        match &mut self.test {
            Some(test) => test.impossible(self.candidates.space.input, links),
            None => vec![false; links.len()],
        }
    }
}

/// Links events to the graph's largest component until no further event can be linked. Returns the
/// events that could not be linked.
pub(crate) fn join(search: &mut LinkSearch<'_>) -> Result<Vec<UnlinkedEvent>, Stopped> {
    let events = &search.candidates.space.events;
    let playable = |index: &usize| events[*index].first < events[*index].last;
    let mut open: Vec<usize> = (0..events.len()).filter(playable).collect();
    loop {
        let before = search.links.len();
        match search.moments().component(&search.jumps) {
            None => first_cycle(search, &open)?,
            Some(core) => {
                let space = &search.candidates.space;
                open.retain(|&event| {
                    let [first, last] = space.moments.ends(&space.events[event]);
                    !(core[first as usize] && core[last as usize])
                });
                let links_in = closest(search, &open, Side::Before, &core)?;
                let links_out = closest(search, &open, Side::After, &core)?;
                for ends in links_in.into_iter().zip(links_out) {
                    if let (Some(link_in), Some(link_out)) = ends {
                        search.take(link_in.link);
                        search.take(link_out.link);
                    }
                }
            }
        }
        if search.links.len() == before {
            return Ok(unlinked(search, &open));
        }
    }
}

/// If the graph has no cycle, adds the closest link from after an event back to before it.
fn first_cycle(search: &mut LinkSearch<'_>, open: &[usize]) -> Result<(), Stopped> {
    let mut loops: Vec<Candidate> = Vec::new();
    for &index in open {
        let event = &search.candidates.space.events[index];
        let [first, _] = search.moments().ends(event);
        let start = search.moments().of_clip(event.clip.index()).start;
        let mut allowed = vec![false; search.moments().len()];
        allowed[start..=first as usize].fill(true);
        let candidates = &mut search.candidates;
        let found = candidates.find(&[index], Side::After, Some(&allowed))?;
        loops.extend(found.first());
    }
    let best = loops.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
    if let Some(best) = best {
        search.take(best.link);
    }
    Ok(())
}

/// The closest link of each event on one side that a body can do, or the closest link if it can do none of them: that
/// is better than losing the event. Only moments that `allowed` contains are linked.
fn closest(
    search: &mut LinkSearch<'_>,
    events: &[usize],
    side: Side,
    allowed: &[bool],
) -> Result<Vec<Option<Candidate>>, Stopped> {
    let mut tested = vec![TestedLinks::default(); events.len()];
    let mut open: Vec<usize> = (0..events.len()).collect();
    let mut most = 16;
    while !open.is_empty() {
        let own: Vec<usize> = open.iter().map(|&index| events[index]).collect();
        let found = search.candidates.nearest(&own, side, allowed, most)?;
        let mut found = found.iter();
        open.retain(|&index| {
            let links = found.next().map_or(&[][..], Vec::as_slice);
            tested[index].test(search, links);
            tested[index].found.is_none() && links.len() == most
        });
        most *= 4;
    }
    let found = tested
        .into_iter()
        .map(|links| links.found.or(links.impossible));
    Ok(found.collect())
}

/// The links of one event that have been tested.
#[derive(Clone, Default)]
struct TestedLinks {
    tested: usize,
    /// The closest link that a body cannot do.
    impossible: Option<Candidate>,
    /// The closest link that it can do.
    found: Option<Candidate>,
}

impl TestedLinks {
    /// Tests links, closest first. Those that were tested before are skipped.
    fn test(&mut self, search: &mut LinkSearch<'_>, links: &[Candidate]) {
        for link in links.iter().skip(self.tested) {
            self.tested += 1;
            let Some(link) = search.candidates.space.refined(*link) else {
                continue;
            };
            if !search.test_links(&[link.link])[0] {
                self.found = Some(link);
                return;
            }
            search.impossible += 1;
            self.impossible.get_or_insert(link);
        }
    }
}

fn unlinked(search: &LinkSearch<'_>, open: &[usize]) -> Vec<UnlinkedEvent> {
    let space = &search.candidates.space;
    let (input, lengths) = (space.input, space.lengths);
    let seconds = |frames: usize| frames as f64 / input.settings.frame_rate;
    let shortest = seconds(lengths.shortest);
    let why = |event: usize| {
        let free = |side| space.free_frames(event, side);
        let (before, after) = (free(Side::Before), free(Side::After));
        if before < lengths.shortest {
            LinkObstacle::NoLeadIn {
                seconds: seconds(before),
                shortest,
            }
        } else if after < lengths.shortest {
            LinkObstacle::NoTail {
                seconds: seconds(after),
                shortest,
            }
        } else {
            LinkObstacle::NothingNear {
                loosest: lengths.loosest,
            }
        }
    };
    let events = space.events.iter().enumerate();
    events
        .filter_map(|(event, found)| {
            let obstacle = if found.first == found.last {
                LinkObstacle::TooShort
            } else {
                open.contains(&event).then(|| why(event))?
            };
            Some(UnlinkedEvent {
                event: found.describe(&input.clips, &input.leads, input.settings.frame_rate),
                obstacle,
            })
        })
        .collect()
}
