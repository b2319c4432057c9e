//! How late may an attack be seen? Balls that would hit the continued motion, by the time from the query to the contact.
//!
//! A moment of natural motion outside of events is taken, the motion continues as it would without an attack, and a ball flies at the
//! place where a part of the body will be at the contact. Only balls that hit this motion count. Of a ball's flight the last
//! stretch alone is known, and nothing of it before the query.

use std::f32::consts::TAU;

use glam::Vec3;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use super::interval::wilson;
use super::throw::{RandomDraw, Throw, random_of};
use super::why_hit::{Cause, Causes};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{EdgeId, Motion, MotionGraph, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, AttackError};

/// Times from the query to the contact, in seconds.
pub const CONTACTS: [f32; 8] = [0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.5, 2.0];

/// A part of the body that balls are aimed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The head, at 94% of the body's height.
    Head,
    /// The middle of the trunk, at 68% of the body's height.
    Chest,
    /// The hips, at 53% of the body's height.
    Hip,
    /// The knees, at 28% of the body's height.
    Leg,
}

impl Part {
    /// All parts, from the head down.
    pub const ALL: [Self; 4] = [Self::Head, Self::Chest, Self::Hip, Self::Leg];

    /// Name of the part: one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Chest => "chest",
            Self::Hip => "hip",
            Self::Leg => "leg",
        }
    }

    /// Height of the part, as a share of the body's height.
    fn height(self) -> f32 {
        match self {
            Self::Head => 0.94,
            Self::Chest => 0.68,
            Self::Hip => 0.53,
            Self::Leg => 0.28,
        }
    }

    /// 40% of the balls are aimed at the head, 30% at the chest, 15% at the hips and 15% at the legs.
    fn drawn(share: f32) -> Self {
        match share {
            s if s < 0.40 => Self::Head,
            s if s < 0.70 => Self::Chest,
            s if s < 0.85 => Self::Hip,
            _ => Self::Leg,
        }
    }
}

/// Settings of the thrown balls.
#[derive(Clone, Debug, PartialEq)]
pub struct BallSettings {
    /// Speed of a ball, in metres per second. Default 8.
    pub speed: f32,
    /// Radius of a ball, in metres. Default 0.1.
    pub radius: f32,
    /// Length of the flight before the contact that is known, in metres. Default 2.5.
    pub flight: f32,
    /// Length of the flight after the contact, in metres. Default 2.5, so that a step back does not outlast it.
    pub beyond: f32,
    /// Largest slope of the flight, up or down, radians. Default 10°.
    pub slope: f32,
}

impl Default for BallSettings {
    fn default() -> Self {
        Self {
            speed: 8.0,
            radius: 0.1,
            flight: 2.5,
            beyond: 2.5,
            slope: 10f32.to_radians(),
        }
    }
}

/// A ball that would hit, with the state of the character at the throw.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedThrow {
    /// The character and the ball.
    pub throw: Throw,
    /// The part of the body that the ball is aimed at.
    pub part: Part,
    /// Whether the character walks at the throw: its root is faster than [`WALKING`].
    pub walks: bool,
}

/// Speed of the root over the ground above which a character counts as walking, in metres per second.
pub const WALKING: f32 = 0.4;

/// Draws balls for a graph.
#[derive(Clone, Debug)]
pub struct BallThrower<'a> {
    baked: &'a BakedGraph,
    settings: BallSettings,
    /// The body's spheres that a ball may be aimed at, by part.
    targets: [Vec<usize>; 4],
}

/// The place that a ball flies at, and the time of the contact, in seconds from the query.
#[derive(Clone, Copy, Debug)]
struct Aim {
    contact: f32,
    part: Part,
}

/// Balls are drawn this often for a moment; then the last one is taken, which the motion avoids by itself.
const MOST_DRAWN: usize = 64;

impl<'a> BallThrower<'a> {
    /// Finds the parts of the body.
    #[must_use]
    pub fn new(baked: &'a BakedGraph, settings: BallSettings) -> Self {
        let targets = Part::ALL.map(|part| targets(baked, part));
        Self {
            baked,
            settings,
            targets,
        }
    }

