//! The events that the graph would drop get the best way in and the best way out.

use super::candidates::{Candidate, Side};
use super::{LinkObstacle, UnlinkedEvent, Work};

/// Links events to the graph's largest component until no more can be; says which cannot.
pub(super) fn join(work: &mut Work<'_>) -> Vec<UnlinkedEvent> {
    let playable = |index: &usize| {
        let event = &work.source.events[*index];
        event.first < event.last
    };
    let mut open: Vec<usize> = (0..work.source.events.len()).filter(playable).collect();
    loop {
        let before = work.links.len();
        match work.moments.component(&work.jumps) {
            None => first_cycle(work, &open),
            Some(core) => {
                open.retain(|&event| {
                    let [first, last] = work.ends(&work.source.events[event]);
                    !(core[first as usize] && core[last as usize])
                });
                to_core(work, &open, &core);
            }
        }
        if work.links.len() == before {
            return unlinked(work, &open);
        }
    }
}

/// Where no motion leads back at all: the closest link from after an event to before it.
fn first_cycle(work: &mut Work<'_>, open: &[usize]) {
    let loops = open.iter().filter_map(|&index| {
        let event = &work.source.events[index];
        let [first, _] = work.ends(event);
        let start = work.moments.of_clip(event.clip.index()).start;
        let mut allowed = vec![false; work.moments.len()];
        allowed[start..=first as usize].fill(true);
        let found = work.candidates.find(&[index], Side::After, Some(&allowed));
        found.first().copied()
    });
    let best = loops.min_by(|a, b| a.strain.total_cmp(&b.strain));
    if let Some(best) = best {
        work.take(best.link);
    }
}

/// Links each event that has both a way in from the component and a way out to it.
fn to_core(work: &mut Work<'_>, open: &[usize], core: &[bool]) {
    let ways_in = work.candidates.find(open, Side::Before, Some(core));
    let ways_out = work.candidates.find(open, Side::After, Some(core));
    let best = |ways: &[Candidate], event| ways.iter().find(|way| way.event == event).copied();
    for &event in open {
        if let (Some(way_in), Some(way_out)) = (best(&ways_in, event), best(&ways_out, event)) {
            work.take(way_in.link);
            work.take(way_out.link);
        }
    }
}

fn unlinked(work: &Work<'_>, open: &[usize]) -> Vec<UnlinkedEvent> {
    let seconds = |frames: usize| frames as f64 / work.source.settings.frame_rate;
    let lengths = work.candidates.lengths;
    let shortest = seconds(lengths.shortest);
    let why = |event: usize| {
        let room = |side| work.candidates.room(event, side);
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
    let events = work.source.events.iter().enumerate();
    events
        .filter_map(|(event, found)| {
            let obstacle = if found.first == found.last {
                LinkObstacle::TooShort
            } else {
                open.contains(&event).then(|| why(event))?
            };
            Some(UnlinkedEvent {
                event: found.describe(work.source.clips, work.source.settings.frame_rate),
                obstacle,
            })
        })
        .collect()
}
