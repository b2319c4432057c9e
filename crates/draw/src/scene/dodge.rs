//! Plays back a dodge: a fighter walks the graph, an attack is thrown at a given time, and the answer follows. Its pictures have the camera,
//! the fighter, the attack with its trail, the ghost of the motion without the dodge, and the maps.
//!
//! Source of the maps: Masaoka & Oshita, section 3.2, in the colours of their figures: body green, attack red, evasion blue.

use std::sync::Arc;

use glam::Vec3;

use super::camera::{bounded, film_times};
use super::{Actor, Camera, Capsule, Layer, Light, Look, Shot, Skin};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{Edge, EdgeId, Motion, MotionGraph, MotionStep, Playhead};
use sabaki::maps::{
    BakedGraph, BitMap, Disc, Drawing, MapGrid, MapRect, MaskMap, MovingSphere, Slab, raster,
};
use sabaki::math::{Rigid2, Sphere, smooth_step};
use sabaki::query::{Answer, Attack, Clearance};

/// Settings of the playback of a dodge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DodgeSettings {
    /// Playback speed when the attack is nearest, relative to real time, 0.01 to 1. Default 0.12.
    pub slowest: f32,
    /// Whether the motion without the dodge is shown as a ghost. Default true.
    pub ghost: bool,
}

impl Default for DodgeSettings {
    fn default() -> Self {
        Self {
            slowest: 0.12,
            ghost: true,
        }
    }
}

/// A dodge. Time 0 is the query.
#[derive(Clone, Debug)]
pub struct Dodge<'a> {
    baked: &'a BakedGraph,
    settings: DodgeSettings,
    actor: Actor,
    /// Motion before the query, and its duration in seconds.
    before: (Motion, f32),
    /// Motion from the query on.
    answer: Motion,
    /// Motion that would play without the dodge.
    idle: Motion,
    attack: Attack,
    clearance: Clearance,
    /// Maps of the evasion, or `None` if the answer has no evasion.
    maps: Option<DodgeMaps>,
}

/// Nearest points of a body and an attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance between the surfaces, in metres, negative if they intersect.
    pub metres: f32,
    /// Point on the surface of the body's spheres, in the world.
    pub body: Vec3,
    /// Point on the surface of the attack, in the world.
    pub attack: Vec3,
}

/// Duration shown before the query and after the attack's end, in seconds.
const BEFORE: f32 = 0.5;
const AFTER: f32 = 0.7;

const GHOST: Vec3 = Vec3::new(0.16, 0.33, 0.62);

/// Duration of the trail behind a ball, in seconds.
const TRAIL: f32 = 0.22;
const TRAIL_PIECES: usize = 14;
const BALL: Vec3 = Vec3::new(0.93, 0.16, 0.05);

/// Angle of the camera above the horizon, in radians.
const UP: f32 = 0.16;
/// Time before and after the attack is nearest that should be visible, in seconds.
const NEAR_TIME: f32 = 0.13;

