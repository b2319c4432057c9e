//! From a click to a ball: the paper's own test program.
//!
//! Source: Masaoka & Oshita, section 5: the user clicks, and a ball flies there.

use glam::Vec3;

use sabaki::anim::{JointTransform, Pose, forward_kinematics};
use sabaki::graph::{Motion, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::query::{Attack, AttackError};
use sabaki_draw::scene::Camera;

/// What balls are thrown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallSettings {
    /// Seconds from the click to the throw. Default 0.9.
    pub lead: f32,
    /// Metres per second. Default 9.
    pub speed: f32,
    /// Metres. Default 0.09.
    pub radius: f32,
    /// From where it is thrown to where it is aimed, at most, metres. Default 3.2.
    pub distance: f32,
    /// Whether a ball at the body is aimed at where that part of it will be when the ball arrives, if nothing is done.
    /// Default yes.
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

/// A ball on its way.
#[derive(Clone, Debug, PartialEq)]
pub struct Ball {
    /// Its clock starts at the click.
    pub attack: Attack,
    /// Where it is thrown from, in the world, metres.
    pub from: Vec3,
    /// What it is aimed at.
    pub target: Vec3,
    /// When it is there, seconds.
    pub arrives: f32,
    /// Whether the click was on the body.
    pub at_body: bool,
}

/// It flies on behind its target for so long, metres.
const BEYOND: f32 = 1.6;
/// Its hand is beside the eye: so far to the right and below, metres.
const HAND: (f32, f32) = (0.75, 0.35);

/// What a ray from the eye meets: a sphere of the body (with the place on the axis of the ray that is nearest to its middle), or the
/// plane through the body's root that faces the eye. In the world.
fn picked(
    baked: &BakedGraph,
    joints: &[JointTransform],
    (eye, ray): (Vec3, Vec3),
) -> (Option<usize>, Vec3) {
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
        // Almost along the plane, as from straight above: as far away as the root is.
        false => root.distance(eye),
    };
    (None, eye + along * ray)
}

/// The ball that is thrown by a click at what a camera sees in the direction `ray`.
///
/// # Errors
/// Settings that make no attack: a radius or a speed that is not above 0, a lead below 0.
pub fn aim(
    (baked, playhead): (&BakedGraph, Playhead),
    (camera, ray): (&Camera, Vec3),
    settings: &BallSettings,
) -> Result<Ball, AttackError> {
    let joints = |motion: &Motion, t: f32| {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        motion.sample(baked.graph(), t, &mut pose);
        forward_kinematics(baked.graph().skeleton(), &pose, &mut joints);
        joints
    };
    let mut idle = Motion::new(baked.graph(), playhead, &[]);
    let now = joints(&idle, 0.0);
    let (sphere, mut target) = picked(baked, &now, (camera.eye, ray));
    target.y = target.y.max(settings.radius);
    let from = hand(camera, (ray, target), settings);
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
    // Not through the floor.
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

/// Where the ball is thrown from: beside the eye, or nearer where that is far away.
fn hand(camera: &Camera, (ray, target): (Vec3, Vec3), settings: &BallSettings) -> Vec3 {
    let right = ray.cross(Vec3::Y).normalize_or(Vec3::X);
    let beside = camera.eye + right * HAND.0 - Vec3::Y * HAND.1;
    let away = beside - target;
    let from = target + away.clamp_length_max(settings.distance.max(0.5));
    Vec3::new(from.x, from.y.max(settings.radius), from.z)
}
