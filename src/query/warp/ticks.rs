//! The body at the samples around the moment at which the attack is nearest, without and with the warp; the nearest points of attack and body
//! between these samples; and how a bend moves them.

use glam::{Quat, Vec3};

use super::linear::{Gradient, Numbers, Row, Scales, dot, scaled};
use crate::anim::{
    Chain, JointId, JointTransform, Leg, Pose, Rig, forward_kinematics, free_distance,
};
use crate::graph::Motion;
use crate::maps::{BakedGraph, Body, MovingSphere};
use crate::query::attack::Attack;
use crate::query::clearance::{SAMPLE_RATE, closest};
use crate::query::settings::WarpLimits;

#[derive(Clone, Debug, Default)]
pub(super) struct Tick {
    /// Number of the sample since the query.
    pub number: usize,
    /// Weight of the warp at the sample.
    pub weight: f32,
    /// Pose without the bend of the warp, and the time offset at which it was sampled.
    base: Pose,
    ahead: Option<f32>,
    /// For each leg without the warp, the vector from hip to ankle, and the range of its length, in metres.
    pub legs: [LegRange; Rig::LEGS],
    pub pose: Pose,
    pub joints: Vec<JointTransform>,
    pub centres: Vec<Vec3>,
    /// For each limb whose gradient was computed, the rotations of its three joints after each small step of the limb's end.
    steps: [Option<[[Quat; 3]; STEPS]>; Rig::LIMBS],
    /// For each joint of a limb whose gradient was computed, its frames after each small step of the limb's end.
    stepped: Vec<(JointId, [JointTransform; STEPS])>,
}

/// Number of small displacements of a limb's end for finite differences: forwards and backwards along each axis.
const STEPS: usize = 6;

/// Length of a small displacement, in metres.
const STEP: f32 = 0.004;

/// Range of the distance from hip to ankle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LegRange {
    pub nearest: f32,
    pub furthest: f32,
}

impl Tick {
    pub(super) fn restart(&mut self, number: usize) {
        self.number = number;
        self.ahead = None;
    }

    pub(super) fn seconds(&self) -> f32 {
        self.number as f32 / SAMPLE_RATE
    }

    /// Poses the body with the current warp of `motion`.
    pub(super) fn pose(&mut self, baked: &BakedGraph, motion: &Motion, limits: &WarpLimits) {
        let graph = baked.graph();
        let (skeleton, seconds) = (graph.skeleton(), self.seconds());
        let warp = motion.warp().copied().unwrap_or_default();
        self.weight = warp.envelope.weight(seconds);
        let ahead = warp.bend.ahead * self.weight;
        if self.ahead != Some(ahead) {
            motion.sample_unbent(graph, seconds, &mut self.base);
            self.ahead = Some(ahead);
            self.measure_legs(baked, limits);
        }
        self.pose.copy_from(&self.base);
        if self.weight > 0.0 {
            warp.bend
                .apply(graph.rigged_skeleton(), self.weight, &mut self.pose);
        }
        forward_kinematics(skeleton, &self.pose, &mut self.joints);
        baked.body().centres(&self.joints, &mut self.centres);
        self.steps = Default::default();
        self.stepped.clear();
    }

    fn measure_legs(&mut self, baked: &BakedGraph, limits: &WarpLimits) {
        let graph = baked.graph();
        let chain = Chain::of(graph.skeleton(), &self.base);
        for (limb, range) in self.legs.iter_mut().enumerate() {
            let Some(leg) = graph.rig().limbs()[limb] else {
                continue;
            };
            let (hip, furthest) = free_distance(&chain, &leg);
            let knee = chain.within(leg.knee, leg.hip).translation;
            let shin = chain.within(leg.foot, leg.knee).translation;
            let [thigh, shin] = [knee, shin].map(Vec3::length);
            let squared = thigh * thigh + shin * shin - 2.0 * thigh * shin * limits.folded.cos();
            let now = hip.distance(chain.global(leg.foot).translation);
            *range = LegRange {
                // A leg that the motion itself folds further may stay so.
                nearest: squared.max(0.0).sqrt().min(now),
                furthest,
            };
        }
    }