impl<'a> Dodge<'a> {
    /// Creates the playback of an attack on a character in the state `playhead`, and of the query's answer to it. The attack is in the
    /// world, with times in seconds since the query. Settings out of their ranges are replaced by the nearest ones in them.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        playhead: Playhead,
        attack: &Attack,
        answer: &Answer,
        settings: &DodgeSettings,
    ) -> Self {
        let graph = baked.graph();
        let end = attack.end() + AFTER;
        let mut motion = answer.motion.clone();
        motion.extend(graph, end);
        let mut idle = Motion::new(graph, playhead, &[]);
        idle.extend(graph, end);
        Self {
            maps: DodgeMaps::of(baked, answer, attack),
            baked,
            settings: *settings,
            actor: Actor::new(baked, &Look::default(), None),
            before: lead_in(graph, playhead, BEFORE),
            answer: motion,
            idle,
            attack: attack.clone(),
            clearance: answer.clearance(),
        }
    }

    /// Draws the fighter and its ghost with a mesh that is bound to the graph's skeleton.
    #[must_use]
    pub fn with_skin(mut self, skin: Option<Arc<Skin>>) -> Self {
        self.actor.skin = skin;
        self
    }

    /// First and last time that can be shown, in seconds.
    pub fn span(&self) -> [f32; 2] {
        [-self.before.1.min(BEFORE), self.attack.end() + AFTER]
    }

    /// Minimum distance of body and attack, and its time.
    pub fn clearance(&self) -> Clearance {
        self.clearance
    }

    /// Times of the pictures of a film with `rate` pictures per second, 1 to 1,000. Playback slows down when
    /// the attack is nearest.
    pub fn moments(&self, rate: f32) -> Vec<f32> {
        let slowest = bounded(self.settings.slowest, [0.01, 1.0]);
        film_times(self.span(), rate, |t| {
            let away = ((t - self.clearance.time).abs() - 0.04) / 0.34;
            slowest + (1.0 - slowest) * smooth_step(away)
        })
    }

    /// Frames of the joints at a time, in the world.
    pub fn joints(&self, t: f32, out: &mut Vec<JointTransform>) {
        let (graph, mut pose) = (self.baked.graph(), Pose::default());
        if t < 0.0 {
            let (motion, seconds) = &self.before;
            motion.sample(graph, seconds + t, &mut pose);
        } else {
            self.answer.sample(graph, t, &mut pose);
        }
        forward_kinematics(graph.skeleton(), &pose, out);
    }

    /// Adds the maps of the chosen evasion and of the attack to a shot, each slab at its own height. It does nothing if the answer has no
    /// evasion.
    pub fn add_maps(&self, t: f32, shot: &mut Shot) {
        if let Some(maps) = &self.maps {
            maps.add(t, shot);
        }
    }

    /// Nearest points of body and attack at a time, or `None` if there is no attack at that time.
    pub fn nearest(&self, t: f32) -> Option<Nearest> {
        self.nearest_of(t).map(|(_, nearest)| nearest)
    }

    /// The attack's sphere that is nearest to the body when the attack is nearest.
    fn nearest_sphere(&self) -> Option<&MovingSphere> {
        let nearest = self.nearest_of(self.clearance.time);
        let index = nearest.map_or(0, |(index, _)| index);
        self.attack.spheres().get(index)
    }

    /// Nearest points at a time, with the index of the attack's sphere.
    fn nearest_of(&self, t: f32) -> Option<(usize, Nearest)> {
        let (mut joints, mut centres) = (Vec::new(), Vec::new());
        self.joints(t, &mut joints);
        self.baked.body().centres(&joints, &mut centres);
        let spheres = self.attack.spheres().iter().enumerate();
        let flying = spheres.filter(|(_, one)| (one.start()..=one.end()).contains(&t));
        let apart = flying.flat_map(|(index, sphere)| {
            let ball = sphere.at(t);
            let spheres = centres.iter().zip(&self.baked.body().spheres);
            spheres.map(move |(centre, part)| {
                let between = (ball.center - *centre).normalize_or(Vec3::Y);
                let nearest = Nearest {
                    metres: centre.distance(ball.center) - part.radius - ball.radius,
                    body: *centre + between * part.radius,
                    attack: ball.center - between * ball.radius,
                };
                (index, nearest)
            })
        });
        apart.min_by(|(_, a), (_, b)| a.metres.total_cmp(&b.metres))
    }
}

