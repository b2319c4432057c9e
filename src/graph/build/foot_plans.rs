//! Plans how transitions move their feet.

use crate::anim::free_distance;
use crate::graph::ClipId;
use crate::graph::motion_graph::{Edge, EdgeId, EdgeMotion, LegBlend, MotionGraph};
use crate::graph::play::sample::{Sides, foot, root_drop_share};
use crate::math::in_parallel;
use glam::Vec3;

/// Minimum and maximum duration of a step in place, in seconds. A transition may be shorter.
const STEP: [f64; 2] = [0.15, 0.30];
/// Height of a step as a share of its length, and maximum height as a share of the leg's length.
/// This matches a boxer's shuffle: the foot clears the ground but does not stride.
const LIFT: (f32, f32) = (0.9, 0.045);
/// Maximum lowering of the root, as a share of the leg's length.
const MAX_ROOT_DROP: f32 = 0.04;
/// Minimum share of the root's lowering at which reach is checked. Below it, legs may fail to
/// reach.
const MIN_DROP_SHARE: f32 = 0.2;

/// Blends of all edges, `[edge][leg]`, and the maximum lowering of the root on each edge, in metres.
pub(crate) fn all(graph: &MotionGraph, threads: usize) -> (Vec<Option<LegBlend>>, Vec<f32>) {
    let legs = graph.feet.legs.len();
    let planned = in_parallel(threads, graph.edges.len(), |edge| {
        let edge = graph.edge(EdgeId(edge as u32));
        if edge.motion == EdgeMotion::Clip {
            return (vec![None; legs], 0.0);
        }
        let blends = plan(graph, edge);
        let drop = max_root_drop(graph, edge, &blends);
        (blends, drop)
    });
    let (blends, drops): (Vec<_>, Vec<f32>) = planned.into_iter().unzip();
    (blends.concat(), drops)
}

/// Plants of one foot at both ends of a transition, in frames since its start.
#[derive(Clone, Copy, Debug, Default)]
struct PlantedEnds {
    /// Last frame of the source's plant.
    until: Option<f32>,
    /// First frame of the target's plant.
    from: Option<f32>,
}

fn plan(graph: &MotionGraph, edge: &Edge) -> Vec<Option<LegBlend>> {
    let legs = graph.feet.legs.len();
    let plants: Vec<PlantedEnds> = (0..legs)
        .map(|leg| planted_ends(graph, edge, leg))
        .collect();
    let steps = step_order(graph, edge, &plants);
    let frames = edge.frames as f32;
    let blend = |leg: usize| {
        let PlantedEnds { until, from } = plants[leg];
        let (leave, land) = match (until, from) {
            (None, None) => return None,
            (Some(until), None) => (until.min(0.5 * frames), frames),
            (None, Some(from)) => (0.0, from.max(0.5 * frames)),
            (Some(until), Some(from)) => match steps.iter().position(|&other| other == leg) {
                Some(turn) => step_times(graph, edge, [until, from], turn, steps.len()),
                None => (until, from),
            },
        };
        let lift = if steps.contains(&leg) {
            lift(graph, edge, leg, 0.5 * (leave + land))
        } else {
            0.0
        };
        Some(LegBlend { leave, land, lift })
    };
    (0..legs).map(blend).collect()
}

/// Finds the relevant plants: the source's last plant that starts in the first half of the
/// transition, and the target's first plant that ends in the second half.
fn planted_ends(graph: &MotionGraph, edge: &Edge, leg: usize) -> PlantedEnds {
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
    PlantedEnds { until, from }
}

/// Legs that have to step in place, because source and target plant them at the same time or nearly
/// so. The leg that bears less weight comes first.
fn step_order(graph: &MotionGraph, edge: &Edge, plants: &[PlantedEnds]) -> Vec<usize> {
    let shortest = shortest_step(graph, edge);
    let mut steps: Vec<usize> = (0..plants.len())
        .filter(|&leg| match plants[leg] {
            PlantedEnds {
                until: Some(until),
                from: Some(from),
            } => from - until < shortest,
            _ => false,
        })
        .collect();
    if let Some(sides) = Sides::new(graph, edge, 0.0) {
        let root = sides.root();
        // Distance in micrometres, which sorts as an integer.
        let away = |leg: usize| {
            let foot = sides.source().global(graph.feet.legs[leg].foot);
            let away = foot.translation - root;
            (1e6 * away.x.hypot(away.z)) as i64
        };
        steps.sort_by_key(|&step| std::cmp::Reverse(away(step)));
    }
    steps
}

fn shortest_step(graph: &MotionGraph, edge: &Edge) -> f32 {
    ((STEP[0] * graph.frame_rate) as f32).min(edge.frames as f32)
}

/// Start and end of step number `turn` of `count`. The steps share the transition evenly, as far as
/// the plants allow.
fn step_times(
    graph: &MotionGraph,
    edge: &Edge,
    [until, from]: [f32; 2],
    turn: usize,
    count: usize,
) -> (f32, f32) {
    let frames = edge.frames as f32;
    let share = frames / count as f32;
    let longest = (STEP[1] * graph.frame_rate) as f32;
    let length = share.min(longest).max(shortest_step(graph, edge));
    let middle = ((turn as f32 + 0.5) * share).clamp(until.min(from), until.max(from));
    let leave = (middle - 0.5 * length).clamp(0.0, frames - length);
    (leave, (leave + length).min(frames))
}

/// Height of the step of a foot between its positions in source and target.
fn lift(graph: &MotionGraph, edge: &Edge, leg: usize, frame: f32) -> f32 {
    let leg = &graph.feet.legs[leg];
    let Some(sides) = Sides::new(graph, edge, frame) else {
        return 0.0;
    };
    let distance = sides.apart(leg.toe_or_foot());
    let (share, most) = LIFT;
    (share * distance).min(most * leg.length(&graph.skeleton))
}

/// Maximum lowering of the root for which all planted feet are within reach.
fn max_root_drop(graph: &MotionGraph, edge: &Edge, blends: &[Option<LegBlend>]) -> f32 {
    let mut largest_drop: f32 = 0.0;
    if blends.iter().all(Option::is_none) {
        return largest_drop;
    }
    for frame in (1..edge.frames).map(|frame| frame as f32) {
        let share = root_drop_share(frame / edge.frames as f32);
        let Some(sides) = Sides::new(graph, edge, frame).filter(|_| share >= MIN_DROP_SHARE) else {
            continue;
        };
        let body = sides.blend();
        for (leg, blend) in graph.feet.legs.iter().zip(blends) {
            let Some(blend) = blend else { continue };
            let foot = foot(&sides, leg, *blend).translation;
            let (hip, free) = free_distance(&body, leg);
            let needed = too_high(hip, free, foot);
            let most = MAX_ROOT_DROP * leg.length(&graph.skeleton);
            largest_drop = largest_drop.max((needed / share).min(most));
        }
    }
    largest_drop
}

/// Amount by which a hip is too high for its leg, in metres. `free` is the maximum length of the
/// leg. It is 0 if the leg reaches, or if the foot is too far away at any height.
fn too_high(hip: Vec3, free: f32, foot: Vec3) -> f32 {
    let away = foot - hip;
    let level = away.x.hypot(away.z);
    if away.length() <= free || level >= free {
        return 0.0;
    }
    (-away.y - (free * free - level * level).sqrt()).max(0.0)
}
