//! Candidates that enter an evasion from the current motion, without an edge that leads there.
//!
//! Source: the entries are those of [`EntryTable`](crate::maps::EntryTable), computed by the bake. This stage selects delays on the
//! natural motion and playback rates at which the evasion is under way at the attack's contact.

use super::blocked::keep_free;
use super::candidates::{Candidate, CandidateKind, EntryCandidate};
use super::natural::NaturalMotion;
use crate::graph::Entry;
use crate::maps::{KnownEntry, Stance};
use crate::query::clearance::{MotionBody, SAMPLE_RATE};
use crate::query::request::{ActiveRequest, Query};
use crate::query::retime::Rate;
use crate::query::settings::EntryUse;

/// Playback rates that are tried.
const RATES: [f32; 4] = [1.0, 1.25, 1.5, 0.75];

/// Interval of the delays, in seconds.
const DELAY_STEP: f32 = 0.1;

/// Minimum time from the entry to the contact, in seconds.
const SHORTEST: f32 = 0.2;

/// Range of the contact: minimum time after the evasion's start, and maximum time after its end, in seconds.
pub(super) const USEFUL: (f32, f32) = (0.1, 0.15);

/// Adds the evasions that can be entered in time, if the natural motion is hit. Returns their number.
pub(in crate::query) fn gather_entries(
    query: Query<'_>,
    request: &ActiveRequest,
    entries: &mut Vec<EntryCandidate>,
    list: &mut Vec<Candidate>,
    natural: &mut NaturalMotion,
    body: &mut MotionBody,
) -> usize {
    let Query { baked, settings } = query;
    let (graph, uses) = (baked.graph(), &settings.entries);
    entries.clear();
    if uses.most == 0 || baked.entries().is_empty() {
        return 0;
    }
    let Some(contact) = natural.contact(baked, request, body) else {
        return 0;
    };
    let longest = uses.longest_delay.min(contact - SHORTEST).max(0.0);
    let delays = (longest / DELAY_STEP) as usize;
    for number in 0..=delays {
        let delay = number as f32 * DELAY_STEP;
        let stance = natural.stance(baked, request, delay);
        let playhead = natural.motion(baked, request).playhead(graph, delay);
        for &known in baked.entries().at(graph, playhead) {
            add_rates(query, known, &stance, delay, contact - delay, entries);
        }
    }
    let until = natural.free_until(baked, request);
    keep_free(baked, request, until, entries);
    keep_even(entries, most_entries(uses, request));
    list.extend(entries.iter().zip(0..).map(|(one, index)| Candidate {
        kind: CandidateKind::Entry(index),
        rate: Rate::of_all(one.entry.rate),
    }));
    entries.len()
}

/// Adds a candidate for each rate that brings an entry of the table to the contact in time. The entry begins `delay` seconds from now, when the
/// character has that stance, `left` seconds before the contact.
fn add_rates(
    query: Query<'_>,
    known: KnownEntry,
    stance: &Stance,
    delay: f32,
    left: f32,
    entries: &mut Vec<EntryCandidate>,
) {
    let Query { baked, settings } = query;
    let uses = &settings.entries;
    let target = baked.entries().targets()[usize::from(known.target)];
    let evasion = usize::from(target.evasion);
    let Some(track) = baked.entry_track(evasion) else {
        return;
    };
    let graph = baked.graph();
    let edge = graph.edge(baked.evasions()[evasion].edge);
    let seconds =
        |from: u32, to: u32| ((f64::from(to) - f64::from(from)) / graph.frame_rate()) as f32;
    let start = graph.node(edge.from).frame;
    // Times since the evasion's start.
    let (now, end) = (seconds(start, target.frame), seconds(0, edge.frames));
    let align = stance.align(baked.entry_stance(usize::from(known.target)), known.pin());
    let fastest = known.fastest().min(uses.fastest);
    for rate in RATES {
        let at_contact = now + left * rate;
        let is_useful = (USEFUL.0..=end + USEFUL.1).contains(&at_contact);
        if is_useful && rate <= fastest && rate >= uses.slowest {
            entries.push(EntryCandidate {
                delay,
                entry: Entry {
                    edge: target.edge,
                    frame: target.edge_frame as f32,
                    clip_to_world: align,
                    rate,
                    blend: known.blend(),
                },
                evasion,
                ahead: seconds(track.first, target.frame),
                placement: align * track.placement,
                left: end - now,
            });
        }
    }
}

/// Maximum number of entries. For attacks with very many spheres or a duration of minutes it is lower than the setting.
fn most_entries(uses: &EntryUse, request: &ActiveRequest) -> usize {
    /// Maximum number of entries if there are obstacles, because their tests cost more.
    const AMONG_OBSTACLES: usize = 40;
    /// Maximum number of samples of spheres of all entries together.
    const MOST_SAMPLES: f32 = 500_000.0;
    let attack = &request.attack;
    let most = match request.removes_blocked() {
        true => uses.most.min(AMONG_OBSTACLES),
        false => uses.most,
    };
    let samples = attack.spheres().len() as f32 * (attack.end() - attack.start()) * SAMPLE_RATE;
    most.min((MOST_SAMPLES / samples.max(1.0)) as usize).max(1)
}

/// Keeps at most `most` entries, evenly spread.
fn keep_even(entries: &mut Vec<EntryCandidate>, most: usize) {
    let all = entries.len();
    if all > most {
        (0..most).for_each(|at| entries[at] = entries[at * all / most]);
        entries.truncate(most);
    }
}
