//! Candidates that layer the upper body of an evasion over the natural motion.
//!
//! Source: the layers are those that the bake found ([`EntryTable`](crate::maps::EntryTable)). Maps are drawn for whole bodies and give no
//! bound for a body that is composed during the query, so layers are not culled. They are ranked by their distance from the attack at a few
//! moments ([`LayerRanking`]), and the best few are tested exactly. These distances are approximate and cheap: the upper body comes from the baked
//! track of the evasion, moved to the pelvis of the natural motion.

use std::cmp::Ordering;

use glam::{Quat, Vec3};

use super::candidates::{Candidate, CandidateKind, CandidateList, LayerCandidate};
use super::entries::EnteredEvasion;
use super::natural::NaturalMotion;
use crate::anim::{Envelope, JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{ClipPosition, Layer, Motion, heading};
use crate::maps::{BakedGraph, BodyTrack, Evasion, KnownEntry, MovingSphere, SphereKey};
use crate::math::Isa;
use crate::query::attack::Attack;
use crate::query::clearance::MotionBody;
use crate::query::request::{ActiveRequest, Query};
use crate::query::retime::Rate;

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
pub(in crate::query) fn gather_layers(
    query: Query<'_>,
    request: &ActiveRequest,
    candidates: &mut CandidateList,
    natural: &mut NaturalMotion,
    ranking: &mut LayerRanking,
    body: &mut MotionBody,
) {
    let Query { baked, settings } = query;
    let (graph, entries) = (baked.graph(), baked.entries());
    let layers = &mut candidates.layers;
    layers.clear();
    if settings.entries.layers == 0 || !entries.has_layers() {
        return;
    }
    // Pelvis and legs follow the natural motion into the obstacle.
    if natural.free_until(baked, request) < f32::INFINITY {
        return;
    }
    let Some(contact) = natural.contact(baked, request, body) else {
        return;
    };
    let motion = natural.motion(baked, request);
    ranking.look_at(baked, motion, &request.attack, contact);
    // No layer avoids an attack that hits pelvis or legs.
    if ranking.below_waist() < DEEPEST {
        return;
    }
    for left in LEFT {
        let delay = (contact - left).max(0.0);
        let playhead = motion.playhead(graph, delay);
        for &known in entries.at(&entries.layers, graph, playhead) {
            add_rates(query, known, delay, contact, ranking, layers);
        }
        if left >= contact {
            break;
        }
    }
    let order = |one: &LayerCandidate| {
        let (layer, missing) = (&one.layer, (one.metres - WANTED).abs());
        let (evasion, start) = (one.evasion as f32, layer.envelope.start);
        [missing, evasion, start, layer.frame, layer.rate]
    };
    layers.sort_unstable_by(|a, b| {
        let pairs = order(a).into_iter().zip(order(b));
        let orders = pairs.map(|(a, b)| a.total_cmp(&b));
        orders.fold(Ordering::Equal, Ordering::then)
    });
    layers.truncate(settings.entries.layers);
    candidates.search.followed += layers.len();
    let added = layers.iter().zip(0..).map(|(one, index)| Candidate {
        kind: CandidateKind::Layer(index),
        rate: Rate::for_all(one.layer.rate),
    });
    candidates.list.extend(added);
}

/// Adds a candidate for each rate at which a layer of the table, which starts `delay` seconds from now, is under way at the contact.
fn add_rates(
    query: Query<'_>,
    known: KnownEntry,
    delay: f32,
    contact: f32,
    ranking: &LayerRanking,
    layers: &mut Vec<LayerCandidate>,
) {
    let (baked, uses) = (query.baked, &query.settings.entries);
    let entered = EnteredEvasion::new(baked, known);
    let fastest = known.fastest().min(uses.fastest);
    for rate in RATES {
        if !entered.is_useful(contact - delay, rate) || rate > fastest {
            continue;
        }
        let full = delay + known.blend();
        let over = delay + (entered.end - entered.now) / rate;
        let release = over.clamp(contact + HELD[0], contact + HELD[1]).max(full);
        let envelope = Envelope {
            start: delay,
            full,
            release,
            end: release + WAY_OUT,
        };
        let position = ClipPosition {
            clip: entered.clip,
            frame: entered.frame as f32,
        };
        let layer = Layer::new(position, rate, envelope);
        let metres = ranking.distance(baked, &layer, entered.evasion, DEEPEST);
        layers.extend(metres.map(|metres| LayerCandidate {
            layer,
            evasion: entered.evasion,
            metres,
        }));
    }
}

const LANES: usize = BodyTrack::LANES;

/// Distance that the attack travels between two moments, in metres.
const APART: f32 = 0.1;

/// Number of moments. One is before the contact. Those just after it come first, because most layers are hit there.
const MOMENTS: usize = 6;

/// Maximum number of spheres of the attack that are used.
const MOST_SPHERES: usize = 32;

/// The body of the natural motion, and the attack, at some moments.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct LayerRanking {
    moments: Vec<Moment>,
    /// Radii of the body's spheres that a layer moves, in metres; negative infinity for all other spheres.
    upper: Vec<f32>,
    /// Radii of the body's spheres that no layer moves, in metres; negative infinity for all other spheres.
    lower: Vec<f32>,
    pose: Pose,
    joints: Vec<JointTransform>,
}

