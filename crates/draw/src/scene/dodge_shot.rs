//! The pictures of a dodge: the camera, the fighter, the attack with its trail, and the ghost.

use glam::{Vec2, Vec3};

use super::dodge::{Dodge, GHOST};
use super::{Camera, Capsule, Light, Orbit, Shot};
use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::maps::MovingSphere;
use sabaki::math::{Sphere, smooth_step};

/// Duration of the trail behind a ball, in seconds.
const TRAIL: f32 = 0.22;
const TRAIL_PIECES: usize = 14;
const BALL: Vec3 = Vec3::new(0.93, 0.16, 0.05);

/// Angle of the camera above the horizon, in radians.
const UP: f32 = 0.16;
/// Time before and after the attack is nearest that should be visible, in seconds.
const AROUND: f32 = 0.13;

impl Dodge<'_> {
    /// The attack's sphere that is nearest to the body when the attack is nearest. It is extrapolated after its end.
    #[must_use]
    pub fn ball(&self, t: f32) -> Sphere {
        let none = Sphere::new(Vec3::ZERO, 0.0);
        self.nearest_sphere()
            .map_or(none, |sphere| flying(sphere, t))
    }

    /// Camera beside the attack's path, slightly above it, that shows the whole dodge and the
    /// attack.
    #[must_use]
    pub fn camera(&self, aspect: f32) -> Camera {
        let mut joints = Vec::new();
        self.joints(self.clearance.time, &mut joints);
        let out = self.side(&joints);
        let right = Vec3::Y.cross(out);
        let balls = self.balls();
        let (low, high) = self.extent(right, &balls);
        let middle = Vec3::new(joints[0].translation.x, 0.0, joints[0].translation.z);
        let aside = 0.5 * (low.x + high.x) - middle.dot(right);
        let target = middle + right * aside + Vec3::Y * (0.5 * high.y - 0.03);
        // Objects in front of the centre appear larger.
        let half = (0.55 * (high.x - low.x) / aspect).max(0.5 * high.y) + 0.16;
        let field = 30f32.to_radians();
        let camera = Camera {
            field,
            ..Camera::orbit(Orbit {
                target,
                around: out.x.atan2(out.z),
                up: UP,
                distance: half / (0.5 * field).tan(),
            })
        };
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
            let moments = [near - 2.0 * AROUND, near - AROUND, near + AROUND];
            balls.extend(moments.map(|t| flying(sphere, t.clamp(start, end))));
        }
        balls
    }

    /// Horizontal and vertical extent of everything that should be visible.
    fn extent(&self, right: Vec3, balls: &[Sphere]) -> (Vec2, Vec2) {
        let [start, end] = self.span();
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
        balls.iter().for_each(|ball| add(ball.centre, ball.radius));
        (low, high)
    }

    /// Shot of a time.
    #[must_use]
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
