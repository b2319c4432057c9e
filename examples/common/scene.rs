//! What the examples of renderers share: a ball that is thrown, and what is drawn of it: a character of spheres, the ball, and their
//! shadows. Nothing of Vulkan.

use std::{error::Error, fs, io::BufWriter};

use glam::{Quat, Vec3};
use sabaki::anim::{Pose, forward_kinematics};
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::{BakedGraph, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{Answer, Attack, Request};

/// A sphere in camera space: x, y, radius, lowness; red, green, blue, and padding.
pub type Instance = [f32; 8];

pub const MOST_INSTANCES: usize = 256;

/// A character, and a ball that flies at its head.
pub struct Throw {
    pub playhead: Playhead,
    pub attack: Attack,
}

impl Throw {
    pub fn new(baked: &BakedGraph) -> Result<Self, Box<dyn Error>> {
        let key = |t, z| SphereKey {
            t,
            center: Vec3::new(0.0, 1.5, z),
            radius: 0.1,
        };
        Ok(Self {
            playhead: Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY),
            attack: Attack::new(vec![vec![key(0.9, 3.0), key(1.4, -1.0)]])?,
        })
    }

    pub fn request(&self) -> Request<'_> {
        Request::new(self.playhead, &self.attack)
    }
}

/// What is drawn before the ball flies.
pub fn before(baked: &BakedGraph, throw: &Throw) -> Vec<Instance> {
    let mut pose = Pose::default();
    throw.playhead.pose(baked.graph(), &mut pose);
    instances(baked, &pose, ball(&throw.attack, 0.0))
}

/// What is drawn of an answer when the ball is nearest.
pub fn nearest(baked: &BakedGraph, throw: &Throw, answer: &Answer) -> Vec<Instance> {
    let (mut pose, seconds) = (Pose::default(), answer.clearance().time);
    answer.motion.sample(baked.graph(), seconds, &mut pose);
    instances(baked, &pose, ball(&throw.attack, seconds))
}

/// Prints how the candidates were counted, and the answer.
pub fn print(by_device: bool, candidates: usize, answer: &Answer) {
    println!("counted by the device: {by_device}; {candidates} candidates");
    println!(
        "avoided: {}, by {:.3} m",
        answer.avoided,
        answer.clearance().metres
    );
}

/// Where the ball is: before it is thrown, where it will start; nowhere after its flight.
fn ball(attack: &Attack, seconds: f32) -> Option<(Vec3, f32)> {
    let keys = attack.spheres()[0].keys();
    let mut pairs = keys.windows(2);
    let pair = pairs.find(|pair| seconds <= pair[1].t)?;
    let share = (seconds - pair[0].t) / (pair[1].t - pair[0].t);
    let center = pair[0].center.lerp(pair[1].center, share.max(0.0));
    Some((center, pair[0].radius))
}

/// The body's spheres in a pose, and the ball at that moment; what is further away comes first.
fn instances(baked: &BakedGraph, pose: &Pose, ball: Option<(Vec3, f32)>) -> Vec<Instance> {
    let mut joints = Vec::new();
    forward_kinematics(baked.graph().skeleton(), pose, &mut joints);
    let body = baked.body().spheres.iter();
    let mut spheres: Vec<_> = body
        .map(|one| (one.centre(&joints), one.radius, [0.35, 0.55, 0.85]))
        .collect();
    spheres.extend(ball.map(|(center, radius)| (center, radius, [0.9, 0.3, 0.15])));
    let camera = Quat::from_rotation_x(0.25) * Quat::from_rotation_y(-0.7);
    let seen = |center: Vec3| camera * (center - Vec3::new(0.0, 0.9, 0.0));
    spheres.sort_by(|a, b| seen(a.0).z.total_cmp(&seen(b.0).z));
    let instance = |center, radius, [red, green, blue]: [f32; 3], lowness| {
        let Vec3 { x, y, .. } = seen(center);
        [x, y, radius, lowness, red, green, blue, 0.0]
    };
    let shadows = spheres
        .iter()
        .map(|one| instance(one.0.with_y(0.0), one.1, [0.25; 3], 0.25));
    let bodies = spheres.iter().map(|one| instance(one.0, one.1, one.2, 1.0));
    shadows.chain(bodies).take(MOST_INSTANCES).collect()
}

/// Writes a picture of four bytes a pixel.
pub fn write_png(path: &str, side: u32, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all("out")?;
    let file = BufWriter::new(fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}