#[derive(Clone, Debug, Default)]
struct Moment {
    seconds: f32,
    root: Vec3,
    pelvis: Quat,
    /// Centres of the body's spheres, rows of x, y and z.
    rows: Vec<f32>,
    /// Spheres of the attack near the body.
    attack: Vec<SphereKey>,
}

impl Moment {
    fn axes(&self) -> [&[f32]; 3] {
        let row = self.rows.len() / 3;
        [0, 1, 2].map(|axis| &self.rows[axis * row..(axis + 1) * row])
    }

    /// Smallest distance of the attack from spheres that a layer of some weight moves, in metres. `rows` are their centres in the frame of the
    /// baked track, whose axes x and z and whose origin are `axes` and `origin`.
    fn layered_distance(
        &self,
        weight: f32,
        rows: [&[f32]; 3],
        axes: [Vec3; 2],
        origin: Vec3,
        radii: &[f32],
    ) -> f32 {
        Isa::best().run(
            #[inline(always)]
            || self.lowest(weight, rows, axes, origin, radii),
        )
    }

    #[inline(always)]
    fn lowest(
        &self,
        weight: f32,
        rows: [&[f32]; 3],
        [ax, az]: [Vec3; 2],
        origin: Vec3,
        radii: &[f32],
    ) -> f32 {
        let [x0, y0, z0] = self.axes().map(|row| row.as_chunks::<LANES>().0);
        let [x1, y1, z1] = rows.map(|row| row.as_chunks::<LANES>().0);
        let mut lowest = [f32::INFINITY; LANES];
        for (block, radii) in radii.as_chunks::<LANES>().0.iter().enumerate() {
            for key in &self.attack {
                for lane in 0..LANES {
                    let (x, z) = (x1[block][lane], z1[block][lane]);
                    let mix = |own: f32, other: f32| own * (1.0 - weight) + other * weight;
                    let centre = [
                        mix(x0[block][lane], origin.x + (ax.x * x + az.x * z)),
                        mix(
                            y0[block][lane],
                            origin.y + (ax.y * x + az.y * z) + y1[block][lane],
                        ),
                        mix(z0[block][lane], origin.z + (ax.z * x + az.z * z)),
                    ];
                    let [x, y, z] = [
                        key.center.x - centre[0],
                        key.center.y - centre[1],
                        key.center.z - centre[2],
                    ];
                    let metres = (x * x + y * y + z * z).sqrt() - key.radius - radii[lane];
                    lowest[lane] = lowest[lane].min(metres);
                }
            }
        }
        lowest.iter().copied().fold(f32::INFINITY, f32::min)
    }
}

