//! Constraints of a warp: its time, its bounds, the reach of legs, and balance. The final check of a warped motion, frame by frame: planted feet
//! stay in place, and no joint exceeds the limits of speed.
//!
//! Source of the balance: the support polygon for standing, and the inverted pendulum while a foot is lifted: a body at a distance d from its
//! support moves by d (cosh(t √(g / h)) - 1) within t seconds (Hof, Gazendam & Sinke 2005, equation 2).

use glam::{Quat, Vec2, Vec3};

use super::linear::{Gradient, Numbers, Row, Scales, bend_from, dot, scaled};
use super::ticks::Tick;
use crate::anim::{Bend, Chain, Envelope, Pose, Rig};
use crate::graph::{Motion, MotionGraph};
use crate::maps::BakedGraph;
use crate::query::clearance::SAMPLE_RATE;
use crate::query::settings::{WarpBounds, WarpLimits, WarpSettings};

/// Number of samples on each side of the moment at which the attack is nearest that are linearised.
pub(super) const SAMPLES: usize = 3;

/// Constraints of a solution.
pub(super) struct Goal {
    pub envelope: Envelope,
    pub scales: Scales,
    support: Option<Support>,
    /// Distance of the centre of mass from the support without a warp, in metres; `None` before the first round.
    beside: Option<f32>,
}

impl Goal {
    /// Constraints for the samples at which the attack is near. `None` if there is no time for a warp.
    pub(super) fn new(
        baked: &BakedGraph,
        settings: &WarpSettings,
        motion: &Motion,
        ticks: &[Tick],
    ) -> Option<Self> {
        let (first, last) = (ticks.first()?.seconds(), ticks.last()?.seconds());
        let middle = SAMPLES as f32 / SAMPLE_RATE;
        let envelope = envelope(&settings.limits, [first + middle, last - middle])?;
        let rig = baked.graph().rig();
        let (bounds, limits) = (&settings.bounds, &settings.limits);
        let mut scales = scales_within(bounds, limits, &envelope, rig.spine().len());
        let may_lift = may_lift(baked, motion, &envelope);
        for (limb, scale) in scales.ends.iter_mut().enumerate() {
            let is_there = rig.limbs()[limb].is_some();
            if !is_there || may_lift.get(limb) == Some(&false) {
                *scale = 0.0;
            }
        }
        // Without known legs, feet would slide.
        if rig.legs().is_none() {
            scales.pelvis = 0.0;
        }
        Some(Self {
            envelope,
            scales,
            support: support(baked, limits, motion, &envelope),
            beside: None,
        })
    }

    /// Adds the conditions of legs and balance at the samples, linearised at the current parameters `numbers`.
    pub(super) fn add_limit_rows(
        &mut self,
        baked: &BakedGraph,
        ticks: &[Tick],
        numbers: &Numbers,
        rows: &mut Vec<Row>,
    ) {
        let scales = &self.scales;
        for tick in ticks {
            add_leg_rows(baked.graph().rig(), tick, scales, numbers, rows);
        }
        let (Some(support), Some(tick)) = (self.support, ticks.get(ticks.len() / 2)) else {
            return;
        };
        // In the first round the motion has no warp yet.
        let beside = *self.beside.get_or_insert_with(|| {
            let masses = Masses::new(baked, &tick.centres);
            beside(baked, tick, support, masses.centre).map_or(0.0, |(distance, _)| distance)
        });
        let bend = bend_from(numbers, scales);
        let in_air = (0..Rig::LEGS).find(|&limb| bend.ends[limb].length() > LIFTED);
        // Time during which the weight of the warp is above one half, in seconds.
        let envelope = &self.envelope;
        let seconds = 0.5 * (envelope.release + envelope.end - envelope.start - envelope.full);
        let support = match in_air {
            Some(limb) if support.feet[limb] => support.without(limb, seconds),
            _ => support,
        };
        rows.extend(balance_row(baked, tick, support, beside, scales, numbers));
    }
}

/// Displacement above which a foot counts as lifted, in metres.
const LIFTED: f32 = 0.01;

