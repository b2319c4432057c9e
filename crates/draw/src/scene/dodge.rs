//! Plays back a dodge: a fighter walks the graph, an attack is thrown at a given time, and the
//! answer follows.

use glam::{Vec2, Vec3};

use super::maps::{DodgeMaps, MapStyle, SlabPicture};
use super::{Camera, Capsule, Figure, Light, Look, Shot};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{Edge, EdgeId, EdgeMotion, Motion, MotionGraph, Playhead, Step};
use sabaki::internal::Clearance;
use sabaki::maps::{BakedGraph, MovingSphere};
use sabaki::query::{Answer, Attack};

/// Settings of the playback of a dodge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DodgeSettings {
    /// Duration before the query, in seconds. Default 0.5.
    pub before: f32,
    /// Duration after the attack's end, in seconds. Default 0.7.
    pub after: f32,
    /// Playback speed when the attack is nearest, relative to real time. Default 0.12.
    pub slowest: f32,
    /// Whether the motion without the dodge is shown as a ghost. Default true.
    pub ghost: bool,
    /// Colours of the fighter.
    pub look: Look,
}

impl Default for DodgeSettings {
    fn default() -> Self {
        Self {
            before: 0.5,
            after: 0.7,
            slowest: 0.12,
            ghost: true,
            look: Look::default(),
        }
    }
}

/// A dodge. Time 0 is the query.
#[derive(Clone, Debug)]
pub struct Dodge<'a> {
    baked: &'a BakedGraph,
    settings: DodgeSettings,
    figure: Figure,
    ghost: Figure,
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

/// Duration of the trail behind a ball, in seconds.
const TRAIL: f32 = 0.22;
const TRAIL_PIECES: usize = 14;
const BALL: Vec3 = Vec3::new(0.93, 0.16, 0.05);
const GHOST: Vec3 = Vec3::new(0.16, 0.33, 0.62);