    /// Draws a ball whose contact is `contact` seconds after the query. `None` if no drawn ball would hit.
    ///
    /// # Errors
    /// Settings that make no attack.
    pub fn throw(&self, contact: f32, draw: RandomDraw) -> Result<Option<TimedThrow>, AttackError> {
        let graph = self.baked.graph();
        let RandomDraw { seed, index } = draw;
        let mut random = random_of(seed, index);
        // The golden ratio's multiples lie evenly, however many there are.
        const GOLDEN: f64 = 0.618_033_988_749_895;
        let first: f64 = random_of(seed, u64::MAX - 1).random();
        let playhead = moment(graph, (first + index as f64 * GOLDEN).fract());
        let part = Part::drawn(random.random());
        let mut motion = Motion::new(graph, playhead, &[]);
        let last = contact + self.settings.beyond / self.settings.speed;
        motion.extend(graph, last + 0.1);
        for _ in 0..MOST_DRAWN {
            let attack = self.ball(&motion, Aim { contact, part }, &mut random)?;
            let throw = Throw { playhead, attack };
            if throw.would_hit(self.baked) {
                return Ok(Some(TimedThrow {
                    throw,
                    part,
                    walks: walks(graph, &motion),
                }));
            }
        }
        Ok(None)
    }

    /// A ball at one of the part's spheres, where it is at the contact.
    fn ball(
        &self,
        motion: &Motion,
        aim: Aim,
        random: &mut Pcg64Mcg,
    ) -> Result<Attack, AttackError> {
        let BallSettings {
            speed,
            radius,
            flight,
            beyond,
            slope,
        } = self.settings;
        let Aim { contact, part } = aim;
        let spheres = &self.targets[part as usize];
        let sphere = spheres[random.random_range(0..spheres.len())];
        let around = TAU * random.random::<f32>();
        let up = slope * (2.0 * random.random::<f32>() - 1.0);
        let way = Vec3::new(around.sin() * up.cos(), up.sin(), around.cos() * up.cos());
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        motion.sample(self.baked.graph(), contact, &mut pose);
        forward_kinematics(self.baked.graph().skeleton(), &pose, &mut joints);
        let target = self.baked.body().spheres[sphere].centre(&joints);
        let key = |t: f32| SphereKey {
            t,
            center: target + way * (t - contact) * speed,
            radius,
        };
        let start = (contact - flight / speed).max(0.0);
        Attack::new(vec![vec![key(start), key(contact + beyond / speed)]])
    }
}

/// Whether the root is on its way in the first third of a second.
fn walks(graph: &MotionGraph, motion: &Motion) -> bool {
    const SECONDS: f32 = 0.3;
    let way = motion.root(graph, SECONDS) - motion.root(graph, 0.0);
    Vec3::new(way.x, 0.0, way.z).length() > WALKING * SECONDS
}

/// The moment at a share of all natural motion: the clips' edges without an event, each moment as long as any other.
fn moment(graph: &MotionGraph, share: f64) -> Playhead {
    let mut edges: Vec<EdgeId> = graph.natural_edges().collect();
    if edges.is_empty() {
        edges.extend(graph.edge_ids());
    }
    let frames = |id: EdgeId| f64::from(graph.edge(id).frames);
    let total: f64 = edges.iter().map(|&id| frames(id)).sum();
    let mut left = share * total;
    let mut place = (EdgeId(0), 0.0);
    for id in edges {
        let frames = frames(id);
        place = (id, left.min(frames) as f32);
        if left < frames {
            break;
        }
        left -= frames;
    }
    Playhead::at(graph, place.0, place.1, Rigid2::IDENTITY)
}

