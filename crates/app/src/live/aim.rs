//! Turns a click into a thrown ball, as in the paper's test program.
//!
//! Source: Masaoka & Oshita, section 5: the user clicks, and a ball flies there.

use glam::Vec3;

use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::query::{Attack, AttackError};
use sabaki_draw::scene::Camera;

/// Settings of the balls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallSettings {
    /// Time from the click to the throw, in seconds. Default: 0.9.
    pub lead: f32,
    /// Speed, in metres per second. Default: 9.
    pub speed: f32,
    /// Radius, in metres. Default: 0.09.
    pub radius: f32,
    /// Largest distance from the thrower to the target, in metres. Default: 3.2.
    pub distance: f32,
    /// Aims a ball at the place where the clicked part of the body will be on arrival if the character does not dodge.
    /// Default: true.
    pub ahead: bool,
}

impl Default for BallSettings {
    fn default() -> Self {
        Self {
            lead: 0.9,
            speed: 9.0,
            radius: 0.09,
            distance: 3.2,
            ahead: true,
        }
    }
}

/// A thrown ball.
#[derive(Clone, Debug, PartialEq)]
pub struct Ball {
    /// Attack of the ball; its time starts at the click.
    pub attack: Attack,
    /// Start of the flight in the world, in metres.
    pub from: Vec3,
    /// Target in the world, in metres.
    pub target: Vec3,
    /// Time of arrival at the target, in seconds.
    pub arrives: f32,
    /// The click was on the body.
    pub at_body: bool,
}

/// Distance that it flies on behind its target, in metres.
const BEYOND: f32 = 1.6;
/// Offset of the throwing hand from the eye, to the right and down, in metres.
const HAND: (f32, f32) = (0.75, 0.35);

/// A click in the direction `ray` of a camera, and the character that it is aimed at.
pub(super) struct Click<'a> {
    pub(super) baked: &'a BakedGraph,
    pub(super) playhead: Playhead,
    pub(super) camera: &'a Camera,
    pub(super) ray: Vec3,
}

impl Click<'_> {
    /// The target of the ray from the eye, in the world: on a sphere of the body the point of the ray nearest to its centre, else
    /// on the plane through the body's root that faces the eye.
    fn picked(&self, joints: &[JointTransform]) -> (Option<usize>, Vec3) {
        let &Self { baked, ray, .. } = self;
        let eye = self.camera.eye;
        let mut centres = Vec::new();
        baked.body().centres(joints, &mut centres);
        let spheres = centres.iter().zip(&baked.body().spheres).enumerate();
        let met = spheres.filter_map(|(index, (centre, sphere))| {
            let along = (*centre - eye).dot(ray);
            let nearest = eye + along * ray;
            let within = along > 0.0 && nearest.distance(*centre) <= sphere.radius;
            within.then_some((along, index, nearest))
        });
        if let Some((_, index, place)) = met.min_by(|a, b| a.0.total_cmp(&b.0)) {
            return (Some(index), place);
        }
        let root = joints[0].translation;
        let across = Vec3::new(root.x - eye.x, 0.0, root.z - eye.z).normalize_or(Vec3::Z);
        let slope = ray.dot(across);
        let along = match slope > 0.05 {
            true => (root - eye).dot(across) / slope,
            // The ray is almost parallel to the plane: the point at the root's distance.
            false => root.distance(eye),
        };
        (None, eye + along * ray)
    }

    /// The ball that the click throws.
    ///
    /// # Errors
    /// Settings that make no attack: a radius or a speed that is not above 0, a lead below 0.
    pub(super) fn ball(&self, settings: &BallSettings) -> Result<Ball, AttackError> {
        let &Self {
            baked,
            playhead,
            ray,
            ..
        } = self;
        let joints = |motion: &Motion, t: f32| {
            let (mut pose, mut joints) = (Pose::default(), Vec::new());
            motion.sample(baked.graph(), t, &mut pose);
            forward_kinematics(baked.graph().skeleton(), &pose, &mut joints);
            joints
        };
        let mut idle = Motion::new(baked.graph(), playhead, &[]);
        let now = joints(&idle, 0.0);
        let (sphere, mut target) = self.picked(&now);
        target.y = target.y.max(settings.radius);
        let from = self.hand(target, settings);
        let arrives = settings.lead + from.distance(target) / settings.speed;
        if let Some(sphere) = sphere.map(|index| baked.body().spheres[index])
            && settings.ahead
            && arrives.is_finite()
        {
            idle.extend(baked.graph(), arrives.min(Attack::LATEST));
            let then = joints(&idle, arrives);
            let joint = sphere.joint.index();
            target += then[joint].point(sphere.offset) - now[joint].point(sphere.offset);
            target.y = target.y.max(settings.radius);
        }
        let flight = (target - from).normalize_or(ray);
        // The ball starts above the floor.
        let beyond = match flight.y < -1e-3 {
            true => BEYOND.min(((target.y - settings.radius) / -flight.y).max(0.05)),
            false => BEYOND,
        };
        let reach = from.distance(target);
        let key = |metres: f32| SphereKey {
            t: settings.lead + metres / settings.speed,
            center: from + flight * metres,
            radius: settings.radius,
        };
        Ok(Ball {
            attack: Attack::new(vec![vec![key(0.0), key(reach + beyond)]])?,
            from,
            target,
            arrives: settings.lead + reach / settings.speed,
            at_body: sphere.is_some(),
        })
    }

    /// Start of the flight: beside the eye, or nearer to the target if the eye is far away.
    fn hand(&self, target: Vec3, settings: &BallSettings) -> Vec3 {
        let right = self.ray.cross(Vec3::Y).normalize_or(Vec3::X);
        let beside = self.camera.eye + right * HAND.0 - Vec3::Y * HAND.1;
        let away = beside - target;
        let from = target + away.clamp_length_max(settings.distance.max(0.5));
        Vec3::new(from.x, from.y.max(settings.radius), from.z)
    }
}
