//! A duel played back: of each exchange the attack and the answer, from a place of its own.

use glam::{Vec2, Vec3};

use super::{Camera, Capsule, Figure, Light, Look, Shot};
use sabaki::anim::{JointId, JointTransform, Pose, forward_kinematics};
use sabaki::duel::{Exchange, Fighter, Side};
use sabaki::maps::{BakedGraph, MovingSphere, SphereKey};

/// How a duel is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoutSettings {
    /// Seconds that are shown before an attack's start. Default 0.75.
    pub before: f32,
    /// Seconds that are shown after its end. Default 0.45.
    pub after: f32,
    /// How fast time goes about the moment at which an attack is nearest; 1 is as everywhere else. Default 0.3.
    pub slowest: f32,
    /// Colours of the fighters.
    pub looks: [Look; 2],
}

impl Default for BoutSettings {
    fn default() -> Self {
        let blue = Look {
            clothes: Vec3::new(0.10, 0.19, 0.44),
            ..Look::default()
        };
        Self {
            before: 0.75,
            after: 0.45,
            slowest: 0.3,
            looks: [Look::default(), blue],
        }
    }
}

/// A duel that has been fought.
#[derive(Clone, Debug)]
pub struct Bout<'a> {
    baked: &'a BakedGraph,
    fighters: &'a [Fighter; 2],
    exchanges: &'a [Exchange],
    figures: [Figure; 2],
    settings: BoutSettings,
}

/// What is shown of an exchange, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Which exchange.
    pub exchange: usize,
    /// First and last moment, seconds since the duel's start.
    pub span: (f32, f32),
    /// It does not move.
    pub camera: Camera,
}

const STRIKE: Vec3 = Vec3::new(0.93, 0.10, 0.03);

impl<'a> Bout<'a> {
    /// Of fighters and what they did to each other.
    #[must_use]
    pub fn new(
        baked: &'a BakedGraph,
        fighters: &'a [Fighter; 2],
        exchanges: &'a [Exchange],
        settings: &BoutSettings,
    ) -> Self {
        let skeleton = baked.graph().skeleton();
        let figure = |look: &Look| Figure::of(skeleton, baked.body(), look);
        Self {
            baked,
            fighters,
            exchanges,
            figures: [0, 1].map(|side| figure(&settings.looks[side])),
            settings: *settings,
        }
    }

    /// One cut for each exchange, none of which shows what the one before has shown.
    #[must_use]
    pub fn cuts(&self, aspect: f32) -> Vec<Cut> {
        let mut shown = 0.0;
        let mut cuts = Vec::with_capacity(self.exchanges.len());
        for (index, exchange) in self.exchanges.iter().enumerate() {
            let start = exchange.announced + exchange.attack.start() - self.settings.before;
            let span = (start.max(shown), exchange.end() + self.settings.after);
            shown = span.1;
            cuts.push(Cut {
                exchange: index,
                span,
                camera: self.camera(exchange, span, aspect),
            });
        }
        cuts
    }

    /// When an exchange's attack is nearest to who avoids it, seconds since the duel's start.
    #[must_use]
    pub fn nearest_at(&self, cut: &Cut) -> f32 {
        let exchange = &self.exchanges[cut.exchange];
        exchange.announced + exchange.clearance.time
    }

    /// The moments of a film of a cut, with so many pictures a second: slow where the attack is nearest.
    #[must_use]
    pub fn moments(&self, cut: &Cut, rate: f32) -> Vec<f32> {
        let (mut moments, mut t) = (Vec::new(), cut.span.0);
        while t < cut.span.1 {
            moments.push(t);
            t += self.pace(cut, t) / rate.max(1.0);
        }
        moments
    }

    /// How fast time goes at a moment: slowly where the attack is nearest.
    #[must_use]
    pub fn pace(&self, cut: &Cut, t: f32) -> f32 {
        let eased = smooth(((t - self.nearest_at(cut)).abs() - 0.05) / 0.25);
        self.settings.slowest + (1.0 - self.settings.slowest) * eased
    }

    /// The joints of a fighter at a moment, in the world.
    pub fn joints(&self, side: Side, t: f32, out: &mut Vec<JointTransform>) {
        let (graph, mut pose) = (self.baked.graph(), Pose::default());
        self.fighters[side.index()].pose(graph, t, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, out);
    }