impl<'a> Dodge<'a> {
    /// Creates the playback of an attack on a character at `playhead`.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        (playhead, attack): (Playhead, &Attack),
        answer: &Answer,
        settings: &DodgeSettings,
    ) -> Self {
        let graph = baked.graph();
        let end = attack.end() + settings.after;
        let mut motion = answer.motion.clone();
        motion.extend(graph, end);
        let mut idle = Motion::new(graph, playhead, &[]);
        idle.extend(graph, end);
        let figure = Figure::of(graph.skeleton(), baked.body(), &settings.look);
        let evasion = answer
            .candidates
            .get(answer.chosen)
            .and_then(|chosen| chosen.evasion);
        let maps = evasion.and_then(|edge| DodgeMaps::of(baked, (&motion, edge), attack));
        Self {
            maps,
            baked,
            settings: *settings,
            ghost: figure.clone().coloured(GHOST),
            figure,
            before: lead_in(graph, playhead, settings.before),
            answer: motion,
            idle,
            attack: attack.clone(),
            clearance: answer.clearance(),
        }
    }

    /// First and last time that can be shown, in seconds.
    #[must_use]
    pub fn span(&self) -> (f32, f32) {
        (
            -self.before.1.min(self.settings.before),
            self.attack.end() + self.settings.after,
        )
    }

    /// Start and end of the attack, in seconds.
    #[must_use]
    pub fn flight(&self) -> (f32, f32) {
        (self.attack.start(), self.attack.end())
    }

    /// Minimum distance of body and attack, and its time.
    #[must_use]
    pub fn clearance(&self) -> Clearance {
        self.clearance
    }

    /// Times of the pictures of a film with `rate` pictures per second. Playback slows down when
    /// the attack is nearest.
    #[must_use]
    pub fn moments(&self, rate: f32) -> Vec<f32> {
        let (start, end) = self.span();
        let (mut moments, mut t) = (Vec::new(), start);
        while t < end {
            moments.push(t);
            let away = ((t - self.clearance.time).abs() - 0.04) / 0.34;
            let eased = smooth(away);
            let speed = self.settings.slowest + (1.0 - self.settings.slowest) * eased;
            t += speed / rate;
        }
        moments
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

    /// Adds the maps of the chosen evasion and of the attack to a shot. It does nothing if the
    /// answer has no evasion.
    pub fn add_maps(&self, t: f32, style: MapStyle, shot: &mut Shot) {
        if let Some(maps) = &self.maps {
            maps.add(t, style, shot);
        }
    }

    /// Maps of the slabs that the attack passes at a time. Empty if the answer has no evasion.
    #[must_use]
    pub fn slabs(&self, t: f32) -> Vec<SlabPicture> {
        self.maps
            .as_ref()
            .map_or_else(Vec::new, |maps| maps.pictures(t))
    }

    /// Nearest points of body and attack at a time, or `None` if there is no attack at that time.
    #[must_use]
    pub fn nearest(&self, t: f32) -> Option<Nearest> {
        let (mut joints, mut centres) = (Vec::new(), Vec::new());
        self.joints(t, &mut joints);
        self.baked.body().centres(&joints, &mut centres);
        let flies = |sphere: &&MovingSphere| (sphere.start()..=sphere.end()).contains(&t);
        let apart = self
            .attack
            .spheres()
            .iter()
            .filter(flies)
            .flat_map(|sphere| {
                let ball = sphere.at(t);
                let spheres = centres.iter().zip(&self.baked.body().spheres);
                spheres.map(move |(centre, part)| {
                    let between = (ball.center - *centre).normalize_or(Vec3::Y);
                    Nearest {
                        metres: centre.distance(ball.center) - part.radius - ball.radius,
                        body: *centre + between * part.radius,
                        attack: ball.center - between * ball.radius,
                    }
                })
            });
        apart.min_by(|a, b| a.metres.total_cmp(&b.metres))
    }

    /// Position and radius of the attack's first sphere, in metres. It is extrapolated before its
    /// start and after its end.
    #[must_use]
    pub fn ball(&self, t: f32) -> (Vec3, f32) {
        let Some(sphere) = self.attack.spheres().first() else {
            return (Vec3::ZERO, 0.0);
        };
        flying(sphere, t)
    }

    /// Camera beside the attack's path, slightly above it, that shows the whole dodge and the
    /// attack.
    #[must_use]
    pub fn camera(&self, aspect: f32) -> Camera {
        let near = self.clearance.time;
        let flight = self.ball(near + 0.01).0 - self.ball(near).0;
        let mut joints = Vec::new();
        self.joints(near, &mut joints);
        // Prefer the front of the body to its back, and a place ahead of the attack to one behind
        // it.
        let facing = joints[0].rotation * Vec3::Z;
        let across = Vec3::new(flight.z, 0.0, -flight.x).normalize_or(Vec3::X);
        let across = if across.dot(facing) < 0.0 {
            -across
        } else {
            across
        };
        let along = Vec3::new(flight.x, 0.0, flight.z).normalize_or(Vec3::Z);
        let along = if along.dot(facing) < 0.0 {
            -along
        } else {
            along
        };
        let out = (across + 0.5 * along).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(out);
        let (low, high) = self.extent(right);
        let middle = Vec3::new(joints[0].translation.x, 0.0, joints[0].translation.z);
        let aside = 0.5 * (low.x + high.x) - middle.dot(right);
        let target = middle + right * aside + Vec3::Y * (0.5 * high.y - 0.03);
        // Objects in front of the centre appear larger.
        let half = (0.55 * (high.x - low.x) / aspect).max(0.5 * high.y) + 0.16;
        let field = 30f32.to_radians();
        Camera {
            field,
            ..Camera::orbit(
                target,
                (out.x.atan2(out.z), 0.16),
                half / (0.5 * field).tan(),
            )
        }
    }

    /// Horizontal and vertical extent of everything that should be visible.
    fn extent(&self, right: Vec3) -> (Vec2, Vec2) {
        /// Time before and after the attack is nearest that should be visible, in seconds.
        const AROUND: f32 = 0.13;
        let (start, end) = self.span();
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let mut add = |place: Vec3, radius: f32| {
            let seen = Vec2::new(place.dot(right), place.y);
            low = low.min(seen - radius);
            high = high.max(seen + radius);
        };
        let mut joints = Vec::new();
        for step in 0..=24 {
            self.joints(start + (end - start) * step as f32 / 24.0, &mut joints);
            joints.iter().for_each(|joint| add(joint.translation, 0.1));
        }
        let near = self.clearance.time;
        // Include the place where the attack starts, unless it is so far away that the body would
        // be small.
        let from = self.attack.start().max(near - 2.0 * AROUND);
        for t in [from, near - AROUND, near + AROUND] {
            let (place, radius) = self.ball(t);
            add(place, radius);
        }
        (low, high)
    }

    /// Shot of a time.
    #[must_use]
    pub fn shot(&self, t: f32, camera: Camera) -> Shot {
        let mut joints = Vec::new();
        self.joints(t, &mut joints);
        let middle = Vec3::new(joints[0].translation.x, 0.0, joints[0].translation.z);
        let light = Light {
            shadow: (middle, 3.5),
            ..Light::default()
        };
        let mut shot = Shot::new(camera, light);
        self.figure.capsules(&joints, 1.0, &mut shot.solids);
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
        let grown = smooth((t + 0.02) / start.clamp(0.05, 0.35));
        let gone = 1.0 - smooth((t - end - 0.45) / 0.2);
        let (place, radius) = flying(sphere, t.max(start));
        let size = radius * grown.min(gone);
        if size > 0.002 {
            shot.solids
                .push(Capsule::ball(place, size, BALL.extend(1.0).to_array()));
        }
        for piece in 0..TRAIL_PIECES {
            let at = |piece: usize| (t - TRAIL * piece as f32 / TRAIL_PIECES as f32).max(start);
            let left = 1.0 - piece as f32 / TRAIL_PIECES as f32;
            let ends = [flying(sphere, at(piece)), flying(sphere, at(piece + 1))];
            if ends[0].0.distance(ends[1].0) < 1e-4 {
                break;
            }
            let alpha = 0.42 * left * left * gone;
            let thin = |(place, radius): (Vec3, f32), share: f32| (place, radius * share * 0.8);
            let next = left - 1.0 / TRAIL_PIECES as f32;
            shot.ghosts.push(Capsule::new(
                thin(ends[0], left.sqrt()),
                thin(ends[1], next.max(0.0).sqrt()),
                BALL.extend(alpha).to_array(),
            ));
        }
    }

    /// Adds the ghost of the motion without the dodge, around the time of the hit. Every shot
    /// includes it if [`DodgeSettings::ghost`] is set.
    pub fn add_ghost(&self, t: f32, shot: &mut Shot) {
        let from = self
            .attack
            .start()
            .min(self.clearance.time - 0.25)
            .max(0.05);
        let shown =
            smooth((t - from) / 0.2) * (1.0 - smooth((t - self.clearance.time - 0.25) / 0.3));
        if t < 0.0 || shown <= 0.0 {
            return;
        }
        let (graph, mut pose, mut joints) = (self.baked.graph(), Pose::default(), Vec::new());
        self.idle.sample(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        self.ghost.capsules(&joints, 0.34 * shown, &mut shot.ghosts);
    }
}

/// Position and radius of a sphere. They are extrapolated from the last two keys.
fn flying(sphere: &MovingSphere, t: f32) -> (Vec3, f32) {
    let at = sphere.at(t);
    let keys = sphere.keys();
    let (Some(last), true) = (keys.last(), t > sphere.end()) else {
        return (at.center, at.radius);
    };
    let before = keys[keys.len().saturating_sub(2)];
    let seconds = (last.t - before.t).max(1e-3);
    let speed = (last.center - before.center) / seconds;
    (last.center + speed * (t - last.t), last.radius)
}

fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
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
    let steps: Vec<Step> = edges
        .iter()
        .rev()
        .map(|&edge| Step { edge, rate: 1.0 })
        .collect();
    let motion = Motion::new(graph, first, &steps);
    (motion, lasts)
}

/// An edge that leads to `edge`: the clip's previous frames if possible, otherwise the closest
/// transition.
fn edge_before(graph: &MotionGraph, edge: EdgeId) -> Option<(EdgeId, &Edge)> {
    let from = graph.edge(edge).from;
    let cost = |edge: &Edge| match edge.motion {
        EdgeMotion::Clip => 0.0,
        EdgeMotion::Transition { distance, .. } => distance,
    };
    let leading = graph.edge_ids().map(|id| (id, graph.edge(id)));
    leading
        .filter(|(_, edge)| edge.to == from)
        .min_by(|a, b| cost(a.1).total_cmp(&cost(b.1)))
}