/// Indices of the spheres in the middle of a part, in the graph's first posture. For a part of the trunk, the sphere nearest
/// to the body's axis at the part's height; for the legs, the spheres nearest to that height, one on each side.
fn targets(baked: &BakedGraph, part: Part) -> Vec<usize> {
    /// Maximum difference of the heights of both knees, as a share of the body's height.
    const ALIKE: f32 = 0.02;
    let (skeleton, body) = (baked.graph().skeleton(), baked.body());
    let node = baked.graph().nodes()[0];
    let (mut pose, mut joints): (Pose, Vec<JointTransform>) = Default::default();
    baked
        .graph()
        .clip(node.clip)
        .pose(node.frame as usize, &mut pose);
    forward_kinematics(skeleton, &pose, &mut joints);
    let mut centres = Vec::new();
    body.centres(&joints, &mut centres);
    let tops = centres.iter().zip(&body.spheres);
    let top = tops.map(|(c, s)| c.y + s.radius).fold(0.0, f32::max);
    let axis = Vec3::new(pose.root.x, part.height() * top, pose.root.z);
    let is_sided = |sphere: usize| skeleton.mirror(body.spheres[sphere].joint).is_some();
    let away = |sphere: usize| {
        let apart = centres[sphere] - axis;
        let wrong_side = is_sided(sphere) != (part == Part::Leg);
        let metres = match part {
            Part::Leg => apart.y.abs(),
            _ => apart.length(),
        };
        metres + if wrong_side { top } else { 0.0 }
    };
    let all = 0..centres.len();
    let least = all.clone().map(away).fold(f32::INFINITY, f32::min);
    let margin = match part {
        Part::Leg => ALIKE * top,
        _ => 0.0,
    };
    all.filter(|&sphere| away(sphere) <= least + margin)
        .collect()
}

/// Attacks and how many of them were avoided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AvoidedCount {
    /// Number of attacks.
    pub attacks: u32,
    /// Number of attacks that were avoided.
    pub avoided: u32,
}

impl AvoidedCount {
    /// Adds an attack.
    pub fn add(&mut self, avoided: bool) {
        self.attacks += 1;
        self.avoided += u32::from(avoided);
    }

    /// Share of the attacks that were avoided; 0 if there are none.
    #[must_use]
    pub fn value(self) -> f64 {
        f64::from(self.avoided) / f64::from(self.attacks.max(1))
    }

    /// 95% confidence interval of the share.
    #[must_use]
    pub fn interval(self) -> [f64; 2] {
        wilson(self.avoided, self.attacks)
    }
}

/// Number of avoided balls with one time of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimeRow {
    /// Time of the contact, in seconds from the query.
    pub contact: f32,
    /// All.
    pub all: AvoidedCount,
    /// Balls at each [`Part`], in the order of [`Part::ALL`].
    pub parts: [AvoidedCount; 4],
    /// Balls that come while the character walks.
    pub walking: AvoidedCount,
    /// Balls that come while the character walks; only those count as avoided that it avoids by a layered evasion, so that
    /// it walks on.
    pub walking_on: AvoidedCount,
    /// Why the others hit.
    pub causes: Causes,
}

impl TimeRow {
    /// Notes what became of a ball.
    pub fn add(&mut self, baked: &BakedGraph, throw: &TimedThrow, answer: &Answer) {
        let avoided = answer.avoided;
        if !avoided {
            let cause = Cause::of(baked, &throw.throw, answer);
            self.causes.add(cause, answer);
        }
        self.all.add(avoided);
        self.parts[throw.part as usize].add(avoided);
        if throw.walks {
            self.walking.add(avoided);
            let is_layered = answer.chosen().layer.is_some();
            self.walking_on.add(avoided && is_layered);
        }
    }
}

impl std::ops::AddAssign for AvoidedCount {
    fn add_assign(&mut self, other: Self) {
        self.attacks += other.attacks;
        self.avoided += other.avoided;
    }
}

impl std::ops::AddAssign for TimeRow {
    fn add_assign(&mut self, other: Self) {
        self.all += other.all;
        self.walking += other.walking;
        self.walking_on += other.walking_on;
        self.causes += other.causes;
        for (mine, theirs) in self.parts.iter_mut().zip(other.parts) {
            *mine += theirs;
        }
    }
}