/// Support of a body that stands still while the attack passes. `None` if the body moves.
fn support(
    baked: &BakedGraph,
    limits: &WarpLimits,
    motion: &Motion,
    envelope: &Envelope,
) -> Option<Support> {
    /// Maximum speed of a body that stands still, in metres per second.
    const STILL: f32 = 0.3;
    let graph = baked.graph();
    let [from, to] = [envelope.full, envelope.release].map(|t| motion.root(graph, t));
    let way = (to - from) * Vec3::new(1.0, 0.0, 1.0);
    let is_still = way.length() < STILL * (envelope.release - envelope.full);
    let middle = motion.playhead(graph, 0.5 * (envelope.full + envelope.release));
    let feet = [0, 1].map(|limb| graph.foot_stands(middle.edge, middle.frame, limb));
    (is_still && feet == [true; 2]).then_some(Support {
        feet,
        allowed: limits.balance,
    })
}

/// Returns for each leg whether its foot may be lifted: if it does not stand, or if the other foot stands, as long as the warp acts.
fn may_lift(baked: &BakedGraph, motion: &Motion, envelope: &Envelope) -> [bool; Rig::LEGS] {
    /// Number of moments that are examined.
    const LOOKS: usize = 10;
    let graph = baked.graph();
    let mut may = [true; Rig::LEGS];
    for look in 0..=LOOKS {
        let share = look as f32 / LOOKS as f32;
        let at = motion.playhead(
            graph,
            envelope.start + (envelope.end - envelope.start) * share,
        );
        let stands = [0, 1].map(|limb| graph.foot_stands(at.edge, at.frame, limb));
        for limb in 0..Rig::LEGS {
            may[limb] &= !stands[limb] || stands[1 - limb];
        }
    }
    may
}

/// Envelope around the times at which the attack is nearest, or `None` if there is no time for the fade-in.
fn envelope(limits: &WarpLimits, [from, to]: [f32; 2]) -> Option<Envelope> {
    /// Longest fade, in seconds.
    const LONGEST: f32 = 10.0;
    let hold = limits.hold.min(LONGEST);
    let (full, release) = (from - hold, to + hold);
    let way_in = (full - limits.reaction).min(limits.way_in).min(LONGEST);
    let way_out = limits.way_out.min(LONGEST);
    let has_time = way_in >= limits.shortest_way_in && way_in > 0.0 && way_out > 0.0;
    has_time.then_some(Envelope {
        start: full - way_in,
        full,
        release,
        end: release + way_out,
    })
}

/// The bounds of a bend, reduced so that no part exceeds the limits of speed within the envelope. `spine` is the number of joints of the spine.
fn scales_within(
    bounds: &WarpBounds,
    limits: &WarpLimits,
    envelope: &Envelope,
    spine: usize,
) -> Scales {
    let way = envelope.shortest_way();
    let by_speed = |speed: f32| speed * way / Envelope::STEEPEST;
    let turn = by_speed(limits.angular_velocity)
        .min(limits.angular_acceleration * way * way / Envelope::SHARPEST);
    let shift =
        by_speed(limits.root_speed).min(limits.root_acceleration * way * way / Envelope::SHARPEST);
    let end = by_speed(limits.end_speed);
    Scales {
        spine: bounds.spine.min(turn * spine as f32),
        pelvis: bounds.pelvis.min(shift),
        ends: std::array::from_fn(|limb| bounds.end(limb).min(end)),
        ahead: bounds.time.min(by_speed(limits.rate)),
    }
}

/// Sum of the squared shares of the bounds that a bend uses.
pub(super) fn effort(bounds: &WarpBounds, bend: &Bend) -> f32 {
    let share = |length: f32, bound: f32| match length {
        0.0 => 0.0,
        _ => (length / bound).powi(2),
    };
    let ends = bend.ends.iter().enumerate();
    let ends: f32 = ends
        .map(|(limb, end)| share(end.length(), bounds.end(limb)))
        .sum();
    share(bend.spine.length(), bounds.spine)
        + share(bend.pelvis.length(), bounds.pelvis)
        + ends
        + share(bend.ahead, bounds.time)
}

