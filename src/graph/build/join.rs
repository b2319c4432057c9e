use crate::anim::Clip;
use crate::graph::build::candidates::{Candidate, LinkSource, Side};
use crate::graph::build::darts::DartTest;
use crate::graph::build::moments::{Jump, Moments};
use crate::graph::build::nearest::{Candidates, Wanted};
use crate::graph::build::report::{LinkObstacle, UnlinkedEvent};
use crate::graph::motion_graph::GraphEvent;
use crate::graph::search::transition::Transition;
use crate::graph::settings::LinkSettings;
use crate::graph::watch::Stopped;

/// State of the search.
pub(crate) struct LinkSearch<'a> {
    pub(crate) settings: &'a LinkSettings,
    pub(crate) candidates: Candidates<'a>,
    /// All transitions and links so far.
    pub(crate) jumps: Vec<Jump>,
    /// All links so far.
    pub(crate) links: Vec<Transition>,
    pub(crate) darts: &'a mut Option<DartTest>,
    /// Maximum number of links.
    pub(crate) most: usize,
    /// Number of links that were not taken because a foot darts.
    pub(crate) darting: usize,
}

impl<'a> LinkSearch<'a> {
    pub(crate) fn source(&self) -> LinkSource<'a> {
        self.candidates.space.source
    }

    pub(crate) fn moments(&self) -> &Moments {
        &self.candidates.space.moments
    }

    pub(crate) fn take(&mut self, link: Transition) {
        let jump = self.moments().jump(&link);
        self.jumps.push(jump);
        self.links.push(link);
    }

    /// Returns for each link whether a foot darts in it.
    pub(crate) fn darts(&mut self, links: &[Transition]) -> Vec<bool> {
        let aligner = self.source().aligner;
        match &mut self.darts {
            Some(test) => test.darts(links, |link| aligner.align(link)),
            None => vec![false; links.len()],
        }
    }

    /// First and last moment of an event.
    pub(crate) fn ends(&self, event: &GraphEvent) -> [u32; 2] {
        [event.first, event.last].map(|frame| self.moments().at(event.clip.index(), frame as usize))
    }

    /// Maximum number of links for the duration of some clips.
    pub(crate) fn most(clips: &[Clip], settings: &LinkSettings) -> usize {
        let seconds: f64 = clips.iter().map(Clip::duration).sum();
        (seconds * settings.most_per_second) as usize
    }

    pub(crate) fn longest(&self) -> usize {
        self.links.iter().map(|t| t.frames).max().unwrap_or(0)
    }
}

// Links events that the graph would otherwise drop: each gets its best link in and its best link
// out.

/// Links events to the graph's largest component until no further event can be linked. Returns the
/// events that could not be linked.
pub(crate) fn join(search: &mut LinkSearch<'_>) -> Result<Vec<UnlinkedEvent>, Stopped> {
    let playable = |index: &usize| {
        let event = &search.source().events[*index];
        event.first < event.last
    };
    let mut open: Vec<usize> = (0..search.source().events.len()).filter(playable).collect();
    loop {
        let before = search.links.len();
        match search.moments().component(&search.jumps) {
            None => first_cycle(search, &open)?,
            Some(core) => {
                open.retain(|&event| {
                    let [first, last] = search.ends(&search.source().events[event]);
                    !(core[first as usize] && core[last as usize])
                });
                let wanted = Wanted {
                    events: &open,
                    side: Side::Before,
                    allowed: &core,
                    most: 16,
                };
                to_core(search, wanted)?;
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
        let event = &search.source().events[index];
        let [first, _] = search.ends(event);
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

/// Links each event that has both a link from the component and a link to it, whichever side is wanted first.
fn to_core(search: &mut LinkSearch<'_>, wanted: Wanted<'_>) -> Result<(), Stopped> {
    let [links_in, links_out] =
        [Side::Before, Side::After].map(|side| closest(search, Wanted { side, ..wanted }));
    let (links_in, links_out) = (links_in?, links_out?);
    for ends in links_in.into_iter().zip(links_out) {
        if let (Some(link_in), Some(link_out)) = ends {
            search.take(link_in.link);
            search.take(link_out.link);
        }
    }
    Ok(())
}

/// The closest link of each event in which no foot darts, or the closest link if a foot darts in all of them: that is better than losing
/// the event.
fn closest(
    search: &mut LinkSearch<'_>,
    wanted: Wanted<'_>,
) -> Result<Vec<Option<Candidate>>, Stopped> {
    let mut ways = vec![EventWays::default(); wanted.events.len()];
    let mut open: Vec<usize> = (0..ways.len()).collect();
    let mut most = wanted.most;
    while !open.is_empty() {
        let events: Vec<usize> = open.iter().map(|&index| wanted.events[index]).collect();
        let wanted = Wanted {
            events: &events,
            most,
            ..wanted
        };
        let found = search.candidates.nearest(wanted)?;
        let mut found = found.iter();
        open.retain(|&index| {
            let links = found.next().map_or(&[][..], Vec::as_slice);
            ways[index].test(search, links);
            ways[index].found.is_none() && links.len() == most
        });
        most *= 4;
    }
    let found = ways.into_iter().map(|ways| ways.found.or(ways.darting));
    Ok(found.collect())
}

/// The links of one event that have been tested.
#[derive(Clone, Default)]
struct EventWays {
    tested: usize,
    /// The closest link in which a foot darts.
    darting: Option<Candidate>,
    /// The closest link in which no foot darts.
    found: Option<Candidate>,
}

impl EventWays {
    /// Tests links, closest first. Those that were tested before are skipped.
    fn test(&mut self, search: &mut LinkSearch<'_>, links: &[Candidate]) {
        for link in links.iter().skip(self.tested) {
            self.tested += 1;
            let Some(link) = search.candidates.space.refined(*link) else {
                continue;
            };
            if !search.darts(&[link.link])[0] {
                self.found = Some(link);
                return;
            }
            search.darting += 1;
            self.darting.get_or_insert(link);
        }
    }
}

fn unlinked(search: &LinkSearch<'_>, open: &[usize]) -> Vec<UnlinkedEvent> {
    let seconds = |frames: usize| frames as f64 / search.source().settings.frame_rate;
    let lengths = search.candidates.space.lengths;
    let shortest = seconds(lengths.shortest);
    let why = |event: usize| {
        let free = |side| search.candidates.space.free_frames(event, side);
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
    let events = search.source().events.iter().enumerate();
    events
        .filter_map(|(event, found)| {
            let obstacle = if found.first == found.last {
                LinkObstacle::TooShort
            } else {
                open.contains(&event).then(|| why(event))?
            };
            Some(UnlinkedEvent {
                event: found.describe(search.source().clips, search.source().settings.frame_rate),
                obstacle,
            })
        })
        .collect()
}