    /// Gradient of the distance of a body sphere in the direction `away`, with respect to the bend, at this sample. `velocity` is the velocity of
    /// the sphere.
    fn gradient(
        &mut self,
        baked: &BakedGraph,
        sphere: usize,
        away: Vec3,
        velocity: Vec3,
    ) -> Gradient {
        let rig = baked.graph().rig();
        let joint = baked.body().spheres[sphere].joint;
        let (part, place) = (rig.part(joint), self.centres[sphere]);
        let mut gradient = Gradient {
            pelvis: away,
            ahead: away.dot(velocity),
            spine: self.lever(rig, part.spine, place).cross(away),
            ..Gradient::default()
        };
        if let Some((limb, leg)) = part.limb.and_then(|limb| Some((limb, rig.limbs()[limb]?))) {
            let end = match part.is_end {
                true => away,
                false => self.end_gradient(baked, (limb, &leg), sphere, away),
            };
            gradient.ends[limb] = end;
            if limb < Rig::LEGS {
                // The foot stays in place, so the rest of the displacement is that of the pelvis.
                gradient.pelvis = away - end;
            }
        }
        let weight = self.weight;
        gradient.pelvis *= weight;
        gradient.spine *= weight;
        gradient.ahead *= weight;
        gradient.ends = gradient.ends.map(|end| end * weight);
        gradient
    }

    /// Vector to a point from the spine joints that move it, averaged over the whole spine.
    pub(super) fn lever(&self, rig: &Rig, count: usize, place: Vec3) -> Vec3 {
        let joints = rig.spine()[..count].iter();
        let levers = joints.map(|joint| place - self.joints[joint.index()].translation);
        levers.sum::<Vec3>() / rig.spine().len().max(1) as f32
    }

    /// Derivative of a limb point along the direction with respect to the displacement of the limb's end, by finite differences.
    fn end_gradient(
        &mut self,
        baked: &BakedGraph,
        limb: (usize, &Leg),
        sphere: usize,
        away: Vec3,
    ) -> Vec3 {
        let sphere = baked.body().spheres[sphere];
        let frames = self.stepped_frames(baked, limb, sphere.joint);
        let places = frames.map(|frame| frame.point(sphere.offset).dot(away));
        let [x, y, z] = [0, 1, 2].map(|axis| places[2 * axis] - places[2 * axis + 1]);
        Vec3::new(x, y, z) / (2.0 * STEP)
    }

    /// Frames of a limb's joint after each small step of the limb's end. Spheres of one limb share the steps, and those of one joint the
    /// frames.
    fn stepped_frames(
        &mut self,
        baked: &BakedGraph,
        (limb, leg): (usize, &Leg),
        joint: JointId,
    ) -> [JointTransform; STEPS] {
        if let Some((_, known)) = self.stepped.iter().find(|(known, _)| *known == joint) {
            return *known;
        }
        let skeleton = baked.graph().skeleton();
        let knee = baked.graph().rig().knee(limb);
        let (pose, end) = (&mut self.pose, self.joints[leg.foot.index()]);
        let parts = [leg.hip, leg.knee, leg.foot].map(JointId::index);
        let kept = parts.map(|part| pose.rotations[part]);
        let solve = |pose: &mut Pose, step: usize| {
            let by = [STEP, -STEP][step % 2] * Vec3::AXES[step / 2];
            let end = JointTransform {
                translation: end.translation + by,
                ..end
            };
            leg.reach_by_knee(skeleton, pose, end, knee);
            let solved = parts.map(|part| pose.rotations[part]);
            set(pose, parts, kept);
            solved
        };
        let solved = *self.steps[limb]
            .get_or_insert_with(|| std::array::from_fn(|step| solve(&mut *pose, step)));
        let frames = solved.map(|rotations| {
            set(pose, parts, rotations);
            Chain::of(skeleton, pose).global(joint)
        });
        set(pose, parts, kept);
        self.stepped.push((joint, frames));
        frames
    }
}

fn set(pose: &mut Pose, joints: [usize; 3], rotations: [Quat; 3]) {
    for (joint, rotation) in joints.into_iter().zip(rotations) {
        pose.rotations[joint] = rotation;
    }
}

