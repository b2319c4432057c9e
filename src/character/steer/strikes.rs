//! Which attack of the clips reaches a target from where a character stands, and from which moment it is entered.
//!
//! Source: Lee & Lee, "Precomputing Avatar Behavior from Human Motion Data" (2004): attacks are looked up by the place of the target relative
//! to the character. Differs: they store the best action at each node of a graph, in a grid; here every moment before and in the attacks
//! is compared by the features of steering ([`table`](super::table)) and by where the limb is foremost from there. So a strike is entered
//! by the jump that enters any other motion, and the approach is steered.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::jump::{Body, Jumps};
use super::table::{Moment, PlayedBy, Row, distance, edges_by_clip, standing};
use super::{Now, SteerScratch, SteerState, SteerStep, Steering};
use crate::anim::{Facing, JointId};
use crate::character::goal::{Aim, StrikeKind, direction, heading_of, wrapped};
use crate::character::playing::Playing;
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, Node};
use crate::maps::{AttackMove, BakedGraph, BodySphere, MovingSphere, Stance};
use crate::math::Rigid2;

/// Time from the entry to the contact: the blend is over then, and others have time to avoid the limb. In seconds.
const NOTICE: f32 = 0.4;
/// Longest time from the entry to the contact, in seconds.
const LONGEST_WAY: f32 = 0.9;

/// The attacks of a graph, and the moments from which they are entered.
#[derive(Clone, Debug, Default)]
pub(in crate::character) struct StrikeTable {
    attacks: Vec<Attack>,
    starts: Vec<Start>,
}

/// An attack.
#[derive(Clone, Debug)]
struct Attack {
    edge: EdgeId,
    /// The joints that strike.
    joints: Vec<JointId>,
    /// The spheres that strike.
    limb: Vec<BodySphere>,
}

/// A moment from which an attack is entered.
#[derive(Clone, Copy, Debug)]
struct Start {
    attack: u32,
    moment: Moment,
    /// Features of the body, without the way ahead.
    row: Row,
    /// Where the foremost sphere begins and ends to be far out, in the character's frame at this moment, in metres.
    contact: [Vec3; 2],
    /// Radius of that sphere.
    radius: f32,
    seconds: Times,
}

/// Times since the entry into an attack, in seconds.
#[derive(Clone, Copy, Debug)]
pub(in crate::character) struct Times {
    /// Start of the attack.
    pub start: f32,
    /// The limb has reached furthest.
    pub contact: f32,
    /// End of the attack.
    pub end: f32,
}

/// What is struck, above the ground of the character that strikes.
#[derive(Clone, Copy, Debug)]
pub(in crate::character) struct Target {
    /// Place on the ground (x, z), in metres.
    pub place: Vec2,
    /// The lowest and the highest point, in metres.
    pub heights: [f32; 2],
    /// Velocity on the ground (x, z), in metres per second.
    pub velocity: Vec2,
}

impl Target {
    /// Where it is expected after a time, in seconds. Who fights goes to and fro.
    fn at(&self, seconds: f32) -> Vec2 {
        /// Largest way that is expected, in metres.
        const FURTHEST: f32 = 0.2;
        self.place + (self.velocity * seconds).clamp_length_max(FURTHEST)
    }
}

/// From where the attack that needs the least way reaches.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in crate::character) struct Reach {
    /// Distance of the target from the root, in metres.
    pub distance: f32,
    /// Direction of the target from the character's heading, in radians.
    pub bearing: f32,
}

/// A strike that has begun.
#[derive(Clone, Copy, Debug)]
pub(in crate::character) struct Begun {
    /// Index of the attack.
    pub attack: u32,
    pub seconds: Times,
}

/// Attacks that a character has begun, the latest first; `u32::MAX` for none.
pub(in crate::character) type Recent = [u32; 3];

impl StrikeTable {
    pub(super) fn new(baked: &BakedGraph) -> Self {
        let edges = edges_by_clip(baked.graph());
        let mut table = Self::default();
        for attack in baked.attack_moves() {
            table.add(baked, attack, &edges);
        }
        table
    }

