//! Random attacks: thrown balls that would hit a character whose motion continues.
//!
//! A ball is announced before it is thrown, as by the swing of an arm: the lead is the time from the query to the throw. From
//! the throw on the ball flies straight at the place that a part of the body will have when the ball arrives, if the character's
//! motion continues by itself, and beyond it.

use glam::Vec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use sabaki::anim::{Pose, forward_kinematics};
use sabaki::graph::{Edge, EdgeId, EdgeMotion, Motion, Playhead};
use sabaki::internal::{ExactTest, Extent, MotionBody};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Attack, AttackError, Request};

/// Settings of the balls.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrowSettings {
    /// Time from the query to the throw, in seconds. Default: 0.4 to 1.5.
    pub lead: (f32, f32),
    /// Speed, in metres per second. Default: 5 to 15.
    pub speed: (f32, f32),
    /// Radius, in metres. Default: 0.05 to 0.15.
    pub radius: (f32, f32),
    /// Distance from the thrower to the target, in metres. Default: 2 to 4.
    pub distance: (f32, f32),
    /// Distance that the ball flies on behind the target, in metres. Default: 1.
    pub beyond: f32,
    /// Largest slope of the flight, up or down, in radians. Default: 20°.
    pub slope: f32,
}

impl Default for ThrowSettings {
    fn default() -> Self {
        Self {
            lead: (0.4, 1.5),
            speed: (5.0, 15.0),
            radius: (0.05, 0.15),
            distance: (2.0, 4.0),
            beyond: 1.0,
            slope: 20f32.to_radians(),
        }
    }
}

/// A character at a place in the graph, and a ball to avoid.
#[derive(Clone, Debug, PartialEq)]
pub struct Throw {
    /// Place of the character. Its frame (root on the ground, facing +Z) is the world.
    pub playhead: Playhead,
    /// The ball, in the same world.
    pub attack: Attack,
}

impl Throw {
    /// The request of the character that the ball is thrown at.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request::new(self.playhead, &self.attack)
    }

    /// Whether the ball hits the character if its motion continues.
    #[must_use]
    pub fn would_hit(&self, baked: &BakedGraph) -> bool {
        let mut motion = Motion::new(baked.graph(), self.playhead, &[]);
        motion.extend(baked.graph(), self.attack.end() + 0.1);
        let test = ExactTest {
            extent: Extent::UNTIL_HIT,
            ..ExactTest::new(baked, &self.attack)
        };
        !test
            .on_motion(&motion, &mut MotionBody::default())
            .is_clean()
    }
}

/// The `index`th throw of a seed; it does not depend on the order of calls.
///
/// # Errors
/// The settings make no attack: a radius is not above 0, or a lead is below 0.
pub fn throw(
    baked: &BakedGraph,
    settings: &ThrowSettings,
    seed: u64,
    index: u64,
) -> Result<Throw, AttackError> {
    let mut random = random_of(seed, index);
    let playhead = random_moment(baked, &mut random);
    let attack = settings.ball(baked, playhead, &mut random)?;
    Ok(Throw { playhead, attack })
}

/// A ball from a given direction at a given height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Direction that it comes from, in radians: 0 from the front of the character, π/2 from its
    /// left.
    pub from: f32,
    /// Height of the target, as a share of the body's height in its pose: 0 is the ground, 1 the
    /// top of the head.
    pub height: f32,
    /// Time from the query to the throw, in seconds.
    pub lead: f32,
    /// Speed, in metres per second.
    pub speed: f32,
    /// Radius, in metres.
    pub radius: f32,
    /// Distance from the thrower to the body, and from there to the end of the flight, in metres.
    pub distance: f32,
}

