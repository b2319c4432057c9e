//! Promise: a mesh that is bound to the full skeleton is drawn at any level, no further from where it should be than
//! the level says.

use glam::{Affine3A, Vec3};
use sabaki_fixtures::captures::captures;
use sabaki_fixtures::clips::{at_rest, frames_of};
use sabaki_fixtures::lod::{build, points_of, random_case};
use sabaki_fixtures::random::Random;
use sabaki_motion::anim::{Clip, JointId, JointKind, JointTransform, Skeleton};
use sabaki_motion::lod::{LevelMotion, Levels, LodError, Order, affine};

/// A vertex in bind space, bound to two joints.
struct Vertex {
    place: Vec3,
    joints: [(JointId, f32); 2],
}

/// The points that a level's error is measured at, each bound to its joint; a joint itself hangs on its parent as well.
fn mesh_of(skeleton: &Skeleton, clip: &Clip, skin: f32) -> Vec<Vertex> {
    let joints = at_rest(skeleton, Vec3::ZERO);
    let points = points_of(skeleton, &frames_of(skeleton, clip), skin);
    let mut mesh = Vec::new();
    for id in skeleton.ids() {
        for &point in &points[id.index()] {
            mesh.push(Vertex {
                place: joints[id.index()].point(point),
                joints: [(id, 1.0), (id, 0.0)],
            });
        }
        if let Some(parent) = skeleton.joint(id).parent {
            mesh.push(Vertex {
                place: joints[id.index()].translation,
                joints: [(parent, 0.5), (id, 0.5)],
            });
        }
    }
    mesh
}

fn skinned(vertex: &Vertex, palette: &[Affine3A]) -> Vec3 {
    let on = |(joint, weight): (JointId, f32)| {
        palette[joint.index()].transform_point3(vertex.place) * weight
    };
    vertex.joints.into_iter().map(on).sum()
}

/// The matrices of a level's joints from its own motion.
fn posed(motion: &sabaki_motion::lod::LevelMotion, frame: usize) -> Vec<Affine3A> {
    let mut matrices: Vec<Affine3A> = Vec::new();
    for (track, parent) in motion.tracks.iter().zip(&motion.parents) {
        let local = affine(&JointTransform {
            rotation: track.rotations[frame],
            translation: track.translations.at(frame),
        });
        matrices.push(match parent {
            Some(parent) => matrices[usize::from(*parent)] * local,
            None => local,
        });
    }
    matrices
}

fn inverse_binds(skeleton: &Skeleton) -> Vec<Affine3A> {
    let joints = at_rest(skeleton, Vec3::ZERO);
    joints.iter().map(|joint| affine(joint).inverse()).collect()
}

/// Draws a mesh at every level and holds it to the level's error.
fn check(skeleton: &Skeleton, clip: &Clip, order: Order) {
    let levels = build(skeleton, std::slice::from_ref(clip), order);
    let mesh = mesh_of(skeleton, clip, levels.skin);
    let inverse_binds = inverse_binds(skeleton);
    let full = LevelMotion::new(skeleton, clip, &levels.levels[0]).unwrap();
    let mut in_full = Vec::new();
    let binds = levels.levels[0].binds(&inverse_binds).unwrap();
    let frames: Vec<usize> = (0..clip.frames()).step_by(1 + clip.frames() / 20).collect();
    let truths: Vec<Vec<Vec3>> = frames
        .iter()
        .map(|&frame| {
            levels.levels[0].palette(&posed(&full, frame), &binds, &mut in_full);
            mesh.iter()
                .map(|vertex| skinned(vertex, &in_full))
                .collect()
        })
        .collect();
    let mut palette = Vec::new();
    for level in &levels.levels {
        let motion = LevelMotion::new(skeleton, clip, level).unwrap();
        let binds = level.binds(&inverse_binds).unwrap();
        for (&frame, truth) in frames.iter().zip(&truths) {
            let matrices = posed(&motion, frame);
            level.palette(&matrices, &binds, &mut palette);
            for (vertex, truth) in mesh.iter().zip(truth) {
                let missed = skinned(vertex, &palette).distance(*truth);
                assert!(
                    missed <= level.error.max + 2e-5,
                    "{missed} m for {:?} in {}",
                    level.error,
                    clip.name()
                );
            }
        }
    }
}

#[test]
fn meshes_on_random_skeletons() {
    for seed in 0..30 {
        let (skeleton, clip) = random_case(&mut Random::new(8000 + seed));
        // Meshes are made around the skeleton's bones: a clip that stretches them has others.
        if clip.desc().translations.is_empty() {
            check(
                &skeleton,
                &clip,
                [Order::Energy, Order::Error][seed as usize % 2],
            );
        }
    }
}

#[test]
fn meshes_in_the_embedded_motions() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    for clip in motions.clips.iter().step_by(5) {
        check(&motions.skeleton, clip, Order::Energy);
        check(&motions.skeleton, clip, Order::Error);
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn meshes_in_captures() {
    let set = captures("fight");
    for clip in set.clips.iter().step_by(9) {
        check(&set.skeleton, clip, Order::Energy);
    }
}

#[test]
fn a_mesh_of_one_joint_and_binds_that_do_not_fit() {
    let (skeleton, clip) = random_case(&mut Random::new(5));
    let levels = Levels::in_order(&skeleton, &[]).unwrap();
    let found = levels.levels[0].binds(&[Affine3A::IDENTITY]);
    assert_eq!(
        found,
        Err(LodError::Binds {
            found: 1,
            expected: skeleton.len()
        })
    );
    assert!(skeleton.joints()[0].kind == JointKind::Moving && clip.frames() > 0);

    // Everything on the root: in the rest pose nothing is displaced.
    let order: Vec<_> = skeleton.ids().skip(1).map(|id| (id, 0.0)).collect();
    let levels = Levels::in_order(&skeleton, &order).unwrap();
    let root = levels.levels.last().unwrap();
    assert_eq!(root.kept, [JointId::ROOT]);
    let inverse_binds = inverse_binds(&skeleton);
    let mut palette = Vec::new();
    let binds = root.binds(&inverse_binds).unwrap();
    root.palette(&[Affine3A::IDENTITY], &binds, &mut palette);
    for vertex in mesh_of(&skeleton, &clip, 0.05) {
        assert!(skinned(&vertex, &palette).distance(vertex.place) < 1e-5);
    }
}