    /// From the side, where the limb that strikes is not hidden, so that both are in the picture all through.
    fn camera(&self, exchange: &Exchange, span: (f32, f32), aspect: f32) -> Camera {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let near = exchange.announced + exchange.clearance.time;
        self.joints(exchange.attacker, near, &mut a);
        self.joints(exchange.attacker.other(), near, &mut b);
        let along = b[0].translation - a[0].translation;
        let along = Vec3::new(along.x, 0.0, along.z).normalize_or(Vec3::Z);
        let across = Vec3::new(along.z, 0.0, -along.x);
        let limb = striking(exchange, exchange.clearance.time);
        let side = (limb - a[0].translation).dot(across);
        let across = if side < 0.0 { -across } else { across };
        // A little from behind who strikes: the answer is what one wants to see.
        let out = (across - 0.22 * along).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(out);
        let (low, high) = self.extent(span, right);
        let middle = 0.5 * (a[0].translation + b[0].translation);
        let middle = Vec3::new(middle.x, 0.0, middle.z);
        let aside = 0.5 * (low.x + high.x) - middle.dot(right);
        let target = middle + right * aside + Vec3::Y * (0.5 * high.y + 0.06);
        // With room above for what is written there.
        let half = (0.54 * (high.x - low.x) / aspect).max(0.5 * high.y) + 0.25;
        let field = 30f32.to_radians();
        let orbit = Camera::orbit(
            target,
            (out.x.atan2(out.z), 0.14),
            half / (0.5 * field).tan(),
        );
        Camera { field, ..orbit }
    }

    /// How far to the right and how high both fighters go.
    fn extent(&self, (start, end): (f32, f32), right: Vec3) -> (Vec2, Vec2) {
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let mut joints = Vec::new();
        for step in 0..=24 {
            let t = start + (end - start) * step as f32 / 24.0;
            for side in [Side::White, Side::Blue] {
                self.joints(side, t, &mut joints);
                for joint in &joints {
                    let seen = Vec2::new(joint.translation.dot(right), joint.translation.y);
                    low = low.min(seen - 0.1);
                    high = high.max(seen + 0.1);
                }
            }
        }
        (low, high)
    }

    /// The picture of a moment of a cut.
    #[must_use]
    pub fn shot(&self, cut: &Cut, t: f32) -> Shot {
        let exchange = &self.exchanges[cut.exchange];
        let local = t - exchange.announced;
        let (mut joints, mut middle) = (Vec::new(), Vec3::ZERO);
        let mut shot = Shot::new(cut.camera, Light::default());
        for side in [Side::White, Side::Blue] {
            self.joints(side, t, &mut joints);
            middle += 0.5 * joints[0].translation;
            let figure = &self.figures[side.index()];
            if side == exchange.attacker {
                let heat = heat(exchange, local);
                let figure = self.struck_with(figure, exchange, heat);
                figure.capsules(&joints, 1.0, &mut shot.solids);
            } else {
                figure.capsules(&joints, 1.0, &mut shot.solids);
            }
        }
        shot.light.shadow = (Vec3::new(middle.x, 0.0, middle.z), 3.0);
        add_region(exchange, local, &mut shot);
        shot
    }

    /// The figure with the striking limb in the colour of the attack.
    fn struck_with(&self, figure: &Figure, exchange: &Exchange, heat: f32) -> Figure {
        let graph = self.baked.graph();
        let joints: &[JointId] = match graph.edge(exchange.strike).event {
            Some(event) => &graph.event(event).joints,
            None => &[],
        };
        let skeleton = graph.skeleton();
        let strikes = |joint: JointId| {
            skeleton
                .ancestry(joint)
                .any(|above| joints.contains(&above))
        };
        let mut figure = figure.clone();
        let parts = figure.parts.iter_mut();
        for part in parts.filter(|part| strikes(part.joints[0])) {
            part.colour = part.colour.lerp(STRIKE, heat);
        }
        figure
    }
}

/// How much of the attack's colour its limb has: from a moment before it starts until it ends.
fn heat(exchange: &Exchange, t: f32) -> f32 {
    let (start, end) = (exchange.attack.start(), exchange.attack.end());
    smooth((t - start + 0.2) / 0.2) * (1.0 - smooth((t - end + 0.05) / 0.2))
}

/// Where the attack passes: seen from its announcement on, and gone after it.
fn add_region(exchange: &Exchange, t: f32, shot: &mut Shot) {
    let (start, end) = (exchange.attack.start(), exchange.attack.end());
    let shown = smooth(t / start.clamp(0.05, 0.4)) * (1.0 - smooth((t - end + 0.1) / 0.25));
    if t < 0.0 || shown <= 0.0 {
        return;
    }
    let colour = STRIKE.extend(0.30 * shown).to_array();
    let sphere = |key: &SphereKey| (key.center, key.radius);
    for moving in exchange.attack.spheres() {
        for pair in moving.keys().windows(2) {
            let piece = Capsule::new(sphere(&pair[0]), sphere(&pair[1]), colour);
            shot.ghosts.push(piece);
        }
    }
}

/// About where the limb that strikes is at a moment.
fn striking(exchange: &Exchange, t: f32) -> Vec3 {
    let spheres = exchange.attack.spheres();
    let all: Vec3 = spheres
        .iter()
        .map(|sphere: &MovingSphere| sphere.at(t).center)
        .sum();
    all / spheres.len().max(1) as f32
}

fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