    fn add(&mut self, baked: &BakedGraph, attack: &AttackMove, edges: &[PlayedBy]) {
        let graph = baked.graph();
        let number = self.attacks.len() as u32;
        let event = graph.edge(attack.edge).event.map(|id| graph.event(id));
        let skeleton = graph.skeleton();
        let takes_part = |&joint: &JointId| {
            let named = event.map_or(&[][..], |event| &event.joints);
            named.is_empty() || skeleton.ancestry(joint).any(|above| named.contains(&above))
        };
        self.attacks.push(Attack {
            edge: attack.edge,
            joints: skeleton.ids().filter(takes_part).collect(),
            limb: baked.attacking_spheres(attack),
        });
        let contact = Contact::new(&baked.attack_spheres(attack));
        let (Some(event), Some(contact)) = (event, contact) else {
            return;
        };
        let frame_rate = graph.frame_rate() as f32;
        let played = |frame: u32| match frame.checked_sub(event.first) {
            Some(ahead) => Some((attack.edge, ahead)),
            None => edges[event.clip.index()][frame as usize]
                .filter(|&(edge, _)| leads(graph, edge, attack.edge)),
        };
        let before = |seconds: f32| {
            let frames = (seconds * frame_rate).round() as u32;
            (event.first + contact.frames[0]).saturating_sub(frames)
        };
        let lead_in = (before(LONGEST_WAY)..event.first).rev();
        let lead_in = lead_in.take_while(|&frame| played(frame).is_some()).count() as u32;
        // An attack without so much of a lead-in is entered as early as it can be.
        let first = (event.first - lead_in).max(before(LONGEST_WAY));
        let last = first.max(before(NOTICE));
        for frame in (first..=last).step_by(2) {
            let Some((edge, edge_frame)) = played(frame) else {
                continue;
            };
            let [start, contact_at, end] = [0, contact.frames[1], event.last - event.first]
                .map(|at| (event.first + at).saturating_sub(frame) as f32 / frame_rate);
            let seconds = Times {
                start,
                contact: contact_at,
                end,
            };
            self.starts.push(Start::new(
                graph,
                (number, edge, edge_frame),
                Node {
                    clip: event.clip,
                    frame,
                },
                &contact.placed(attack.placement),
                seconds,
            ));
        }
    }

    /// The edge that plays an attack.
    pub(in crate::character) fn edge(&self, attack: u32) -> Option<EdgeId> {
        Some(self.attacks.get(attack as usize)?.edge)
    }

    /// The spheres that strike in an attack.
    pub(in crate::character) fn limb(&self, attack: u32) -> &[BodySphere] {
        self.attacks
            .get(attack as usize)
            .map_or(&[], |attack| &attack.limb)
    }

    /// Whether the graph has an attack of a kind.
    pub(in crate::character) fn has(&self, kind: StrikeKind) -> bool {
        self.starts_of(kind).next().is_some()
    }

    fn starts_of(&self, kind: StrikeKind) -> impl Iterator<Item = &Start> {
        self.starts.iter().filter(move |start| {
            let attack = &self.attacks[start.attack as usize];
            match kind {
                StrikeKind::Any => true,
                StrikeKind::Attack(edge) => attack.edge == edge,
                StrikeKind::Limb(joint) => attack.joints.contains(&joint),
            }
        })
    }
}

impl Start {
    /// A start at a frame of a clip, which is a frame of an edge. The contact is in the space of the clip.
    fn new(
        graph: &MotionGraph,
        (attack, edge, edge_frame): (u32, EdgeId, u32),
        at: Node,
        contact: &Contact,
        seconds: Times,
    ) -> Self {
        let frame_rate = graph.frame_rate() as f32;
        let facing = Facing::of(graph.skeleton());
        let last = graph.clip(at.clip).frames() as u32 - 1;
        let [stance, next] = [at.frame, (at.frame + 1).min(last)]
            .map(|frame| Stance::at_frame(graph, facing, Node { frame, ..at }));
        let features = super::Features::from_body(&stance, [&stance, &next], 1.0 / frame_rate);
        let inverse =
            Rigid2::new(stance.placement.heading(), stance.root.x, stance.root.z).inverse();
        Self {
            attack,
            moment: Moment {
                edge,
                edge_frame,
                clip: at.clip,
                frame: at.frame,
                left: f32::INFINITY,
                velocity: Vec2::ZERO,
                ahead: 0.0,
                heading: stance.placement.heading(),
                facing: stance.placement.heading(),
                pace: features.velocity.xz(),
                root_pace: features.velocity.xz(),
                lean: Vec2::ZERO,
                push: 0.0,
                root: stance.root.xz(),
                centre: stance.root.xz(),
                toes: stance.toes.map(|toe| Vec2::new(toe.x, toe.z)),
                standing: standing(graph, at.clip, at.frame),
                calm_for: 0.0,
            },
            row: features.row(),
            contact: contact.ends.map(|end| inverse.point(end)),
            radius: contact.radius,
            seconds,
        }
    }

    /// From where it reaches.
    fn reach(&self) -> Reach {
        let middle = 0.5 * (self.contact[0] + self.contact[1]);
        let way = Vec2::new(middle.x, middle.z);
        Reach {
            distance: way.length(),
            bearing: heading_of(way),
        }
    }

    /// Distance by which its height misses a target, in metres.
    fn off_height(&self, target: &Target) -> f32 {
        let height = 0.5 * (self.contact[0].y + self.contact[1].y);
        (height - height.clamp(target.heights[0], target.heights[1])).abs()
    }