/// Distance from a limit, in metres. Below it the condition is added.
const NEAR: f32 = 0.12;

/// Adds the conditions that keep each ankle's distance from its hip within the range of the leg's bones, at a sample of a body with the bend
/// of `numbers`.
fn add_leg_rows(rig: &Rig, tick: &Tick, scales: &Scales, numbers: &Numbers, rows: &mut Vec<Row>) {
    for (limb, range) in tick.legs.iter().enumerate() {
        let Some(leg) = rig.limbs()[limb] else {
            continue;
        };
        let [hip, foot] = [leg.hip, leg.foot].map(|joint| tick.joints[joint.index()].translation);
        let distance = hip.distance(foot);
        let Some(along) = (hip - foot).try_normalize() else {
            continue;
        };
        let mut gradient = Gradient {
            pelvis: along * tick.weight,
            ..Gradient::default()
        };
        gradient.ends[limb] = -along * tick.weight;
        let slope = scaled(&gradient, scales);
        let at_now = dot(&slope, numbers);
        if distance > range.furthest - NEAR {
            rows.push(Row {
                slope: slope.map(|number| -number),
                least: distance - range.furthest - at_now,
            });
        }
        if distance < range.nearest + NEAR {
            rows.push(Row {
                slope,
                least: range.nearest - distance + at_now,
            });
        }
    }
}

/// Conditions that lift a displaced foot by at least half of its displacement.
pub(super) fn lift_rows(limb: usize, scales: &Scales, rows: &mut Vec<Row>) {
    for (x, z) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)] {
        let mut gradient = Gradient::default();
        gradient.ends[limb] = Vec3::new(x, 1.0, z);
        rows.push(Row {
            slope: scaled(&gradient, scales),
            least: 0.0,
        });
    }
}

/// Distance from the bones of a foot to its edge, in metres.
const HALF_FOOT: f32 = 0.05;

#[derive(Clone, Copy, Debug)]
struct Support {
    feet: [bool; Rig::LEGS],
    /// Maximum distance of the centre of mass from the support, in metres.
    allowed: f32,
}

impl Support {
    /// Support while the foot of a limb is lifted for `seconds`.
    fn without(self, limb: usize, seconds: f32) -> Self {
        /// √(g / h) in 1/s, and the maximum sway in metres.
        const RATE: f32 = 3.2;
        const SWAY: f32 = 0.05;
        let mut feet = self.feet;
        feet[limb] = false;
        let fallen = (0.5 * seconds * RATE).cosh() - 1.0;
        Self {
            feet,
            allowed: self.allowed + SWAY / fallen.max(0.05),
        }
    }
}

/// Centre of mass of the whole body, and of trunk, arms and head, and their share of the mass.
struct Masses {
    centre: Vec3,
    upper: Vec3,
    upper_share: f32,
}

impl Masses {
    fn new(baked: &BakedGraph, centres: &[Vec3]) -> Self {
        let rig = baked.graph().rig();
        let (mut all, mut upper) = ((Vec3::ZERO, 0.0), (Vec3::ZERO, 0.0));
        let masses = baked.body_rows().masses();
        for ((sphere, &centre), mass) in baked.body().spheres.iter().zip(centres).zip(masses) {
            all = (all.0 + centre * mass, all.1 + mass);
            if rig.part(sphere.joint).spine == rig.spine().len() {
                upper = (upper.0 + centre * mass, upper.1 + mass);
            }
        }
        Self {
            centre: all.0 / all.1,
            upper: if upper.1 > 0.0 {
                upper.0 / upper.1
            } else {
                Vec3::ZERO
            },
            upper_share: upper.1 / all.1,
        }
    }
}