/// The `index`th aimed throw of a seed: at a random moment, horizontally, at the part of the body that will be
/// nearest to the body's axis at the wanted height when the ball arrives, if the motion continues. Throws of one index share their
/// moment.
///
/// # Errors
/// The aim makes no attack: a radius or a speed is not above 0.
pub fn aimed(baked: &BakedGraph, aim: &Aim, seed: u64, index: u64) -> Result<Throw, AttackError> {
    let playhead = random_moment(baked, &mut random_of(seed, index));
    let spheres = &baked.body().spheres;
    let contact = aim.lead + aim.distance / aim.speed;
    let (centres, root) = centres(baked, playhead, contact);
    let tops = centres.iter().zip(spheres).map(|(c, s)| c.y + s.radius);
    let top = tops.fold(0.0, f32::max);
    let wanted = Vec3::new(root.x, aim.height * top, root.z);
    let nearest = |a: &&Vec3, b: &&Vec3| {
        let apart = |centre: &Vec3| centre.distance_squared(wanted);
        apart(a).total_cmp(&apart(b))
    };
    let target = centres.iter().min_by(nearest).copied().unwrap_or(wanted);
    let back = Vec3::new(aim.from.sin(), 0.0, aim.from.cos()) * aim.distance;
    let key = |t: f32, center: Vec3| SphereKey {
        t,
        center,
        radius: aim.radius,
    };
    let end = aim.lead + 2.0 * aim.distance / aim.speed;
    let attack = Attack::new(vec![vec![
        key(aim.lead, target + back),
        key(end, target - back),
    ]])?;
    Ok(Throw { playhead, attack })
}

/// Identifies one of the random draws of a seed. Equal identifiers draw the same, regardless of the order of calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomDraw {
    /// Seed.
    pub seed: u64,
    /// Number of the draw.
    pub index: u64,
}

pub(crate) fn random_of(seed: u64, index: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed ^ index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// World positions of the body's spheres and of the root, some seconds after a place of the graph if the motion continues.
fn centres(baked: &BakedGraph, playhead: Playhead, seconds: f32) -> (Vec<Vec3>, Vec3) {
    let graph = baked.graph();
    // A ball that never arrives is no attack.
    let seconds = if seconds.is_finite() {
        seconds.max(0.0)
    } else {
        0.0
    };
    let mut motion = Motion::new(graph, playhead, &[]);
    motion.extend(graph, seconds);
    let (mut pose, mut joints, mut centres) = (Pose::default(), Vec::new(), Vec::new());
    motion.sample(graph, seconds, &mut pose);
    forward_kinematics(graph.skeleton(), &pose, &mut joints);
    baked.body().centres(&joints, &mut centres);
    (centres, motion.root(graph, seconds))
}

/// A random moment of the graph's clips; all moments are equally likely.
fn random_moment(baked: &BakedGraph, random: &mut impl Rng) -> Playhead {
    let graph = baked.graph();
    // A graph may consist of transitions alone; then the moments are those of the transitions.
    let clips_only = graph
        .edges()
        .iter()
        .any(|edge| edge.motion == EdgeMotion::Clip);
    let counts = |edge: &Edge| !clips_only || edge.motion == EdgeMotion::Clip;
    let moments = || {
        graph
            .edge_ids()
            .map(|id| (id, graph.edge(id)))
            .filter(|(_, edge)| counts(edge))
    };
    let total: u64 = moments().map(|(_, edge)| u64::from(edge.frames)).sum();
    let mut left = random.random_range(0.0..total as f64);
    let mut place = (EdgeId(0), 0.0);
    for (id, edge) in moments() {
        let frames = f64::from(edge.frames);
        place = (id, left.min(frames) as f32);
        if left < frames {
            break;
        }
        left -= frames;
    }
    Playhead::at(graph, place.0, place.1, Rigid2::IDENTITY)
}

impl ThrowSettings {
    /// A random ball that is aimed at a character.
    fn ball(
        &self,
        baked: &BakedGraph,
        playhead: Playhead,
        random: &mut impl Rng,
    ) -> Result<Attack, AttackError> {
        let spheres = baked.body().spheres.len();
        let sphere = random.random_range(0..spheres);
        let mut between = |(low, high): (f32, f32)| low + (high - low) * random.random::<f32>();
        let (lead, speed, radius) = (
            between(self.lead),
            between(self.speed),
            between(self.radius),
        );
        let distance = between(self.distance);
        let target = centres(baked, playhead, lead + distance / speed).0[sphere];
        let (around, up) = (
            between((0.0, std::f32::consts::TAU)),
            between((-self.slope, self.slope)),
        );
        let flight = Vec3::new(around.sin() * up.cos(), up.sin(), around.cos() * up.cos());
        let key = |metres: f32| SphereKey {
            t: lead + (metres + distance) / speed,
            center: target + flight * metres,
            radius,
        };
        Attack::new(vec![vec![key(-distance), key(self.beyond)]])
    }
}