impl LayerRanking {
    /// Poses the body at moments around the contact.
    fn look_at(&mut self, baked: &BakedGraph, motion: &Motion, attack: &Attack, contact: f32) {
        let (graph, body) = (baked.graph(), baked.body());
        for (radii, is_upper) in [(&mut self.upper, true), (&mut self.lower, false)] {
            radii.clear();
            radii.extend(body.spheres.iter().map(|sphere| {
                let is_above = graph.rig().part(sphere.joint).is_above_pelvis();
                match is_above == is_upper {
                    true => sphere.radius,
                    false => f32::NEG_INFINITY,
                }
            }));
            radii.resize(radii.len().next_multiple_of(LANES), f32::NEG_INFINITY);
        }
        let step = APART / fastest(attack, contact).clamp(1.0, 20.0);
        self.moments.resize_with(MOMENTS, Moment::default);
        for (number, moment) in self.moments.iter_mut().enumerate() {
            let steps = ((number + 2) % MOMENTS) as f32 - 1.0;
            moment.seconds = (contact + steps * step).max(0.0);
            motion.sample(graph, moment.seconds, &mut self.pose);
            forward_kinematics(graph.skeleton(), &self.pose, &mut self.joints);
            moment.rows.clear();
            baked.body_rows().push(&self.joints, &mut moment.rows);
            moment.root = self.pose.root;
            moment.pelvis = self.pose.rotations[JointId::ROOT.index()];
            let flies =
                |sphere: &&MovingSphere| (sphere.start()..=sphere.end()).contains(&moment.seconds);
            let keys = attack.spheres().iter().filter(flies);
            let keys = keys.map(|sphere| sphere.at(moment.seconds));
            let near = |key: &SphereKey| {
                key.center.distance(moment.root) < 2.0 * baked.reach() + key.radius
            };
            moment.attack.clear();
            moment.attack.extend(keys.filter(near).take(MOST_SPHERES));
        }
    }

    /// Smallest distance of the attack from pelvis and legs, which no layer moves, in metres.
    fn below_waist(&self) -> f32 {
        let axes = [Vec3::X, Vec3::Z];
        let distances = self.moments.iter().map(|moment| {
            moment.layered_distance(0.0, moment.axes(), axes, Vec3::ZERO, &self.lower)
        });
        distances.fold(f32::INFINITY, f32::min)
    }

    /// Smallest distance of the attack from the upper body if the upper body of an evasion is layered, in metres; `None` if it is below
    /// `least`.
    fn distance(
        &self,
        baked: &BakedGraph,
        layer: &Layer,
        evasion: usize,
        least: f32,
    ) -> Option<f32> {
        let (graph, track) = (baked.graph(), baked.track(evasion));
        let Evasion {
            edge, placement, ..
        } = baked.evasions()[evasion];
        let start = graph.node(graph.edge(edge).from).frame;
        let mut found = f32::INFINITY;
        for moment in &self.moments {
            let weight = layer.weight(moment.seconds);
            let frame = layer.frame_at(graph, moment.seconds);
            let seconds = (f64::from(frame) - f64::from(start)) / graph.frame_rate();
            let tick = track.nearest_tick(seconds as f32);
            let there = graph.clip(layer.clip).at(frame);
            let turn = heading(moment.pelvis * there.rotation(0).conjugate());
            // Transform from the track's frame to the pelvis of this motion.
            let axes = [Vec3::X, Vec3::Z].map(|axis| turn * placement.vector(axis));
            let origin = moment.root + turn * (placement.point(Vec3::ZERO) - there.root());
            let rows = track.axes(tick);
            let metres = moment.layered_distance(weight, rows, axes, origin, &self.upper);
            found = found.min(metres);
            if found < least {
                return None;
            }
        }
        Some(found)
    }
}