/// Condition that keeps the centre of mass over the feet at a sample, if the bend with the parameters `numbers` does not. `allowed` is its
/// distance from the support without a warp.
fn balance_row(
    baked: &BakedGraph,
    tick: &Tick,
    support: Support,
    allowed: f32,
    scales: &Scales,
    numbers: &Numbers,
) -> Option<Row> {
    let rig = baked.graph().rig();
    let masses = Masses::new(baked, &tick.centres);
    let (distance, out) = beside(baked, tick, support, masses.centre)?;
    let excess = distance - allowed.max(support.allowed);
    if excess <= 0.0 {
        return None;
    }
    let out = Vec3::new(out.x, 0.0, out.y);
    let lever = tick.lever(rig, rig.spine().len(), masses.upper);
    let gradient = Gradient {
        // About half of the mass of the legs, whose feet stay in place, follows the pelvis.
        pelvis: out * (0.5 + 0.5 * masses.upper_share) * tick.weight,
        spine: lever.cross(out) * masses.upper_share * tick.weight,
        ..Gradient::default()
    };
    let slope = scaled(&gradient, scales).map(|number| -number);
    Some(Row {
        slope,
        least: excess + dot(&slope, numbers),
    })
}

/// Distance and direction of a point from the support at a sample; `None` if it lies over the support, or if no foot is planted.
fn beside(baked: &BakedGraph, tick: &Tick, support: Support, place: Vec3) -> Option<(f32, Vec2)> {
    let rig = baked.graph().rig();
    let place = Vec2::new(place.x, place.z);
    let mut points = [Vec2::ZERO; 2 * Rig::LEGS];
    let mut count = 0;
    for limb in (0..Rig::LEGS).filter(|&limb| support.feet[limb]) {
        let leg = rig.limbs()[limb]?;
        for joint in [leg.foot, leg.toe_or_foot()] {
            let at = tick.joints[joint.index()].translation;
            points[count] = Vec2::new(at.x, at.z);
            count += 1;
        }
    }
    let points = &points[..count];
    if points.is_empty() {
        return None;
    }
    // The nearest point of a convex hull of so few points lies on a line between two of them, unless the position lies inside a triangle of
    // three.
    let is_within = |a: Vec2, b: Vec2, c: Vec2| {
        let turns = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(place - from));
        turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
    };
    for (i, &a) in points.iter().enumerate() {
        for (j, &b) in points.iter().enumerate().skip(i + 1) {
            if points[j + 1..].iter().any(|&c| is_within(a, b, c)) {
                return None;
            }
        }
    }
    let mut nearest = points[0];
    for (i, &a) in points.iter().enumerate() {
        for &b in &points[i..] {
            let line = b - a;
            let share = (place - a).dot(line) / line.length_squared().max(f32::MIN_POSITIVE);
            let on_line = a + line * share.clamp(0.0, 1.0);
            if on_line.distance_squared(place) < nearest.distance_squared(place) {
                nearest = on_line;
            }
        }
    }
    let away = place - nearest;
    let distance = away.length() - HALF_FOOT;
    (distance > 0.0).then(|| (distance, away.normalize_or(Vec2::X)))
}

/// Scratch of the check: poses of the last three frames, each without and with the warp.
pub(super) type Frames = [[Pose; 2]; 3];

/// Whether a warped motion passes the check in each frame within the envelope, at the frame rate of the clips. `plain` is the motion without the
/// warp.
pub(super) fn is_sound(
    graph: &MotionGraph,
    motion: &Motion,
    plain: &Motion,
    limits: &WarpLimits,
    frames: &mut Frames,
) -> bool {
    let Some(warp) = motion.warp() else {
        return true;
    };
    let rate = graph.frame_rate() as f32;
    let first = (warp.envelope.start.max(0.0) * rate) as usize;
    let last = (warp.envelope.end * rate).ceil() as usize + 1;
    for (count, frame) in (first.saturating_sub(1)..=last).enumerate() {
        frames.rotate_left(1);
        let seconds = frame as f32 / rate;
        let [base, bent] = &mut frames[2];
        motion.sample_unbent(graph, seconds, bent);
        match warp.moment(seconds) == seconds {
            true => base.copy_from(bent),
            false => plain.sample(graph, seconds, base),
        }
        let weight = warp.envelope.weight(seconds);
        if weight > 0.0 {
            let feet_before = ankles(graph, bent);
            warp.bend.apply(graph.rigged_skeleton(), weight, bent);
            let stay = do_feet_stay(graph, motion, limits.slide, &feet_before, bent, seconds);
            if !stay || !are_toes_above_floor(graph, base, bent) {
                return false;
            }
        }
        if count >= 1 && !are_speeds_allowed(graph, limits, frames, count >= 2) {
            return false;
        }
    }
    true
}

