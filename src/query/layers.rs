//! Candidates that layer the upper body of an evasion over the natural motion.
//!
//! Source: the layers are those that the bake found ([`EntryTable`](crate::maps::EntryTable)). Maps are drawn for whole bodies and give no
//! bound for a body that is composed during the query, so layers are not culled. They are ranked by their distance from the attack at a few
//! moments ([`LayerRanking`]), and the best few are tested exactly.

use super::ask::Query;
use super::candidate::{Candidate, CandidateKind};
use super::entries::{USEFUL, rate_of};
use super::evaluate::EvaluateScratch;
use super::layer_candidate::LayerCandidate;
use super::layer_ranking::{AttackContact, LayerRanking, LayeredEvasion};
use super::state::QueryState;
use crate::anim::Envelope;
use crate::graph::{ClipPosition, Layer};
use crate::maps::KnownEntry;

/// Playback rates that are tried.
const RATES: [f32; 3] = [1.0, 1.25, 1.5];
/// Times from a layer's start to the contact that are tried, in seconds. If the contact is earlier, the layer starts at once.
const LEFT: [f32; 4] = [0.3, 0.45, 0.65, 0.9];
/// Minimum and maximum time from the contact to the start of the fade-out, in seconds.
const HELD: [f32; 2] = [0.1, 0.35];
/// Duration of the fade-out, in seconds.
const WAY_OUT: f32 = 0.4;
/// Wanted distance at the moments of the ranking, in metres. Between the moments the attack comes nearer.
const WANTED: f32 = 0.06;

/// Distance below which a layer is not a candidate, in metres. A warp may make shallower hits clean.
const DEEPEST: f32 = -0.05;

/// Adds the layered evasions that come nearest to a narrow miss, if the natural motion is hit.
pub(super) fn gather_layers(
    query: Query<'_>,
    state: &mut QueryState,
    scratch: &mut EvaluateScratch,
) {
    let Query { baked, settings } = query;
    let (graph, entries) = (baked.graph(), baked.entries());
    state.layers.clear();
    if settings.entries.layers == 0 || !entries.has_layers() {
        return;
    }
    let (scratch, body) = scratch.for_entries();
    // Pelvis and legs follow the natural motion into the obstacle.
    if scratch.free_until(baked, &state.request) < f32::INFINITY {
        return;
    }
    let Some(contact) = scratch.contact(baked, &state.request, body) else {
        return;
    };
    let (motion, ranking) = scratch.layered();
    let attack = AttackContact {
        attack: &state.request.attack,
        seconds: contact,
    };
    ranking.look_at(baked, motion, attack);
    // No layer avoids an attack that hits pelvis or legs.
    if ranking.below_waist() < DEEPEST {
        return;
    }
    for left in LEFT {
        let delay = (contact - left).max(0.0);
        let playhead = motion.playhead(graph, delay);
        for &known in entries.layers_at(graph, playhead) {
            let start = Start {
                known,
                delay,
                contact,
            };
            start.add_rates(query, ranking, &mut state.layers);
        }
        if left >= contact {
            break;
        }
    }
    let missing = |one: &LayerCandidate| (one.metres - WANTED).abs();
    let order = |one: &LayerCandidate| (one.evasion, one.layer.envelope.start, one.layer.frame);
    state.layers.sort_unstable_by(|a, b| {
        let (first, second) = (order(a), order(b));
        missing(a)
            .total_cmp(&missing(b))
            .then(first.0.cmp(&second.0))
            .then(first.1.total_cmp(&second.1))
            .then(first.2.total_cmp(&second.2))
            .then(a.layer.rate.total_cmp(&b.layer.rate))
    });
    state.layers.truncate(settings.entries.layers);
    let list = &mut state.candidates.list;
    list.extend(state.layers.iter().zip(0..).map(|(one, index)| Candidate {
        kind: CandidateKind::Layer(index),
        rate: rate_of(one.layer.rate),
    }));
    state.search.followed += state.layers.len();
}

/// A layer of the table at a moment of the natural motion.
struct Start {
    known: KnownEntry,
    /// Time from now to the start of the layer, in seconds.
    delay: f32,
    /// Time from now to the contact, in seconds.
    contact: f32,
}

impl Start {
    /// Adds a candidate for each rate at which the evasion is under way at the contact.
    fn add_rates(
        &self,
        query: Query<'_>,
        ranking: &LayerRanking,
        layers: &mut Vec<LayerCandidate>,
    ) {
        let Query { baked, settings } = query;
        let graph = baked.graph();
        let &Self {
            known,
            delay,
            contact,
        } = self;
        let target = baked.entries().targets()[usize::from(known.target)];
        let evasion = usize::from(target.evasion);
        let edge = graph.edge(baked.evasions()[evasion].edge);
        let start = graph.node(edge.from);
        let seconds = |frames: f64| (frames / graph.frame_rate()) as f32;
        // Times since the evasion's start.
        let now = seconds(f64::from(target.frame) - f64::from(start.frame));
        let end = seconds(f64::from(edge.frames));
        let fastest = known.fastest().min(settings.entries.fastest);
        for rate in RATES {
            let at_contact = now + (contact - delay) * rate;
            let is_useful = (USEFUL.0..=end + USEFUL.1).contains(&at_contact);
            if !is_useful || rate > fastest {
                continue;
            }
            let full = delay + known.blend();
            let over = delay + (end - now) / rate;
            let release = over.clamp(contact + HELD[0], contact + HELD[1]).max(full);
            let envelope = Envelope {
                start: delay,
                full,
                release,
                end: release + WAY_OUT,
            };
            let position = ClipPosition {
                clip: start.clip,
                frame: target.frame as f32,
            };
            let layer = Layer::new(position, rate, envelope);
            let layered = LayeredEvasion {
                layer: &layer,
                evasion,
            };
            let metres = ranking.distance(baked, layered, DEEPEST);
            layers.extend(metres.map(|metres| LayerCandidate {
                layer,
                evasion,
                metres,
            }));
        }
    }
}