    /// Distance of the target from the foremost sphere's way, for a character at a place with a heading, in metres.
    fn off(&self, place: Vec2, heading: f32, target: &Target) -> f32 {
        let turned = Rigid2::new(heading, place.x, place.y);
        let [from, to] = self.contact.map(|end| turned.point(end));
        let at = target.at(self.seconds.contact);
        let height = (0.5 * (from.y + to.y)).clamp(target.heights[0], target.heights[1]);
        let (along, at) = (to - from, Vec3::new(at.x, height, at.y) - from);
        let share = at.dot(along) / along.length_squared().max(1e-9);
        (at - along * share.clamp(0.0, 1.0)).length()
    }
}

/// Where the foremost sphere of an attack is far out.
struct Contact {
    /// First and last frame, from the attack's start.
    frames: [u32; 2],
    /// Centre of the sphere in these frames.
    ends: [Vec3; 2],
    radius: f32,
}

impl Contact {
    /// The sphere that comes furthest from where the character was at the attack's start, from [`Self::FAR`] of that distance on until it is
    /// furthest. Distances are along the ground in the direction of the furthest point.
    fn new(spheres: &[MovingSphere]) -> Option<Self> {
        let ground = |center: Vec3| Vec2::new(center.x, center.z);
        let each = spheres.iter().flat_map(|sphere| {
            let keys = sphere.keys().iter().enumerate();
            keys.map(move |(frame, key)| (sphere, frame, ground(key.center).length()))
        });
        // The first of several that reach as far.
        let (sphere, last, reach) =
            each.reduce(|best, one| if one.2 > best.2 { one } else { best })?;
        let keys = sphere.keys();
        let way = ground(keys[last].center).normalize_or(Vec2::Y);
        let is_near = |at: &usize| ground(keys[*at].center).dot(way) < Self::FAR * reach;
        let first = (0..last).rev().find(is_near).map_or(0, |near| near + 1);
        Some(Self {
            frames: [first as u32, last as u32],
            ends: [first, last].map(|frame| keys[frame].center),
            radius: keys[last].radius,
        })
    }

    /// Share of the largest distance from which on the sphere is far out.
    const FAR: f32 = 0.8;

    fn placed(&self, placement: Rigid2) -> Self {
        Self {
            ends: self.ends.map(|end| placement.point(end)),
            ..*self
        }
    }
}

/// Whether the default continuation of an edge plays another one, without leaving the clip.
fn leads(graph: &MotionGraph, edge: EdgeId, to: EdgeId) -> bool {
    /// Maximum number of edges of a lead-in.
    const MOST: usize = 256;
    let next = |&edge: &EdgeId| {
        let next = graph.natural_edge(graph.edge(edge).to);
        (graph.edge(next).motion == EdgeMotion::Clip).then_some(next)
    };
    let mut way = std::iter::successors(Some(edge), next).take(MOST);
    way.any(|edge| edge == to)
}

impl Reach {
    /// Whether its numbers are finite.
    pub(in crate::character) fn is_sound(self) -> bool {
        self.distance.is_finite() && self.bearing.is_finite()
    }

    /// The aim of a character that goes to where its attack reaches a target.
    pub(in crate::character) fn aim(self, place: Vec2, target: Vec2, speed: f32) -> Aim {
        /// Time in which the rest of the way is walked, in seconds.
        const BRAKING: f32 = 0.8;
        /// Distance from the place within which the character faces the target as the attack needs it, in metres.
        const NEAR: f32 = 1.0;
        /// Distance from the place within which the character stands, in metres: the limb is far out over a longer way.
        const THERE: f32 = 0.12;
        /// Distance that a walking character goes on while it stops, in metres, and the speed at which it corrects the rest: too slow for a walk,
        /// which would lead past the place.
        const STOP: f32 = 0.2;
        const CREEP: f32 = 0.25;
        let way = target - place;
        let far = way.length() - self.distance;
        let heading = heading_of(way);
        let speed = match far {
            _ if far.abs() < THERE => 0.0,
            _ if far < 0.0 => -CREEP,
            _ if far < STOP => CREEP,
            _ => (far / BRAKING).min(speed),
        };
        Aim {
            velocity: direction(heading) * speed,
            facing: (far < NEAR).then_some(heading - self.bearing),
        }
    }
}