/// A body sphere that the attack comes near to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Index of the sample before the contact.
    tick: usize,
    /// Position between the samples: 0 at sample `tick`, 1 at the next sample.
    share: f32,
    sphere: usize,
    /// Distance of the surfaces, in metres.
    pub metres: f32,
    /// Direction from the attack to the body.
    away: Vec3,
}

/// Spheres up to this distance beyond the margin get conditions too, in metres.
const NEAR: f32 = 0.04;

/// Maximum number of contacts between two samples.
const MOST: usize = 6;

/// Finds the contacts between consecutive samples of an attack that should stay `margin` metres away, the nearest first for each pair.
pub(super) fn find_contacts(
    body: &Body,
    attack: &Attack,
    margin: f32,
    ticks: &[Tick],
    contacts: &mut Vec<Contact>,
) {
    contacts.clear();
    for (tick, pair) in ticks.windows(2).enumerate() {
        let [from, to] = [&pair[0], &pair[1]];
        if to.number != from.number + 1 {
            continue;
        }
        let first = contacts.len();
        for sphere in attack.spheres() {
            contacts.extend(contacts_between(
                from,
                to,
                tick,
                body,
                sphere,
                margin + NEAR,
            ));
        }
        contacts[first..]
            .sort_unstable_by(|a, b| a.metres.total_cmp(&b.metres).then(a.sphere.cmp(&b.sphere)));
        contacts.truncate(first + MOST);
    }
}

/// The nearest points of body spheres and a sphere of the attack between two samples, the first of which has the index `tick`. Only distances
/// below `least` metres are reported.
fn contacts_between(
    from: &Tick,
    to: &Tick,
    tick: usize,
    body: &Body,
    attack: &MovingSphere,
    least: f32,
) -> impl Iterator<Item = Contact> {
    let times = [from, to].map(|tick| tick.seconds().clamp(attack.start(), attack.end()));
    let balls = times.map(|t| attack.at(t));
    let shares = times.map(|t| t * SAMPLE_RATE - from.number as f32);
    let spheres = match times[0] < times[1] {
        true => body.spheres.as_slice(),
        false => &[],
    };
    spheres.iter().enumerate().filter_map(move |(sphere, own)| {
        let (start, end) = (from.centres[sphere], to.centres[sphere]);
        let apart = [0, 1].map(|at| start.lerp(end, shares[at]) - balls[at].center);
        let radii = balls.map(|ball| ball.radius + own.radius);
        // Most spheres are farther away at the start than both can move.
        let reach = least + radii[0].max(radii[1]) + (apart[1] - apart[0]).length();
        if reach > 0.0 && apart[0].length_squared() > reach * reach {
            return None;
        }
        let (share, metres) = closest(apart, radii);
        (metres < least).then(|| Contact {
            tick,
            share: shares[0] + (shares[1] - shares[0]) * share,
            sphere,
            metres,
            away: apart[0].lerp(apart[1], share).normalize_or(Vec3::Y),
        })
    })
}

impl Contact {
    /// Gradient of the distance of the surfaces with respect to the bend.
    pub(super) fn gradient(&self, baked: &BakedGraph, ticks: &mut [Tick]) -> Gradient {
        let places = [self.tick, self.tick + 1].map(|tick| ticks[tick].centres[self.sphere]);
        let velocity = (places[1] - places[0]) * SAMPLE_RATE;
        let nearest = self.tick + usize::from(self.share > 0.5);
        ticks[nearest].gradient(baked, self.sphere, self.away, velocity)
    }

