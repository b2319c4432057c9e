//! How does a transition lead its feet?

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::keep::{foot, sinking};
use crate::anim::free_distance;
use crate::graph::sample::Sides;
use crate::graph::{ClipId, Edge, EdgeId, EdgeMotion, MotionGraph};

/// A foot's own blend in a transition: where the source has it until it leaves, where the target has
/// it from when it lands, and in between from the one to the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LegBlend {
    /// When it leaves the source's motion, frames since the transition's start.
    pub leave: f32,
    /// When it is in the target's; after `leave`.
    pub land: f32,
    /// How high it is lifted on the way, metres: above 0 where it would otherwise go from one place
    /// to the other on the ground.
    pub lift: f32,
}

impl LegBlend {
    /// The target's weight and the height above the blend of both, metres.
    pub(super) fn at(self, frame: f32) -> (f32, f32) {
        let s = ((frame - self.leave) / (self.land - self.leave)).clamp(0.0, 1.0);
        // What is in the air anyway goes without a jerk. What is lifted for the step has hardly gone
        // while it is still low. Both begin so gently that even the knee of a straight leg, which
        // gives way as the root of the foot's way, does not start at once.
        let weight = if self.lift > 0.0 {
            s.powi(4) * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)))
        } else {
            s.powi(3) * (10.0 + s * (-15.0 + 6.0 * s))
        };
        let arc = 4.0 * s * (1.0 - s);
        (weight, self.lift * arc * arc * arc)
    }

    pub(super) fn is_sound(self, frames: u32, furthest: f32) -> bool {
        (0.0..=frames as f32).contains(&self.leave)
            && self.land > self.leave
            && self.land <= frames as f32
            && (0.0..=furthest).contains(&self.lift)
    }
}

/// The longest that a step on the spot takes, seconds, and the shortest; a transition may be shorter.
const STEP: [f64; 2] = [0.15, 0.30];
/// A foot is lifted by this share of the way that it goes, at most by this share of the leg. A
/// boxer's shuffle: high enough that nothing drags, low enough not to be a stride.
const LIFT: (f32, f32) = (0.9, 0.045);
/// The deepest that the root sinks for the legs' sake, of the leg.
const DEEPEST: f32 = 0.04;
/// Where the root has done less than this of its sinking, legs that do not reach miss.
const SUNK_ENOUGH: f32 = 0.2;

/// The blends of all edges, `[edge][leg]`, and how far the root sinks in each.
pub(super) fn all(graph: &MotionGraph) -> (Vec<Option<LegBlend>>, Vec<f32>) {
    let (mut blends, mut sinks) = (Vec::new(), Vec::new());
    for id in graph.edge_ids() {
        let first = blends.len();
        plan(graph, id, &mut blends);
        sinks.push(sink(graph, id, &blends[first..]));
    }
    (blends, sinks)
}

/// How one foot stands around a transition, in frames since its start.
#[derive(Clone, Copy, Debug, Default)]
struct Stand {
    /// The last frame of the source's plant.
    until: Option<f32>,
    /// The first frame of the target's.
    from: Option<f32>,
}

/// Appends one blend a leg.
fn plan(graph: &MotionGraph, id: EdgeId, out: &mut Vec<Option<LegBlend>>) {
    let edge = graph.edge(id);
    let legs = graph.feet.legs.len();
    if edge.motion == EdgeMotion::Clip {
        out.extend(std::iter::repeat_n(None, legs));
        return;
    }
    let stands: Vec<Stand> = (0..legs).map(|leg| stand(graph, edge, leg)).collect();
    let steps = step_order(graph, edge, &stands);
    let frames = edge.frames as f32;
    let blend = |leg: usize| {
        let Stand { until, from } = stands[leg];
        let (leave, land) = match (until, from) {
            (None, None) => return None,
            (Some(until), None) => (until.min(0.5 * frames), frames),
            (None, Some(from)) => (0.0, from.max(0.5 * frames)),
            (Some(until), Some(from)) => {
                let Some(turn) = steps.iter().position(|&other| other == leg) else {
                    return Some(LegBlend {
                        leave: until,
                        land: from,
                        lift: 0.0,
                    });
                };
                step_times(graph, edge, [until, from], (turn, steps.len()))
            }
        };
        let lift = if steps.contains(&leg) {
            lift(graph, edge, leg, 0.5 * (leave + land))
        } else {
            0.0
        };
        Some(LegBlend { leave, land, lift })
    };
    out.extend((0..legs).map(blend));
}

