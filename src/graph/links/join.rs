//! Links events that the graph would otherwise drop: each gets its best link in and its best link
//! out.

use super::candidates::Candidate;
use super::margin::Side;
use super::nearest::{NearestLinks, Wanted};
use super::report::{LinkObstacle, UnlinkedEvent};
use super::search::LinkSearch;

/// Links events to the graph's largest component until no further event can be linked. Returns the
/// events that could not be linked.
pub(super) fn join(search: &mut LinkSearch<'_>) -> Vec<UnlinkedEvent> {
    let mut nearest = NearestLinks::default();
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
                to_core(search, &mut nearest, (&open, &core));
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
fn to_core<'a>(
    search: &mut LinkSearch<'a>,
    nearest: &mut NearestLinks<'a>,
    (open, core): (&[usize], &[bool]),
) {
    let [links_in, links_out] = [Side::Before, Side::After].map(|side| {
        let wanted = Wanted {
            events: open,
            side,
            allowed: core,
        };
        closest(search, nearest, wanted)
    });
    for ends in links_in.into_iter().zip(links_out) {
        if let (Some(link_in), Some(link_out)) = ends {
            search.take(link_in.link);
            search.take(link_out.link);
        }
    }
}

/// The closest link of each event in which no foot darts, or the closest one if a foot darts in all: better so than without the event.
/// Links up to a limit are refined and compared before those up to the next.
fn closest<'a>(
    search: &mut LinkSearch<'a>,
    nearest: &mut NearestLinks<'a>,
    wanted: Wanted<'_>,
) -> Vec<Option<Candidate>> {
    let events = wanted.events;
    let mut darting: Vec<Vec<Candidate>> = vec![Vec::new(); events.len()];
    let mut found: Vec<Option<Candidate>> = vec![None; events.len()];
    for limit in NearestLinks::limits(&search.candidates) {
        let open = (0..events.len()).filter(|&index| found[index].is_none());
        let open: Vec<usize> = open.map(|index| events[index]).collect();
        let wanted = Wanted {
            events: &open,
            ..wanted
        };
        for way in nearest.within(&search.candidates, wanted, limit) {
            let Ok(index) = events.binary_search(&way.event) else {
                continue;
            };
            let is_known = darting[index].iter().any(|known| known.link == way.link);
            if found[index].is_some() || is_known {
                continue;
            }
            if search.darts(&[way.link])[0] {
                search.darting += 1;
                darting[index].push(way);
            } else {
                found[index] = Some(way);
            }
        }
    }
    let ways = found.into_iter().zip(darting);
    ways.map(|(found, darting)| found.or(darting.first().copied()))
        .collect()
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