impl Dodge<'_> {
    /// The attack's sphere that is nearest to the body when the attack is nearest. It is extrapolated after its end.
    pub fn ball(&self, t: f32) -> Sphere {
        let none = Sphere::new(Vec3::ZERO, 0.0);
        self.nearest_sphere()
            .map_or(none, |sphere| flying(sphere, t))
    }

    /// Camera beside the attack's path, slightly above it, that shows the whole dodge and the
    /// attack.
    pub fn camera(&self, aspect: f32) -> Camera {
        let mut joints = Vec::new();
        self.joints(self.clearance.time, &mut joints);
        let out = self.side(&joints);
        let balls = self.balls();
        let (seen, place) = (self.seen(&balls), joints[0].translation);
        // Objects in front of the centre appear larger.
        let camera = Camera::framing(place, out, UP, &seen, aspect, [0.55, 0.16, -0.03]);
        camera.enclosing(balls, aspect)
    }

    /// Horizontal direction to the camera.
    fn side(&self, joints: &[JointTransform]) -> Vec3 {
        let near = self.clearance.time;
        let ball = self.ball(near);
        let flight = self.ball(near + 0.01).centre - ball.centre;
        // Prefer the front of the body to its back, and a place ahead of the attack to one behind
        // it.
        let facing = joints[0].rotation * Vec3::Z;
        let to_front = |side: Vec3| if side.dot(facing) < 0.0 { -side } else { side };
        let across = to_front(Vec3::new(flight.z, 0.0, -flight.x).normalize_or(Vec3::X));
        let along = to_front(Vec3::new(flight.x, 0.0, flight.z).normalize_or(Vec3::Z));
        let sides = [
            across + 0.5 * along,
            across - 0.5 * along,
            0.5 * along - across,
            -0.5 * along - across,
        ];
        let sides = sides.map(|side| side.normalize_or(Vec3::Z));
        let mut centres = Vec::new();
        self.baked.body().centres(joints, &mut centres);
        let hides = |side: Vec3| {
            let out = (side + Vec3::Y * UP.tan()).normalize();
            let mut spheres = centres.iter().zip(&self.baked.body().spheres);
            spheres.any(|(centre, part)| {
                let away = *centre - ball.centre;
                away.dot(out) > 0.0 && away.reject_from(out).length() < part.radius
            })
        };
        let shows = sides.into_iter().find(|&side| !hides(side));
        shows.unwrap_or(sides[0])
    }

    /// Places of the attack that should be visible: of each sphere, while it flies, around the time when it is nearest. Spheres that never come
    /// near are left out.
    fn balls(&self) -> Vec<Sphere> {
        /// Distance from the root up to which a sphere is near, in metres.
        const NEAR: f32 = 2.5;
        let mut joints = Vec::new();
        let mut root = |t| {
            self.joints(t, &mut joints);
            joints[0].translation
        };
        let mut balls = Vec::new();
        for sphere in self.attack.spheres() {
            let (start, end) = (sphere.start(), sphere.end());
            let is_nearest = self.nearest_sphere() == Some(sphere);
            let times = (0..=32).map(|step| start + (end - start) * step as f32 / 32.0);
            let apart = times.map(|t| (t, sphere.at(t).center.distance(root(t))));
            let least = apart.min_by(|a, b| a.1.total_cmp(&b.1));
            let near = match least {
                _ if is_nearest => self.clearance.time,
                Some((t, metres)) if metres < NEAR => t,
                _ => continue,
            };
            // Include the place where the sphere starts, unless it is so far away that the body would
            // be small.
            let moments = [near - 2.0 * NEAR_TIME, near - NEAR_TIME, near + NEAR_TIME];
            balls.extend(moments.map(|t| flying(sphere, t.clamp(start, end))));
        }
        balls
    }

    /// Everything that should be visible.
    fn seen(&self, balls: &[Sphere]) -> Vec<Sphere> {
        let [start, end] = self.span();
        let around = |joint: &JointTransform| Sphere::new(joint.translation, 0.1);
        let (mut seen, mut joints) = (balls.to_vec(), Vec::new());
        for step in 0..=24 {
            self.joints(start + (end - start) * step as f32 / 24.0, &mut joints);
            seen.extend(joints.iter().map(around));
        }
        seen
    }

    /// Shot of a time.
    pub fn shot(&self, t: f32, camera: Camera) -> Shot {
        let mut joints = Vec::new();
        self.joints(t, &mut joints);
        let middle = Vec3::new(joints[0].translation.x, 0.0, joints[0].translation.z);
        let light = Light {
            shadow: Sphere::new(middle, 3.5),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        self.actor.add(&joints, None, 1.0, &mut shot);
        self.actor.shade(&joints, &mut shot);
        for sphere in self.attack.spheres() {
            self.add_ball(sphere, t, &mut shot);
        }
        if self.settings.ghost {
            self.add_ghost(t, &mut shot);
        }
        shot
    }

    fn add_ball(&self, sphere: &MovingSphere, t: f32, shot: &mut Shot) {
        let (start, end) = (sphere.start(), sphere.end());
        if t < 0.0 {
            return;
        }
        // The ball grows at its start, so that it is visible before it moves.
        let grown = smooth_step((t + 0.02) / start.clamp(0.05, 0.35));
        let gone = 1.0 - smooth_step((t - end - 0.45) / 0.2);
        let mut ball = flying(sphere, t.max(start));
        ball.radius *= grown.min(gone);
        if ball.radius > 0.002 {
            let colour = BALL.extend(1.0).to_array();
            shot.solids.push(Capsule::ball(ball, colour));
        }
        for piece in 0..TRAIL_PIECES {
            let at = |piece: usize| (t - TRAIL * piece as f32 / TRAIL_PIECES as f32).max(start);
            let left = 1.0 - piece as f32 / TRAIL_PIECES as f32;
            let ends = [flying(sphere, at(piece)), flying(sphere, at(piece + 1))];
            if ends[0].centre.distance(ends[1].centre) < 1e-4 {
                break;
            }
            let alpha = 0.42 * left * left * gone;
            let thin = |end: Sphere, share: f32| Sphere::new(end.centre, end.radius * share * 0.8);
            let next = left - 1.0 / TRAIL_PIECES as f32;
            shot.ghosts.push(Capsule::new(
                thin(ends[0], left.sqrt()),
                thin(ends[1], next.max(0.0).sqrt()),
                BALL.extend(alpha).to_array(),
            ));
        }
    }

    /// Adds the ghost of the motion without the dodge, around the time of the hit. Every shot
    /// includes it if [`DodgeSettings::ghost`](super::DodgeSettings::ghost) is set.
    pub fn add_ghost(&self, t: f32, shot: &mut Shot) {
        let from = self
            .attack
            .start()
            .min(self.clearance.time - 0.25)
            .max(0.05);
        let shown = smooth_step((t - from) / 0.2)
            * (1.0 - smooth_step((t - self.clearance.time - 0.25) / 0.3));
        if t < 0.0 || shown <= 0.0 {
            return;
        }
        let (graph, mut pose, mut joints) = (self.baked.graph(), Pose::default(), Vec::new());
        self.idle.sample(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        let alpha = 0.34 * shown;
        self.actor.add(&joints, Some(GHOST), alpha, shot);
    }
}

/// A sphere at a time. It is extrapolated from the last two keys.
fn flying(sphere: &MovingSphere, t: f32) -> Sphere {
    let at = sphere.at(t);
    let keys = sphere.keys();
    let (Some(last), true) = (keys.last(), t > sphere.end()) else {
        return Sphere::new(at.center, at.radius);
    };
    let before = keys[keys.len().saturating_sub(2)];
    let seconds = (last.t - before.t).max(1e-3);
    let speed = (last.center - before.center) / seconds;
    Sphere::new(last.center + speed * (t - last.t), last.radius)
}

/// Motion that ends at `playhead` after at least `seconds`, and its duration.
fn lead_in(graph: &MotionGraph, playhead: Playhead, seconds: f32) -> (Motion, f32) {
    let rate = graph.frame_rate() as f32;
    let (mut edges, mut first) = (Vec::new(), playhead);
    let mut lasts = playhead.frame / rate;
    while lasts < seconds {
        let Some((edge, before)) = edge_before(graph, first.edge) else {
            break;
        };
        edges.push(first.edge);
        lasts += before.frames as f32 / rate;
        // The space of the previous edge's end is the space of this edge's start.
        let change = graph.clip_change(edge);
        first = Playhead {
            edge,
            frame: 0.0,
            clip_to_world: first.clip_to_world * change.inverse(),
        };
    }
    let first = Playhead {
        frame: 0.0,
        ..first
    };
    let steps: Vec<MotionStep> = edges
        .iter()
        .rev()
        .map(|&edge| MotionStep { edge, rate: 1.0 })
        .collect();
    let motion = Motion::new(graph, first, &steps);
    (motion, lasts)
}

/// An edge that leads to `edge`: the clip's previous frames if possible, otherwise the closest
/// transition.
fn edge_before(graph: &MotionGraph, edge: EdgeId) -> Option<(EdgeId, &Edge)> {
    let from = graph.edge(edge).from;
    let cost = |edge: &Edge| edge.motion.distance();
    let leading = graph.edge_ids().map(|id| (id, graph.edge(id)));
    leading
        .filter(|(_, edge)| edge.to == from)
        .min_by(|a, b| cost(a.1).total_cmp(&cost(b.1)))
}

/// Maps of one evasion and of the attack that it avoids.
#[derive(Clone, Debug)]
struct DodgeMaps {
    grid: MapGrid,
    /// Transform from the evasion's frame to the world.
    placement: Rigid2,
    /// Start of the evasion, in seconds since the query.
    start: f32,
    slabs: Vec<SlabLayers>,
}

#[derive(Clone, Debug)]
struct SlabLayers {
    height: f32,
    body: MaskMap,
    evasion: BitMap,
    attack: BitMap,
}

const BODY: [f32; 4] = [0.06, 0.50, 0.14, 0.62];
const EVASION: [f32; 4] = [0.05, 0.20, 0.85, 0.42];
const ATTACK: [f32; 4] = [0.85, 0.05, 0.03, 0.60];

impl DodgeMaps {
    /// Maps of the evasion that an answer plays, or `None` if it plays none.
    fn of(baked: &BakedGraph, answer: &Answer, attack: &Attack) -> Option<Self> {
        let motion = &answer.motion;
        let evasion = answer.candidates.get(answer.chosen)?.evasion?;
        let start = start_of(baked.graph(), motion, evasion)?;
        let region = baked.evasion(evasion)?.region;
        let placement = motion
            .playhead(baked.graph(), start + 1e-4)
            .placement(baked.graph());
        let grid = baked.atlas().grid();
        let attack = attack.placed(placement.inverse());
        let maps = baked.atlas().region(region);
        let slabs = (maps.first_slab.0..).zip(&maps.slabs);
        let slabs = slabs.map(|(number, maps)| SlabLayers {
            height: (number as f32 + 0.5) * grid.slab_height,
            body: maps.body.clone(),
            evasion: maps.evasion.clone(),
            attack: attack_map(&attack, grid, Slab(number)),
        });
        Some(Self {
            grid,
            placement,
            start,
            slabs: slabs.collect(),
        })
    }

    /// Slice of a time, in seconds since the query.
    fn slice(&self, t: f32) -> u32 {
        let slice = match self.grid.is_timed() {
            true => ((t - self.start) / self.grid.slice_seconds).floor(),
            false => 0.0,
        };
        slice.clamp(0.0, self.grid.slices as f32 - 1.0) as u32
    }

    /// Adds the layers of a time, in seconds since the query, to a shot. Slabs that the attack does not pass are left out.
    fn add(&self, t: f32, shot: &mut Shot) {
        let slice = self.slice(t);
        for slab in self.slabs.iter().filter(|slab| slab.attack.count() > 0) {
            let maps = [
                (slab.evasion.clone(), EVASION),
                (of_slice(&slab.body, slice), BODY),
                (slab.attack.clone(), ATTACK),
            ];
            for (order, (map, colour)) in maps.into_iter().enumerate() {
                shot.layers.push(Layer {
                    map,
                    texel: self.grid.texel,
                    placement: self.placement,
                    height: slab.height + 1e-3 * order as f32,
                    colour,
                });
            }
        }
    }
}

/// Start of an edge in a motion, in seconds since the motion's start.
fn start_of(graph: &MotionGraph, motion: &Motion, wanted: EdgeId) -> Option<f32> {
    let first = motion.playhead(graph, 0.0);
    let mut start = first.seconds_to_next_node(graph);
    for step in motion.steps() {
        if step.edge == wanted {
            return Some(start);
        }
        start += graph.seconds(step.edge) / step.rate;
    }
    None
}

/// The texels in which an attack's map is drawn, in the evasion's frame. An attack from far away passes more texels than
/// memory holds.
const SHOWN: MapRect = MapRect {
    u: -1024,
    v: -1024,
    width: 2048,
    height: 2048,
};

/// Texels that the attack passes in a slab at any time, in the attack's frame.
fn attack_map(attack: &Attack, grid: MapGrid, slab: Slab) -> BitMap {
    let mut discs = Vec::new();
    for sphere in attack.spheres() {
        sphere.for_each_step(|ball| discs.extend(grid.disc(ball.centre, ball.radius, slab)));
    }
    let rect = MapRect::around(&discs).intersection(SHOWN);
    let moved = |disc: &Disc| disc.relative_to(rect.u, rect.v);
    let drawing = Drawing {
        rect,
        frame_ends: vec![discs.len() as u32],
        discs: discs.iter().map(moved).collect(),
    };
    raster::any_frame(&drawing)
}

fn of_slice(map: &MaskMap, slice: u32) -> BitMap {
    let rect = map.rect();
    let mut bits = BitMap::new(rect);
    for row in 0..rect.height as i32 {
        for column in 0..rect.width as i32 {
            if map.get(column, row) >> slice & 1 == 1 {
                bits.set(column, row);
            }
        }
    }
    bits
}