/// The plants that matter: the source's last one that began in the first half, the target's first one
/// that ends in the second.
fn stand(graph: &MotionGraph, edge: &Edge, leg: usize) -> Stand {
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    let frames = edge.frames as f32;
    let within = |clip: ClipId, start: u32| {
        let plants = graph.feet.plants(clip, leg).iter();
        plants.map(move |plant| [plant.first, plant.last].map(|f| f as f32 - start as f32))
    };
    let until = within(from.clip, from.frame)
        .filter(|&[first, last]| first <= 0.5 * frames && last > 0.0)
        .map(|[_, last]| last.min(frames))
        .next_back();
    let from = within(to.clip, to.frame - edge.frames)
        .find(|&[first, last]| last >= 0.5 * frames && first < frames)
        .map(|[first, _]| first.max(0.0));
    Stand { until, from }
}

/// The legs that have to step on the spot, since source and target stand on them at once or nearly:
/// the one that bears less of the weight first.
fn step_order(graph: &MotionGraph, edge: &Edge, stands: &[Stand]) -> Vec<usize> {
    let shortest = shortest_step(graph, edge);
    let mut steps: Vec<usize> = (0..stands.len())
        .filter(|&leg| match stands[leg] {
            Stand {
                until: Some(until),
                from: Some(from),
            } => from - until < shortest,
            _ => false,
        })
        .collect();
    if let Some(sides) = Sides::of(graph, edge, 0.0) {
        let root = sides.root();
        steps.sort_by_cached_key(|&leg| {
            let foot = sides.source().global(graph.feet.legs[leg].foot);
            let away = foot.translation - root;
            // As whole numbers, micrometres: they can be compared.
            (-1e6 * away.x.hypot(away.z)) as i64
        });
    }
    steps
}

fn shortest_step(graph: &MotionGraph, edge: &Edge) -> f32 {
    ((STEP[0] * graph.frame_rate) as f32).min(edge.frames as f32)
}

/// When the `turn`th of `count` steps leaves and lands: each has its share of the transition, as far
/// as the plants let it.
fn step_times(
    graph: &MotionGraph,
    edge: &Edge,
    [until, from]: [f32; 2],
    (turn, count): (usize, usize),
) -> (f32, f32) {
    let frames = edge.frames as f32;
    let share = frames / count as f32;
    let longest = (STEP[1] * graph.frame_rate) as f32;
    let length = share.min(longest).max(shortest_step(graph, edge));
    let middle = ((turn as f32 + 0.5) * share).clamp(until.min(from), until.max(from));
    let leave = (middle - 0.5 * length).clamp(0.0, frames - length);
    (leave, (leave + length).min(frames))
}

/// How high a foot is lifted that goes from its place in the source to that in the target.
fn lift(graph: &MotionGraph, edge: &Edge, leg: usize, frame: f32) -> f32 {
    let leg = &graph.feet.legs[leg];
    let Some(sides) = Sides::of(graph, edge, frame) else {
        return 0.0;
    };
    let way = sides.apart(leg.toe_or_foot());
    let (share, most) = LIFT;
    (share * way).min(most * leg.length(&graph.skeleton))
}

/// How far the root must sink at most, for all feet that stand to be within reach.
fn sink(graph: &MotionGraph, id: EdgeId, blends: &[Option<LegBlend>]) -> f32 {
    let edge = graph.edge(id);
    let mut deepest: f32 = 0.0;
    if blends.iter().all(Option::is_none) {
        return deepest;
    }
    for frame in (1..edge.frames).map(|frame| frame as f32) {
        let share = sinking(frame / edge.frames as f32);
        let Some(sides) = Sides::of(graph, edge, frame).filter(|_| share >= SUNK_ENOUGH) else {
            continue;
        };
        let body = sides.blend();
        for (leg, blend) in graph.feet.legs.iter().zip(blends) {
            let Some(blend) = blend else { continue };
            let foot = foot(&sides, leg, *blend, frame).translation;
            let (hip, free) = free_distance(&body, leg);
            let needed = too_high(hip, free, foot);
            let most = DEEPEST * leg.length(&graph.skeleton);
            deepest = deepest.max((needed / share).min(most));
        }
    }
    deepest
}

/// How far a hip is too high for its leg, which is `free` to stretch so far, metres; 0 where it is
/// not, or too far away at any height.
fn too_high(hip: Vec3, free: f32, foot: Vec3) -> f32 {
    let away = foot - hip;
    let level = away.x.hypot(away.z);
    if away.length() <= free || level >= free {
        return 0.0;
    }
    (-away.y - (free * free - level * level).sqrt()).max(0.0)
}
