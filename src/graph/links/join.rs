//! Links events that the graph would otherwise drop: each gets its best link in and its best link
//! out.

use super::candidates::{Candidate, Side};
use super::report::{LinkObstacle, UnlinkedEvent};
use super::search::LinkSearch;

/// Links events to the graph's largest component until no further event can be linked. Returns the
/// events that could not be linked.
pub(super) fn join(search: &mut LinkSearch<'_>) -> Vec<UnlinkedEvent> {
    let playable = |index: &usize| {
        let event = &search.source.events[*index];
        event.first < event.last
    };
    let mut open: Vec<usize> = (0..search.source.events.len()).filter(playable).collect();
    loop {
        let before = search.links.len();
        match search.moments.component(&search.jumps) {
            None => first_cycle(search, &open),
            Some(core) => {
                open.retain(|&event| {
                    let [first, last] = search.ends(&search.source.events[event]);
                    !(core[first as usize] && core[last as usize])
                });
                to_core(search, &open, &core);
            }
        }
        if search.links.len() == before {
            return unlinked(search, &open);
        }
    }
}

/// If the graph has no cycle, adds the closest link from after an event back to before it.
fn first_cycle(search: &mut LinkSearch<'_>, open: &[usize]) {
    let loops = open.iter().filter_map(|&index| {
        let event = &search.source.events[index];
        let [first, _] = search.ends(event);
        let start = search.moments.of_clip(event.clip.index()).start;
        let mut allowed = vec![false; search.moments.len()];
        allowed[start..=first as usize].fill(true);
        let found = search
            .candidates
            .find(&[index], Side::After, Some(&allowed));
        found.first().copied()
    });
    let best = loops.min_by(|a, b| a.cost.total_cmp(&b.cost));
    if let Some(best) = best {
        search.take(best.link);
    }
}

/// Links each event that has both a link from the component and a link to it.
fn to_core(search: &mut LinkSearch<'_>, open: &[usize], core: &[bool]) {
    let links_in = search.candidates.find(open, Side::Before, Some(core));
    let links_out = search.candidates.find(open, Side::After, Some(core));
    for &event in open {
        let ends = [&links_in, &links_out].map(|ways| best(search, ways, event));
        if let [Some(link_in), Some(link_out)] = ends {
            search.take(link_in.link);
            search.take(link_out.link);
        }
    }
}

/// The closest link of an event in which no foot darts, or the closest one if a foot darts in all: better so than without the event.
fn best(search: &mut LinkSearch<'_>, ways: &[Candidate], event: usize) -> Option<Candidate> {
    let own = || ways.iter().filter(|way| way.event == event).copied();
    own()
        .find(|way| !search.darts(&way.link))
        .or_else(|| own().next())
}

fn unlinked(search: &LinkSearch<'_>, open: &[usize]) -> Vec<UnlinkedEvent> {
    let seconds = |frames: usize| frames as f64 / search.source.settings.frame_rate;
    let lengths = search.candidates.lengths;
    let shortest = seconds(lengths.shortest);
    let why = |event: usize| {
        let room = |side| search.candidates.free_frames(event, side);
        let (before, after) = (room(Side::Before), room(Side::After));
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
    let events = search.source.events.iter().enumerate();
    events
        .filter_map(|(event, found)| {
            let obstacle = if found.first == found.last {
                LinkObstacle::TooShort
            } else {
                open.contains(&event).then(|| why(event))?
            };
            Some(UnlinkedEvent {
                event: found.describe(search.source.clips, search.source.settings.frame_rate),
                obstacle,
            })
        })
        .collect()
}