/// Whether planted feet move by at most `slide` metres, except lifted ones.
fn do_feet_stay(
    graph: &MotionGraph,
    motion: &Motion,
    slide: f32,
    before: &[Option<Vec3>; Rig::LEGS],
    pose: &Pose,
    seconds: f32,
) -> bool {
    let playhead = motion.playhead(graph, seconds);
    let after = ankles(graph, pose);
    let bend = motion.warp().map(|warp| warp.bend).unwrap_or_default();
    for limb in 0..Rig::LEGS {
        let (Some(before), Some(after)) = (before[limb], after[limb]) else {
            continue;
        };
        let is_lifted = bend.ends[limb] != Vec3::ZERO;
        let stands = graph.foot_stands(playhead.edge, playhead.frame, limb);
        if stands && !is_lifted && before.distance(after) > slide {
            return false;
        }
    }
    true
}

/// Whether no toe of a bent pose is below the floor, or below that of the pose without the bend.
fn are_toes_above_floor(graph: &MotionGraph, base: &Pose, bent: &Pose) -> bool {
    /// What a toe may sink, and how near the floor it counts as below, in metres: it may sink further between frames.
    const NEAR: f32 = 0.003;
    let chains = [base, bent].map(|pose| Chain::of(graph.skeleton(), pose));
    let legs = graph.rig().limbs()[..Rig::LEGS].iter().flatten();
    legs.into_iter().all(|leg| {
        let heights = [0, 1].map(|at| chains[at].global(leg.toe_or_foot()).translation.y);
        heights[1] >= (heights[0] - NEAR).min(NEAR)
    })
}

/// Whether no displaced joint exceeds the limits, unless the motion without the warp exceeds them too.
fn are_speeds_allowed(
    graph: &MotionGraph,
    limits: &WarpLimits,
    frames: &Frames,
    has_three: bool,
) -> bool {
    let rate = graph.frame_rate() as f32;
    for joint in 0..graph.skeleton().len() {
        let [before, now] = [1, 2].map(|at| [0, 1].map(|kind| frames[at][kind].rotations[joint]));
        let earlier = [0, 1].map(|kind| {
            let pose = frames[0][kind].rotations.get(joint);
            pose.copied().unwrap_or(before[kind])
        });
        if now[0] == now[1] && before[0] == before[1] {
            continue;
        }
        let velocity = |a: Quat, b: Quat| {
            let turn = a.conjugate() * b;
            let turn = if turn.w < 0.0 { -turn } else { turn };
            // For the small angles between two frames the sine is nearly the angle.
            turn.xyz() * (2.0 * rate)
        };
        let speeds = |kind: usize| {
            let latest = velocity(before[kind], now[kind]);
            let change = (latest - velocity(earlier[kind], before[kind])) * rate;
            (latest.length(), change.length())
        };
        let (own, bent) = (speeds(0), speeds(1));
        let is_faster = bent.0 > limits.angular_velocity.max(own.0);
        let is_sharper = has_three && bent.1 > limits.angular_acceleration.max(own.1);
        if is_faster || is_sharper {
            return false;
        }
    }
    true
}

fn ankles(graph: &MotionGraph, pose: &Pose) -> [Option<Vec3>; Rig::LEGS] {
    let chain = Chain::of(graph.skeleton(), pose);
    [0, 1].map(|limb| {
        let leg = graph.rig().limbs()[limb]?;
        Some(chain.global(leg.foot).translation)
    })
}