    /// Condition that changes the bend with the parameters `numbers` to one that keeps the attack at the margin.
    pub(super) fn row(
        &self,
        gradient: &Gradient,
        scales: &Scales,
        numbers: &Numbers,
        margin: f32,
    ) -> Row {
        let slope = scaled(gradient, scales);
        Row {
            slope,
            least: margin - self.metres + dot(&slope, numbers),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anim::{Bend, Envelope, Warp};
    use crate::graph::EdgeId;
    use crate::math::Rigid2;
    use crate::query::fixture::{self, baked};
    use proptest::prelude::*;

    const ENVELOPE: Envelope = Envelope {
        start: 0.1,
        full: 0.4,
        release: 0.6,
        end: 0.9,
    };

    fn vector(most: f32) -> impl Strategy<Value = Vec3> {
        let axis = -most..most;
        [axis.clone(), axis.clone(), axis].prop_map(Vec3::from)
    }

    fn bend() -> impl Strategy<Value = Bend> {
        let ends = [vector(0.08), vector(0.08), vector(0.06), vector(0.06)];
        (vector(0.12), vector(0.04), ends).prop_map(|(spine, pelvis, ends)| Bend {
            spine,
            pelvis: pelvis - Vec3::Y * 0.03,
            ends,
            ahead: 0.0,
        })
    }

    /// Position of a sphere after the bend, computed naively.
    fn place(motion: &Motion, bend: Bend, sphere: usize) -> Vec3 {
        let baked = baked();
        let mut motion = motion.clone();
        motion.set_warp(Some(Warp {
            envelope: ENVELOPE,
            bend,
        }));
        let joints = fixture::joints(baked, &motion, 60.0 / SAMPLE_RATE);
        baked.body().spheres[sphere].centre(&joints)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn gradients_are_what_small_steps_find(
            start in 0.0f32..1.0, bend in bend(), away in vector(1.0), change in bend(), picked in any::<prop::sample::Index>(),
        ) {
            let baked = baked();
            prop_assume!(away.length() > 0.1);
            let away = away.normalize();
            // The displacement of a hand does not rotate with the trunk as its arm does. Without one the result is exact.
            let bend = Bend { ends: [bend.ends[0], bend.ends[1], Vec3::ZERO, Vec3::ZERO], ..bend };
            let sphere = picked.index(baked.body().spheres.len());
            let mut motion = fixture::motion(baked, EdgeId(0), start, Rigid2::IDENTITY);
            motion.set_warp(Some(Warp { envelope: ENVELOPE, bend }));
            let mut tick = Tick::default();
            tick.restart(60);
            tick.pose(baked, &motion, &WarpLimits::default());
            prop_assert_eq!(tick.weight, 1.0);
            let expected = place(&motion, bend, sphere);
            prop_assert!(tick.centres[sphere].distance(expected) < 1e-5);
            // The displacement that a leg allows. Beyond it, the knee straightens faster than small steps predict.
            let legs = (0..Rig::LEGS).filter_map(|limb| Some((tick.legs[limb], baked.graph().rig().limbs()[limb]?)));
            for (range, leg) in legs {
                let [hip, foot] = [leg.hip, leg.foot].map(|joint| tick.joints[joint.index()].translation);
                prop_assume!(hip.distance(foot) < range.furthest - 0.01);
            }
            let gradient = tick.gradient(baked, sphere, away, Vec3::ZERO);
            // Each part of a bend alone, then all together.
            let parts = (0..7).map(|part| {
                let mut one = Bend::default();
                match part {
                    0 => one.spine = change.spine,
                    1 => one.pelvis = change.pelvis,
                    6 => one = change,
                    end => one.ends[end - 2] = change.ends[end - 2],
                }
                one
            });
            for one in parts {
                let step = |share: f32| {
                    let ends = std::array::from_fn(|limb| bend.ends[limb] + one.ends[limb] * share);
                    let bend = Bend { spine: bend.spine + one.spine * share, pelvis: bend.pelvis + one.pelvis * share, ends, ahead: 0.0 };
                    place(&motion, bend, sphere).dot(away)
                };
                let (up, down) = (step(0.05), step(-0.05));
                let found = (up - down) / 0.1;
                let ends: f32 = gradient.ends.iter().zip(&one.ends).map(|(slope, end)| slope.dot(*end)).sum();
                let linear = gradient.spine.dot(one.spine) + gradient.pelvis.dot(one.pelvis) + ends;
                // Composed rotations differ from sums of rotation vectors by half of their product, times the length of a spine and an arm.
                let crossed = 0.6 * bend.spine.length() * one.spine.length();
                prop_assert!((found - linear).abs() < 8e-3 + crossed, "{found} and {linear} by {one:?}");
            }
        }
    }
}
