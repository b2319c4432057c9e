//! Random skeletons and motions for levels of detail.

use std::path::PathBuf;

use glam::{DVec3, Quat, Vec3};
use sabaki::anim::{
    Clip, ClipDesc, Joint, JointId, JointKind, JointTransform, Pose, Skeleton, forward_kinematics,
};
use sabaki::lod::{LevelSettings, Levels, LodError, Measure, Order, Rule, SwitchSettings};
use sabaki_import::{ReadOptions, read_clip};

use super::random::Random;

/// The joints of a clip, frame by frame.
pub fn frames_of(skeleton: &Skeleton, clip: &Clip) -> Vec<Vec<JointTransform>> {
    let (mut pose, mut joints) = (Pose::default(), Vec::new());
    (0..clip.frames())
        .map(|frame| {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, &mut joints);
            joints.clone()
        })
        .collect()
}

/// In [-1, 1).
fn signed(random: &mut Random) -> f32 {
    random.below(1 << 20) as f32 / (1 << 19) as f32 - 1.0
}

fn vector(random: &mut Random) -> Vec3 {
    Vec3::new(signed(random), signed(random), signed(random))
}

/// A tree of 1 to 30 joints, chains of at most 12, some bones of no length, some end sites; a clip of 1 to
/// 40 frames in which all turn, and of which some move their joints.
pub fn random_case(random: &mut Random) -> (Skeleton, Clip) {
    let count = 1 + random.below(30);
    let mut parents: Vec<Option<usize>> = vec![None];
    let mut depth = vec![0];
    for index in 1..count {
        let near = index - 1 - random.below(index.min(4));
        let parent = if depth[near] < 11 { near } else { 0 };
        parents.push(Some(parent));
        depth.push(depth[parent] + 1);
    }
    let is_leaf = |index: usize| !parents.contains(&Some(index));
    let joints = (0..count).map(|index| Joint {
        name: format!("j{index}"),
        parent: parents[index].map(|parent| JointId(parent as u16)),
        offset: match random.below(12) {
            0 => Vec3::ZERO,
            _ => vector(random) * 0.5,
        },
        kind: if index > 0 && is_leaf(index) && random.below(2) == 0 {
            JointKind::EndSite
        } else {
            JointKind::Moving
        },
    });
    let skeleton = Skeleton::new(joints.collect()).unwrap();
    let clip = random_clip(&skeleton, random);
    (skeleton, clip)
}

fn random_clip(skeleton: &Skeleton, random: &mut Random) -> Clip {
    let frames = 1 + random.below(40);
    let axes: Vec<(Vec3, f32, f32)> = skeleton
        .joints()
        .iter()
        .map(|_| {
            let axis = vector(random).try_normalize().unwrap_or(Vec3::X);
            (axis, 1.5 * signed(random), 3.0 * signed(random))
        })
        .collect();
    let moves_joints = random.below(3) == 0;
    let mut desc = ClipDesc {
        name: "random".into(),
        frame_rate: 30.0,
        roots: Vec::new(),
        rotations: Vec::new(),
        translations: Vec::new(),
    };
    for frame in 0..frames {
        let t = frame as f32 * 0.2;
        desc.roots.push(Vec3::new(t, 1.0 + (2.0 * t).sin(), -t));
        for (joint, &(axis, size, phase)) in skeleton.joints().iter().zip(&axes) {
            let angle = phase + size * (t + phase).sin();
            desc.rotations.push(match joint.kind {
                JointKind::EndSite => Quat::IDENTITY,
                JointKind::Moving => Quat::from_axis_angle(axis, angle),
            });
            if moves_joints {
                desc.translations
                    .push(joint.offset + 0.05 * axis * angle.sin());
            }
        }
    }
    Clip::new(skeleton, desc).unwrap()
}

/// All joints but the root and the leaves, in a random order.
pub fn order_of(skeleton: &Skeleton, random: &mut Random) -> Vec<(JointId, f32)> {
    let mut joints: Vec<JointId> = skeleton
        .ids()
        .skip(1)
        .filter(|&id| skeleton.children(id).next().is_some())
        .collect();
    for index in (1..joints.len()).rev() {
        joints.swap(index, random.below(index + 1));
    }
    joints.into_iter().map(|id| (id, 1.0)).collect()
}

/// Each BVH file of a folder of the captures, with its own skeleton.
pub fn each_capture(folder: &str) -> Option<Vec<(Skeleton, Clip)>> {
    let root = std::env::var_os("SABAKI_MOCAP")?;
    let mut files: Vec<PathBuf> = std::fs::read_dir(PathBuf::from(root).join(folder))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "bvh"))
        .collect();
    files.sort();
    let read = |path: &PathBuf| {
        let loaded = read_clip(path, &ReadOptions::default()).unwrap();
        (loaded.skeleton, loaded.clip)
    };
    Some(files.iter().map(read).collect())
}

/// The points of each joint in its own frame: itself, and of each bone the far end (in the mean) and the corners of the box
/// around all within `skin` of it.
pub fn points_of(skeleton: &Skeleton, frames: &[Vec<JointTransform>], skin: f32) -> Vec<Vec<Vec3>> {
    let points = |joint: JointId| {
        let mut points = vec![Vec3::ZERO];
        let mut add_box = |end: DVec3, along: DVec3| {
            let (u, v) = along.any_orthonormal_pair();
            for (start, way) in [(DVec3::ZERO, -along), (end, along)] {
                for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                    points.push((start + f64::from(skin) * (way + x * u + y * v)).as_vec3());
                }
            }
        };
        let mut ends = Vec::new();
        for child in skeleton.children(joint) {
            let seen = |joints: &Vec<JointTransform>| {
                let at = joints[child.index()].translation - joints[joint.index()].translation;
                (joints[joint.index()].rotation.inverse() * at).as_dvec3()
            };
            let end = frames.iter().map(seen).sum::<DVec3>() / frames.len() as f64;
            let end = (end * 1e6).round() * 1e-6 + DVec3::ZERO;
            if end.length() > 1e-4 {
                add_box(end, end.normalize());
                ends.push(end.as_vec3());
            }
        }
        if ends.is_empty() {
            add_box(DVec3::ZERO, DVec3::X);
        }
        points.extend(ends);
        points
    };
    skeleton.ids().map(points).collect()
}

pub fn build(skeleton: &Skeleton, clips: &[Clip], order: Order) -> Levels {
    let settings = LevelSettings {
        order,
        ..LevelSettings::default()
    };
    Levels::build(skeleton, clips, &settings).unwrap()
}

pub fn random_levels(seed: u64) -> (Skeleton, Clip, Levels) {
    let (skeleton, clip) = random_case(&mut Random::new(seed));
    let order = [Order::Energy, Order::Error][seed as usize % 2];
    let levels = build(&skeleton, std::slice::from_ref(&clip), order);
    (skeleton, clip, levels)
}

pub fn screen_error(pixels: f32) -> Rule {
    Rule::ScreenError {
        pixels,
        measure: Measure::Greatest,
    }
}

/// Energy to 60 m and errors of 1 pixel, with blending.
pub fn rules() -> [SwitchSettings; 2] {
    [Rule::Energy { furthest: 60.0 }, screen_error(1.0)].map(|rule| SwitchSettings {
        rule,
        ..SwitchSettings::default()
    })
}

pub fn setting_of(error: LodError) -> &'static str {
    match error {
        LodError::Setting { setting, .. } => setting,
        other => panic!("{other}"),
    }
}