impl Steering {
    /// Begins the attack of a kind that reaches the target from here and that the body comes into most easily. If there is none, it writes
    /// from where one reaches.
    pub(in crate::character) fn strike(
        &self,
        step: &SteerStep<'_>,
        (target, kind): (&Target, StrikeKind),
        (recent, reach): (&Recent, &mut Option<Reach>),
        playing: &mut Playing,
        scratch: &mut SteerScratch,
    ) -> Option<Begun> {
        /// Cost of an attack that passes the target's middle at a metre, in squared distances of features.
        const OFF: f32 = 80.0;
        let graph = step.baked.graph();
        playing.ensure(graph, step.dt);
        let playhead = playing.motion.playhead(graph, playing.seconds);
        let current = self.table.at(graph, playhead);
        let current = current.map(|current| self.table.moments[current]);
        // The limb is looked up from the root, which stays where it is.
        let mut now = step.now(playing, None, scratch);
        now.centre = now.stance.root.xz();
        let body = Body::new(&now, current.as_ref()).on_root();
        let jumps = Jumps::new(&self.table, step, body, step.settings.blend);
        let starts = self.strikes.starts_of(kind);
        let possible = starts.filter_map(|start| {
            let (turn, off) = step.turn_to(start, &now, target)?;
            let cost = cost(start, &jumps, &now, recent) + OFF * off;
            Some((cost, start, turn))
        });
        let Some((_, start, turn)) = possible.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            *reach = self.nearest_reach(&now, target, kind, *reach);
            return None;
        };
        let moment = &start.moment;
        let heading = now.stance.placement.heading() + turn - moment.facing;
        let entry = step.entry_at(moment, heading, &now, [1.0, 0.0]);
        let played = [1.0, jumps.blend(moment, 1.0)];
        playing.enter(graph, &entry, played, &moment.standing, &mut scratch.spare);
        Some(Begun {
            attack: start.attack,
            seconds: start.seconds,
        })
    }

    /// From where the attack reaches for which the character has to go and turn least.
    /// `kept` is preferred.
    fn nearest_reach(
        &self,
        now: &Now,
        target: &Target,
        kind: StrikeKind,
        kept: Option<Reach>,
    ) -> Option<Reach> {
        /// A turn of a radian counts as this way, and a metre of height as so many metres of way.
        const TURN: f32 = 0.4;
        const HEIGHT: f32 = 4.0;
        /// Another attack is nearer by this, in metres.
        const GAIN: f32 = 0.1;
        let way = target.place - Vec2::new(now.stance.root.x, now.stance.root.z);
        let bearing = heading_of(way) - now.stance.placement.heading();
        let each = self.strikes.starts_of(kind).map(|start| {
            let reach = start.reach();
            let turn = wrapped(bearing - reach.bearing).abs().min(FRAC_PI_2);
            let height = start.off_height(target);
            let cost = (way.length() - reach.distance).abs() + TURN * turn + HEIGHT * height;
            let gain = if kept == Some(reach) { GAIN } else { 0.0 };
            (cost - gain, reach)
        });
        let least = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(least.1)
    }
}

/// What it costs the body to come into an attack, in squared distances of features.
fn cost(start: &Start, jumps: &Jumps<'_>, now: &Now, recent: &Recent) -> f32 {
    /// Cost of an attack that was the last one. Earlier ones cost less.
    const REPEATED: f32 = 40.0;
    /// Cost of a contact that comes a second earlier than [`NOTICE`].
    const SUDDEN: f32 = 100.0;
    let sudden = SUDDEN * (NOTICE - start.seconds.contact).max(0.0);
    let repeated = recent.iter().position(|&attack| attack == start.attack);
    let repeated = repeated.map_or(0.0, |age| REPEATED / (1 + age) as f32);
    let effort = jumps.effort(&start.moment, 1.0, f32::INFINITY);
    let effort = effort.unwrap_or(f32::INFINITY);
    distance(&start.row, &now.features.row()) + effort + repeated + sudden
}

impl SteerStep<'_> {
    /// The turn with which an attack reaches a target from here, and how far off its middle; `None` if it does not.
    fn turn_to(&self, start: &Start, now: &Now, target: &Target) -> Option<(f32, f32)> {
        /// The sphere's surface comes at least so near to the target's middle, in metres.
        const NEAR: f32 = 0.05;
        let place = Vec2::new(now.stance.root.x, now.stance.root.z);
        let heading = now.stance.placement.heading();
        let at = target.at(start.seconds.contact);
        let off = heading_of(at - place) - start.reach().bearing - heading;
        // As far as a standing character turns until the contact.
        let most = self.settings.standing_turn * NOTICE;
        let turn = wrapped(off).clamp(-most, most);
        let off = start.off(place, heading + turn, target);
        (off < start.radius + NEAR).then_some((turn, off))
    }
}

impl SteerState {
    /// Goes on searching, although the character stands as it should: it waits for a moment in which it can strike. `searched` says whether it has
    /// looked for one in this step.
    pub(in crate::character) fn stay_ready(&mut self, interval: f32, searched: bool) {
        if std::mem::take(&mut self.is_held) && searched {
            self.search_in = interval;
        }
    }
}
