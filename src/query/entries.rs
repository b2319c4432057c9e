//! Candidates that enter an evasion from the current motion, without an edge that leads there.
//!
//! Source: the entries are those of [`EntryTable`](crate::maps::EntryTable), computed by the bake. This stage selects delays on the
//! natural motion and playback rates at which the evasion is under way at the attack's contact.

use super::ask::Query;
use super::blocked::{is_sought, keep_free};
use super::candidate::{Candidate, CandidateKind};
use super::clearance::{ExactTest, Extent, MotionBody, SAMPLE_RATE, Sampling};
use super::entry_candidate::EntryCandidate;
use super::entry_use::EntryUse;
use super::evaluate::EvaluateScratch;
use super::layer_ranking::LayerRanking;
use super::request::ActiveRequest;
use super::retime::{Direction, Rate};
use super::state::QueryState;
use crate::anim::{JointTransform, Pose, forward_kinematics};
use crate::graph::{Entry, Motion};
use crate::maps::{BakedGraph, KnownEntry, Stance};

/// Playback rates that are tried.
const RATES: [f32; 4] = [1.0, 1.25, 1.5, 0.75];
/// Interval of the delays, in seconds.
const DELAY_STEP: f32 = 0.1;
/// Minimum time from the entry to the contact, in seconds.
const SHORTEST: f32 = 0.2;
/// Range of the contact: minimum time after the evasion's start, and maximum time after its end, in seconds.
pub(super) const USEFUL: (f32, f32) = (0.1, 0.15);

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub(super) struct EntryScratch {
    motion: Motion,
    pose: Pose,
    joints: Vec<JointTransform>,
    /// Time of the contact, or `Some(None)` if the natural motion is not hit; `None` if it is not computed yet.
    contact: Option<Option<f32>>,
    /// Whether `motion` is the natural motion of this query.
    has_motion: bool,
    ranking: LayerRanking,
}

/// Adds the evasions that can be entered in time, if the natural motion is hit.
pub(super) fn gather_entries(
    query: Query<'_>,
    state: &mut QueryState,
    scratch: &mut EvaluateScratch,
) {
    let Query { baked, settings } = query;
    let (graph, uses) = (baked.graph(), &settings.entries);
    state.entries.clear();
    if uses.most == 0 || baked.entries().is_empty() {
        return;
    }
    let (scratch, body) = scratch.for_entries();
    let Some(contact) = scratch.contact(baked, &state.request, body) else {
        return;
    };
    let longest = uses.longest_delay.min(contact - SHORTEST).max(0.0);
    let delays = (longest / DELAY_STEP) as usize;
    for number in 0..=delays {
        let delay = number as f32 * DELAY_STEP;
        let stance = stance(baked, delay, scratch);
        let playhead = scratch.motion.playhead(graph, delay);
        for &known in baked.entries().at(graph, playhead) {
            let jump = Jump {
                known,
                stance: &stance,
                delay,
                left: contact - delay,
            };
            jump.add_rates(query, &mut state.entries);
        }
    }
    let until = scratch.free_until(baked, &state.request);
    keep_free(baked, state, until);
    keep_even(&mut state.entries, most_entries(uses, &state.request));
    let list = &mut state.candidates.list;
    list.extend(state.entries.iter().zip(0..).map(|(one, index)| Candidate {
        kind: CandidateKind::Entry(index),
        rate: rate_of(one.entry.rate),
    }));
    state.search.followed += state.entries.len();
}

impl EntryScratch {
    /// Discards the motion of an earlier query.
    pub(super) fn start(&mut self) {
        (self.contact, self.has_motion) = (None, false);
    }

    /// Whether layers are enabled and the root of the natural motion moves over the ground at walking speed or faster.
    pub(super) fn walks(&mut self, query: Query<'_>, request: &ActiveRequest) -> bool {
        /// Time over which the speed is measured, in seconds, and minimum speed of a walk, in metres per second.
        const WALK: (f32, f32) = (0.3, 0.4);
        let Query { baked, settings } = query;
        if settings.entries.layers == 0 || !baked.entries().has_layers() {
            return false;
        }
        let motion = self.natural(baked, request);
        let [now, then] = [0.0, WALK.0].map(|seconds| motion.root(baked.graph(), seconds));
        (then - now).with_y(0.0).length() > WALK.0 * WALK.1
    }

