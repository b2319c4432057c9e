//! Candidates that enter an evasion from the current motion, without an edge that leads there.
//!
//! Source: the entries are those of [`EntryTable`](crate::maps::EntryTable), computed by the bake. This stage selects delays on the
//! natural motion and playback rates at which the evasion is under way at the attack's contact.

use super::candidates::{Candidate, CandidateKind, CandidateList, EntryCandidate};
use super::natural::NaturalMotion;
use crate::graph::{ClipId, EdgeId, Entry};
use crate::maps::{BakedGraph, KnownEntry, Stance};
use crate::query::clearance::{MotionBody, ObstacleHit, PlayedTrack, SAMPLE_RATE};
use crate::query::request::{ActiveRequest, Query};
use crate::query::retime::Rate;
use crate::query::settings::EntryUse;

const RATES: [f32; 4] = [1.0, 1.25, 1.5, 0.75];

/// Interval of the delays, in seconds.
const DELAY_STEP: f32 = 0.1;

/// Duration of a played blend, as a multiple of the shortest plausible one: the body then pushes off less hard, and moves away hardly later.
const LONGER: f32 = 2.0;

/// Minimum time from the entry to the contact, in seconds.
const SHORTEST: f32 = 0.2;

/// Adds the evasions that can be entered in time, if the natural motion is hit.
pub(in crate::query) fn gather_entries(
    query: Query<'_>,
    request: &ActiveRequest,
    candidates: &mut CandidateList,
    natural: &mut NaturalMotion,
    body: &mut MotionBody,
) {
    let Query { baked, settings } = query;
    let (graph, uses) = (baked.graph(), &settings.entries);
    let entries = &mut candidates.entries;
    entries.clear();
    if uses.most == 0 || baked.entries().is_empty() {
        return;
    }
    let Some(contact) = natural.contact(baked, request, body) else {
        return;
    };
    let longest = uses.longest_delay.min(contact - SHORTEST).max(0.0);
    let delays = (longest / DELAY_STEP) as usize;
    for number in 0..=delays {
        let delay = number as f32 * DELAY_STEP;
        let stance = natural.stance(baked, request, delay);
        let playhead = natural.motion(baked, request).playhead(graph, delay);
        let table = baked.entries();
        for &known in table.at(&table.entries, graph, playhead) {
            add_rates(query, known, &stance, delay, contact - delay, entries);
        }
    }
    let until = natural.free_until(baked, request);
    keep_free(baked, request, until, entries);
    keep_even(entries, most_entries(uses, request));
    candidates.search.followed += entries.len();
    let added = entries.iter().zip(0..).map(|(one, index)| Candidate {
        kind: CandidateKind::Entry(index),
        rate: Rate::for_all(one.entry.rate),
    });
    candidates.list.extend(added);
}

/// An evasion that can be entered, with times since its start at rate 1, in seconds.
pub(super) struct EnteredEvasion {
    /// Index in [`BakedGraph::evasions`].
    pub evasion: usize,
    pub clip: ClipId,
    /// Entered frame of the clip.
    pub frame: u32,
    /// Entered edge and its frame.
    edge: EdgeId,
    edge_frame: f32,
    /// Time of the entered frame.
    pub now: f32,
    pub end: f32,
}

impl EnteredEvasion {
    pub(super) fn new(baked: &BakedGraph, known: KnownEntry) -> Self {
        let graph = baked.graph();
        let target = baked.entries().targets[usize::from(known.target)];
        let evasion = usize::from(target.evasion);
        let edge = graph.edge(baked.evasions()[evasion].edge);
        let start = graph.node(edge.from);
        let seconds = |frames: f64| (frames / graph.frame_rate()) as f32;
        Self {
            evasion,
            clip: start.clip,
            frame: target.frame,
            edge: target.edge,
            edge_frame: target.edge_frame as f32,
            now: seconds(f64::from(target.frame) - f64::from(start.frame)),
            end: seconds(f64::from(edge.frames)),
        }
    }

    /// Whether the evasion is under way at a rate, `left` seconds after the entry.
    pub(super) fn is_useful(&self, left: f32, rate: f32) -> bool {
        /// Range of the contact: minimum time after the evasion's start, and maximum time after its end, in seconds.
        const USEFUL: (f32, f32) = (0.1, 0.15);
        (USEFUL.0..=self.end + USEFUL.1).contains(&(self.now + left * rate))
    }
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
    let (baked, uses) = (query.baked, &query.settings.entries);
    let entered = EnteredEvasion::new(baked, known);
    let align = stance.align(baked.entry_stance(usize::from(known.target)), known.pin());
    let fastest = known.fastest().min(uses.fastest);
    let placement = align * baked.evasions()[entered.evasion].placement;
    for rate in RATES {
        if entered.is_useful(left, rate) && rate <= fastest && rate >= uses.slowest {
            entries.push(EntryCandidate {
                delay,
                entry: Entry {
                    edge: entered.edge,
                    frame: entered.edge_frame,
                    clip_to_world: align,
                    rate,
                    blend: LONGER * known.blend(),
                },
                evasion: entered.evasion,
                now: entered.now,
                placement,
                left: entered.end - entered.now,
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

fn keep_even(entries: &mut Vec<EntryCandidate>, most: usize) {
    let all = entries.len();
    if all > most {
        (0..most).for_each(|at| entries[at] = entries[at * all / most]);
        entries.truncate(most);
    }
}

/// Removes the entered evasions that enter an obstacle. If all do, the least harmful one is kept. `natural_until` is the time until which the
/// natural motion enters no obstacle, in seconds.
fn keep_free(
    baked: &BakedGraph,
    request: &ActiveRequest,
    natural_until: f32,
    entries: &mut Vec<EntryCandidate>,
) {
    if !request.removes_blocked() {
        return;
    }
    let mut least: Option<(f32, EntryCandidate)> = None;
    entries.retain(|entry| {
        if entry.delay > natural_until {
            return false;
        }
        let Some(hit) = entry_blocked(baked, request, entry) else {
            return true;
        };
        if least.is_none_or(|(harm, _)| hit.harm < harm) {
            least = Some((hit.harm, *entry));
        }
        false
    });
    if entries.is_empty() {
        entries.extend(least.map(|(_, entry)| entry));
    }
}

/// The obstacle that an entered evasion enters until its end.
fn entry_blocked(
    baked: &BakedGraph,
    request: &ActiveRequest,
    candidate: &EntryCandidate,
) -> Option<ObstacleHit> {
    let track = candidate.played_track(baked);
    let end = candidate.delay + candidate.left / candidate.entry.rate;
    request.obstacles.on_track(&PlayedTrack {
        seconds: (track.seconds.0, end),
        ..track
    })
}
