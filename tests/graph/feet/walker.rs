//! A synthetic walking motion with known foot plants.

use glam::{Quat, Vec3};
use sabaki::anim::{Clip, Joint, Skeleton};
use sabaki::graph::{self, GraphSettings, MotionGraph};

use sabaki_fixtures::clips;
use sabaki_fixtures::random::Random;

const THIGH: f32 = 0.43;
const SHIN: f32 = 0.42;
const PELVIS: f32 = 0.82;
const ANKLE: f32 = 0.08;
/// Metres a second, frames of a cycle, share of it that a foot stands, metres that it is lifted.
const SPEED: f32 = 0.8;
const CYCLE: usize = 34;
const STANCE: f32 = 0.62;
const LIFT: f32 = 0.12;
const FRAMES: usize = 250;

pub struct Walk {
    pub skeleton: Skeleton,
    pub clip: Clip,
    /// First and last frame of each plant, left and right.
    pub plants: [Vec<[u32; 2]>; 2],
}

fn skeleton() -> Skeleton {
    let foot = Vec3::new(0.0, -0.06, 0.15);
    let leg = [Vec3::NEG_Y * THIGH, Vec3::NEG_Y * SHIN];
    clips::skeleton(&[
        ("Hips", None, Vec3::ZERO),
        ("LeftUpLeg", Some(0), Vec3::X * 0.1),
        ("LeftLeg", Some(1), leg[0]),
        ("LeftFoot", Some(2), leg[1]),
        ("LeftFoot_End", Some(3), foot),
        ("RightUpLeg", Some(0), Vec3::X * -0.1),
        ("RightLeg", Some(5), leg[0]),
        ("RightFoot", Some(6), leg[1]),
        ("RightFoot_End", Some(7), foot),
    ])
}

/// The ankle's height and way at a frame, and whether it stands there.
fn ankle(frame: usize, side: usize) -> (f32, f32, bool) {
    // The right foot is half a cycle behind.
    let shifted = frame + side * CYCLE / 2;
    let (cycle, within) = (shifted / CYCLE, shifted % CYCLE);
    let phase = within as f32 / CYCLE as f32;
    let stride = SPEED * CYCLE as f32 / 30.0;
    let begin = stride * (cycle as f32 - 0.5 * side as f32) + 0.5 * STANCE * stride;
    if phase <= STANCE {
        return (ANKLE, begin, true);
    }
    let s = (phase - STANCE) / (1.0 - STANCE);
    let height = ANKLE + LIFT * (std::f32::consts::PI * s).sin();
    (height, begin + stride * s * s * (3.0 - 2.0 * s), false)
}

/// A walk along +Z for eight seconds, the whole body trembling by `noise` metres.
pub fn walk(noise: f32) -> Walk {
    let (mut roots, mut rotations) = (Vec::new(), Vec::new());
    let mut plants = [Vec::<[u32; 2]>::new(), Vec::new()];
    let mut random = Random::new(7);
    let mut tremble = || noise * (random.below(2001) as f32 / 1000.0 - 1.0);
    for frame in 0..FRAMES {
        let root = Vec3::new(0.0, PELVIS, SPEED * frame as f32 / 30.0);
        rotations.push(Quat::IDENTITY);
        for (side, plants) in plants.iter_mut().enumerate() {
            let (height, way, stands) = ankle(frame, side);
            rotations.extend(leg(height - root.y, way - root.z));
            if stands {
                match plants.last_mut() {
                    Some(plant) if plant[1] + 1 == frame as u32 => plant[1] += 1,
                    _ => plants.push([frame as u32; 2]),
                }
            }
        }
        roots.push(root + Vec3::new(tremble(), tremble(), tremble()));
    }
    let skeleton = skeleton();
    let clip = clips::clip(&skeleton, "walk", 30.0, roots, rotations);
    Walk {
        skeleton,
        clip,
        plants,
    }
}

/// Rotations of hip, knee, foot and tip for an ankle at that height and way from the hip, flat.
fn leg(height: f32, way: f32) -> [Quat; 4] {
    let far = height.hypot(way);
    let towards = (-way).atan2(-height);
    let opened = ((THIGH * THIGH + far * far - SHIN * SHIN) / (2.0 * THIGH * far)).acos();
    let hip = towards - opened;
    let knee = [-THIGH * hip.cos(), -THIGH * hip.sin()];
    let shin = (-(way - knee[1])).atan2(-(height - knee[0]));
    [hip, shin - hip, -shin, 0.0].map(Quat::from_rotation_x)
}

/// The same walk by somebody `scale` times as tall, somewhere else.
pub fn changed(walk: &Walk, scale: f32, place: impl Fn(Vec3) -> Vec3) -> Walk {
    let joints = walk.skeleton.joints().iter().map(|joint| Joint {
        offset: joint.offset * scale,
        ..joint.clone()
    });
    let skeleton = Skeleton::new(joints.collect()).unwrap();
    let desc = walk.clip.desc();
    let roots = desc.roots.iter().map(|&root| place(root * scale)).collect();
    let clip = clips::clip(&skeleton, "walk", 30.0, roots, desc.rotations);
    Walk {
        skeleton,
        clip,
        plants: walk.plants.clone(),
    }
}

impl Walk {
    pub fn graph(&self) -> MotionGraph {
        let settings = GraphSettings {
            // Bodies of different sizes are compared, and the error of compressed clips does not grow with the body.
            compression: None,
            ..GraphSettings::default()
        };
        graph(&self.skeleton, &self.clip, &settings)
    }
}

/// Of a clip and the same again.
pub fn graph(skeleton: &Skeleton, clip: &Clip, settings: &GraphSettings) -> MotionGraph {
    let mut again = clip.desc().clone();
    again.name = "again".to_owned();
    let clips = [clip.clone(), Clip::new(skeleton, again).unwrap()];
    let built = graph::build(clips::source(skeleton, &clips, &[]), settings);
    built.unwrap().0
}
