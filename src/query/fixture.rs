//! A body that stands and sways, for tests of warps and layers.

use std::sync::OnceLock;

use glam::{Quat, Vec3};
use sabaki_fixtures::clips::biped;

use crate::anim::{
    Clip, ClipDesc, Event, EventKind, JointTransform, Leg, Pose, Skeleton, forward_kinematics,
};
use crate::graph::{self, ClipSource, GraphSettings};
use crate::maps::{BakeSettings, BakedGraph, Baker, PathSettings};

/// A clip in which feet stand, knees are bent, and pelvis, spine and arms sway.
fn clip(skeleton: &Skeleton, seed: f32) -> Clip {
    const FRAMES: usize = 150;
    let legs = Leg::all(skeleton);
    let mut desc = ClipDesc {
        name: format!("sway {seed}"),
        frame_rate: 30.0,
        roots: Vec::new(),
        rotations: Vec::new(),
        translations: Vec::new(),
    };
    let rest = Pose {
        root: Vec3::new(0.0, 0.87, 0.0),
        rotations: vec![Quat::IDENTITY; skeleton.len()],
        translations: Vec::new(),
    };
    let mut joints = Vec::new();
    forward_kinematics(skeleton, &rest, &mut joints);
    let feet = [0, 1].map(|side| JointTransform {
        translation: joints[legs[side].foot.index()].translation
            + Vec3::new(0.0, 0.0, 0.15 * (1.0 - 2.0 * side as f32)),
        ..joints[legs[side].foot.index()]
    });
    for frame in 0..FRAMES {
        let t = frame as f32 / 30.0;
        let sway = |rate: f32, phase: f32| (t * rate + seed * phase).sin();
        let mut pose = rest.clone();
        pose.root += Vec3::new(
            0.05 * sway(1.1, 1.0),
            -0.12 + 0.03 * sway(1.7, 2.0),
            0.04 * sway(0.9, 3.0),
        );
        for (joint, size) in [
            (0, 0.1),
            (1, 0.15),
            (2, 0.15),
            (3, 0.1),
            (5, 0.6),
            (6, 0.9),
            (8, 0.6),
            (9, 0.9),
        ] {
            let axis = Vec3::new(sway(1.3, joint as f32), sway(0.8, 5.0), sway(1.1, 7.0));
            pose.rotations[joint] = Quat::from_scaled_axis(size * axis);
        }
        // So that legs know which way their knees bend.
        for leg in &legs {
            pose.rotations[leg.hip.index()] = Quat::from_rotation_x(-0.5);
            pose.rotations[leg.knee.index()] = Quat::from_rotation_x(1.0);
        }
        for (leg, foot) in legs.iter().zip(feet) {
            leg.reach(skeleton, &mut pose, foot);
        }
        desc.roots.push(pose.root);
        desc.rotations.extend(pose.rotations);
    }
    Clip::new(skeleton, desc).unwrap()
}

pub(crate) fn baked() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| bake([0.3, 1.1]))
}

/// A graph of two clips.
pub(in crate::query) fn bake(seeds: [f32; 2]) -> BakedGraph {
    let skeleton = biped();
    let clips = seeds.map(|seed| clip(&skeleton, seed));
    let events = [Event {
        clip: 0,
        kind: EventKind::Evasion,
        start: 1.8,
        end: 2.2,
        joints: Vec::new(),
    }];
    let source = ClipSource {
        skeleton: &skeleton,
        clips: &clips,
        events: &events,
    };
    let settings = GraphSettings {
        threshold: 3.0,
        separation: 0.1,
        ..GraphSettings::default()
    };
    let graph = graph::build(source, &settings).unwrap().0;
    let settings = BakeSettings {
        paths: PathSettings {
            most: 20,
            ..PathSettings::default()
        },
        ..BakeSettings::default()
    };
    let baked = Baker::new(graph, settings).unwrap();
    baked.finish_on_cpu().unwrap()
}