    /// Time at which the attack hits the natural motion, in seconds.
    pub(super) fn contact(
        &mut self,
        baked: &BakedGraph,
        request: &ActiveRequest,
        body: &mut MotionBody,
    ) -> Option<f32> {
        if let Some(known) = self.contact {
            return known;
        }
        self.natural(baked, request);
        let test = ExactTest {
            extent: Extent::UNTIL_HIT,
            sampling: Sampling::CoarseFirst,
            ..ExactTest::new(baked, &request.attack)
        };
        let found = test.on_motion(&self.motion, body);
        let found = (!found.is_clean()).then_some(found.time);
        self.contact = Some(found);
        found
    }

    /// Time until which the root of the natural motion enters no obstacle, in seconds.
    pub(super) fn free_until(&mut self, baked: &BakedGraph, request: &ActiveRequest) -> f32 {
        if !is_sought(request) {
            return f32::INFINITY;
        }
        let motion = self.natural(baked, request);
        let end = motion.moment_at(request.attack.end());
        let hit = request.obstacles.until(baked.graph(), end, 0.0);
        hit.map_or(f32::INFINITY, |hit| hit.time)
    }

    /// The natural motion of the request.
    fn natural(&mut self, baked: &BakedGraph, request: &ActiveRequest) -> &Motion {
        if !std::mem::replace(&mut self.has_motion, true) {
            self.motion.restart(baked.graph(), request.playhead, []);
            self.motion.continue_blend(&request.blend, 0.0);
            self.motion
                .extend(baked.graph(), request.attack.end() + 0.5);
        }
        &self.motion
    }

    /// The natural motion, once [`EntryScratch::contact`] has found one, and the ranking of layers.
    pub(super) fn layered(&mut self) -> (&Motion, &mut LayerRanking) {
        (&self.motion, &mut self.ranking)
    }
}

fn stance(baked: &BakedGraph, seconds: f32, scratch: &mut EntryScratch) -> Stance {
    let EntryScratch {
        motion,
        pose,
        joints,
        ..
    } = scratch;
    motion.sample(baked.graph(), seconds, pose);
    forward_kinematics(baked.graph().skeleton(), pose, joints);
    baked.stance(joints)
}

/// An entry of the table at a moment of the natural motion.
struct Jump<'a> {
    known: KnownEntry,
    /// Stance at the moment.
    stance: &'a Stance,
    /// Time from now to the moment, in seconds.
    delay: f32,
    /// Time from the moment to the contact, in seconds.
    left: f32,
}

impl Jump<'_> {
    /// Adds a candidate for each rate that brings the evasion to the contact in time.
    fn add_rates(&self, query: Query<'_>, entries: &mut Vec<EntryCandidate>) {
        let Query { baked, settings } = query;
        let uses = &settings.entries;
        let &Jump {
            known,
            stance,
            delay,
            left,
        } = self;
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
}

/// Maximum number of entries. For attacks with very many spheres or a duration of minutes it is lower than the setting.
fn most_entries(uses: &EntryUse, request: &ActiveRequest) -> usize {
    /// Maximum number of entries if there are obstacles, because their tests cost more.
    const AMONG_OBSTACLES: usize = 40;
    /// Maximum number of samples of spheres of all entries together.
    const MOST_SAMPLES: f32 = 500_000.0;
    let attack = &request.attack;
    let most = match is_sought(request) {
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

pub(super) fn rate_of(rate: f32) -> Rate {
    let direction = match rate {
        faster if faster > 1.0 => Direction::Faster,
        slower if slower < 1.0 => Direction::Slower,
        _ => Direction::Unchanged,
    };
    Rate { rate, direction }
}