/// Speed of the fastest sphere of the attack at a time, in metres per second.
fn fastest(attack: &Attack, seconds: f32) -> f32 {
    /// Time over which the speed is measured, in seconds.
    const STEP: f32 = 0.01;
    let speed = |sphere: &MovingSphere| {
        let way = sphere.at(seconds + STEP).center - sphere.at(seconds).center;
        way.length() / STEP
    };
    attack.spheres().iter().map(speed).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math::Rigid2;
    use crate::query::fixture::{self, baked};

    /// Naive distance at the same moments, from the body as it is played.
    fn naive(motion: &Motion, ranking: &LayerRanking) -> f32 {
        let (baked, mut centres) = (baked(), Vec::new());
        let mut least = f32::INFINITY;
        for moment in &ranking.moments {
            let joints = fixture::joints(baked, motion, moment.seconds);
            baked.body().centres(&joints, &mut centres);
            for (centre, radius) in centres.iter().zip(&ranking.upper) {
                for key in &moment.attack {
                    least = least.min(key.center.distance(*centre) - key.radius - radius);
                }
            }
        }
        least
    }

    fn rows() -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(-2.0f32..2.0, 3 * 2 * LANES)
    }

    proptest! {
        #[test]
        fn layered_spheres_are_as_near_as_one_by_one(
            (rows, other) in (rows(), rows()), weight in 0.0f32..=1.0, heading in -3.0f32..3.0,
            keys in prop::collection::vec(prop::array::uniform4(-1.0f32..1.0), 0..4), picked in prop::collection::vec(any::<bool>(), 2 * LANES),
        ) {
            let row = |rows: &[f32], at: usize| Vec3::from([0, 2 * LANES, 4 * LANES].map(|axis| rows[axis + at]));
            let radii: Vec<f32> = picked.iter().map(|&picked| if picked { 0.1 } else { f32::NEG_INFINITY }).collect();
            let key = |[x, y, z, radius]: [f32; 4]| SphereKey { t: 0.0, center: Vec3::new(x, y, z), radius: radius.abs() };
            let moment = Moment { rows, attack: keys.into_iter().map(key).collect(), ..Moment::default() };
            let turn = Quat::from_rotation_y(heading);
            let axes = [Vec3::X, Vec3::Z].map(|axis| turn * axis);
            let origin = Vec3::new(0.3, 0.1, -0.2);
            let rows = [0, 1, 2].map(|axis| &other[2 * LANES * axis..2 * LANES * (axis + 1)]);
            let mut expected = f32::INFINITY;
            for (at, radius) in radii.iter().enumerate().filter(|(_, radius)| radius.is_finite()) {
                let centre = row(&moment.rows, at).lerp(origin + turn * row(&other, at), weight);
                for key in &moment.attack {
                    expected = expected.min(key.center.distance(centre) - key.radius - radius);
                }
            }
            let found = moment.lowest(weight, rows, axes, origin, &radii);
            prop_assert!(found == expected || (found - expected).abs() < 1e-5, "{found} and {expected}");
            for isa in Isa::available() {
                prop_assert_eq!(isa.run(|| moment.lowest(weight, rows, axes, origin, &radii)).to_bits(), found.to_bits());
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn distances_are_those_of_the_played_body(
            start in 0.0f32..1.0, early in 0u32..8, heading in -3.0f32..3.0, way in -1.0f32..1.0, height in 0.9f32..1.6,
        ) {
            let baked = baked();
            let graph = baked.graph();
            let evasion = graph.node(graph.edge(baked.evasions()[0].edge).from);
            let to_world = Rigid2::new(heading, 1.0, -2.0);
            let edge = graph.edge_ids().find(|&id| graph.node(graph.edge(id).from).clip != evasion.clip).unwrap();
            let mut motion = fixture::motion(baked, edge, start, to_world);
            let root = motion.root(graph, 0.4).with_y(height);
            let along = Vec3::new(way, 0.1, 1.0 - way.abs()) * 2.0;
            let key = |t: f32, center: Vec3| SphereKey { t, center, radius: 0.1 };
            let attack = Attack::new(vec![vec![key(0.1, root - along), key(0.7, root + along)]]).unwrap();
            let envelope = Envelope { start: 0.1, full: 0.3, release: 1.0, end: 1.4 };
            let first = baked.entries().first_target(0).unwrap().frame;
            let position = ClipPosition { clip: evasion.clip, frame: (first + early) as f32 };
            let layer = Layer::new(position, 1.0, envelope);
            let mut ranking = LayerRanking::default();
            ranking.look_at(baked, &motion, &attack, 0.4);
            let found = ranking.distance(baked, &layer, 0, f32::NEG_INFINITY).unwrap();
            motion.set_layer(Some(layer));
            let expected = naive(&motion, &ranking);
            // The spine shares a tilt among its joints, and arms fade in along arcs: half a metre that turns by 1 rad is off by 6 cm midway.
            prop_assert!((found - expected).abs() < 0.08, "{found} and {expected}");
            prop_assert_eq!(ranking.distance(baked, &layer, 0, found + 1e-4), None);
        }
    }
}
