//! A body that stands and sways, for tests of warps and layers.

use std::sync::OnceLock;

use glam::{Quat, Vec3};
use sabaki_fixtures::clips::{self, at_rest, biped, evasion, joints_of};

use crate::anim::{Clip, JointTransform, Leg, Pose, Skeleton};
use crate::graph::{self, ClipSource, EdgeId, GraphSettings, Motion, Playhead};
use crate::maps::{BakeSettings, BakedGraph, Baker, PathSettings};
use crate::math::Rigid2;

/// A clip in which feet stand, knees are bent, and pelvis, spine and arms sway.
fn clip(skeleton: &Skeleton, seed: f32) -> Clip {
    const FRAMES: usize = 150;
    let legs = Leg::all(skeleton);
    let (mut roots, mut rotations) = (Vec::new(), Vec::new());
    let rest = Pose::at_rest(skeleton, Vec3::new(0.0, 0.87, 0.0));
    let joints = at_rest(skeleton, rest.root);
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
        let sizes = [0.1, 0.15, 0.15, 0.1, 0.6, 0.9, 0.6, 0.9];
        for (joint, size) in [0, 1, 2, 3, 5, 6, 8, 9].into_iter().zip(sizes) {
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
        roots.push(pose.root);
        rotations.extend(pose.rotations);
    }
    clips::clip(skeleton, &format!("sway {seed}"), 30.0, roots, rotations)
}

/// The motion from the start of an edge, for two seconds.
pub(crate) fn motion(baked: &BakedGraph, edge: EdgeId, frame: f32, place: Rigid2) -> Motion {
    let playhead = Playhead::at(baked.graph(), edge, frame, place);
    let mut motion = Motion::new(baked.graph(), playhead, &[]);
    motion.extend(baked.graph(), 2.0);
    motion
}

pub(crate) fn joints(baked: &BakedGraph, motion: &Motion, seconds: f32) -> Vec<JointTransform> {
    let mut pose = Pose::default();
    motion.sample(baked.graph(), seconds, &mut pose);
    joints_of(baked.graph().skeleton(), &pose)
}

pub(crate) fn baked() -> &'static BakedGraph {
    static BAKED: OnceLock<BakedGraph> = OnceLock::new();
    BAKED.get_or_init(|| bake([0.3, 1.1]))
}

pub(in crate::query) fn bake(seeds: [f32; 2]) -> BakedGraph {
    let skeleton = biped();
    let clips = seeds.map(|seed| clip(&skeleton, seed));
    let source = ClipSource {
        skeleton: &skeleton,
        clips: &clips,
        events: &[evasion(0, 1.8, 2.2)],
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
