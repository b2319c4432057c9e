//! Promise: a level of detail keeps the motion of the joints that it keeps, whatever was removed.

use crate::{ExactPlace, exact_places};
use glam::DVec3;
use sabaki_fixtures::captures::each_capture;
use sabaki_fixtures::lod::{order_of, random_case};
use sabaki_fixtures::random::Random;
use sabaki_motion::anim::{Clip, JointId, Pose, Skeleton};
use sabaki_motion::lod::{Level, LevelMotion, Levels, LodError};

/// How far a kept joint is from where the clip has it at most, metres, and its axes' tips.
fn worst_difference(skeleton: &Skeleton, clip: &Clip, level: &Level) -> f64 {
    let motion = LevelMotion::new(skeleton, clip, level).unwrap();
    assert_eq!(motion.frames, clip.frames());
    assert_eq!(motion.tracks.len(), level.kept.len());
    let mut pose = Pose::default();
    let mut worst = 0f64;
    for frame in 0..clip.frames() {
        clip.pose(frame, &mut pose);
        let joints = exact_places(skeleton, &pose);
        let mut level_joints: Vec<ExactPlace> = Vec::new();
        for ((track, parent), id) in motion.tracks.iter().zip(&motion.parents).zip(&level.kept) {
            let local = (
                track.rotations[frame].as_dquat(),
                track.translations.at(frame).as_dvec3(),
            );
            let (turn, place) = match parent {
                None => local,
                Some(parent) => {
                    let (turn, place) = level_joints[usize::from(*parent)];
                    (turn * local.0, place + turn * local.1)
                }
            };
            let (full_turn, full_place) = joints[id.index()];
            worst = worst.max(place.distance(full_place));
            for axis in DVec3::AXES {
                worst = worst.max((turn.normalize() * axis).distance(full_turn * axis));
            }
            level_joints.push((turn, place));
        }
    }
    worst
}

#[test]
fn what_is_kept_keeps_its_motion_on_random_skeletons() {
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let (skeleton, clip) = random_case(&mut random);
        let levels = Levels::in_order(&skeleton, &order_of(&skeleton, &mut random)).unwrap();
        for level in &levels.levels {
            let worst = worst_difference(&skeleton, &clip, level);
            // Chains of up to 12 bones of up to a metre, in single precision.
            assert!(worst < 2e-5, "seed {seed}: {worst} m");
        }
    }
}

#[test]
#[ignore = "needs SABAKI_MOCAP"]
fn what_is_kept_keeps_its_motion_in_captures() {
    for folder in ["fight", "walk"] {
        let clips = each_capture(folder);
        for (skeleton, clip) in clips.iter().take(8) {
            let order = order_of(skeleton, &mut Random::new(7));
            let levels = Levels::in_order(skeleton, &order).unwrap();
            for level in levels.levels.iter().step_by(4) {
                let worst = worst_difference(skeleton, clip, level);
                assert!(worst < 2e-5, "{}: {worst} m", clip.name());
            }
        }
    }
}

#[test]
fn levels_lose_one_joint_after_the_other() {
    let mut random = Random::new(3);
    let (skeleton, _) = random_case(&mut random);
    let order = order_of(&skeleton, &mut random);
    let levels = Levels::in_order(&skeleton, &order).unwrap().levels;
    assert_eq!(levels.len(), order.len() + 1);
    assert_eq!(levels[0].kept.len(), skeleton.len());
    for (index, level) in levels.iter().enumerate() {
        assert_eq!(level.kept.len(), skeleton.len() - index);
        assert_eq!(level.kept[0], JointId::ROOT);
        assert_eq!(level.parents[0], None);
        let removed: Vec<JointId> = order[..index].iter().map(|(id, _)| *id).collect();
        for (at, (&id, parent)) in level.kept.iter().zip(&level.parents).enumerate().skip(1) {
            assert!(!removed.contains(&id));
            let parent = usize::from(parent.unwrap());
            assert!(parent < at, "parents first");
            // Of the joints above it, the first that is not removed.
            let above = skeleton.ancestry(id).skip(1);
            let expected = above.into_iter().find(|id| !removed.contains(id)).unwrap();
            assert_eq!(level.kept[parent], expected);
        }
        let depth = |index: usize| {
            std::iter::successors(level.parents[index], |&at| level.parents[usize::from(at)])
                .count()
        };
        assert!((1..level.kept.len()).all(|at| depth(at - 1) <= depth(at)));
    }
}

#[test]
fn what_cannot_be_removed_is_an_error() {
    let (skeleton, clip) = random_case(&mut Random::new(5));
    let levels = |order: &[u16]| {
        let order: Vec<_> = order.iter().map(|&id| (JointId(id), 0.0)).collect();
        Levels::in_order(&skeleton, &order)
    };
    assert_eq!(levels(&[0]), Err(LodError::NotRemovable(0)));
    assert_eq!(levels(&[1, 1]), Err(LodError::NotRemovable(1)));
    assert_eq!(levels(&[999]), Err(LodError::NotRemovable(999)));
    let (other, _) = random_case(&mut Random::new(6));
    assert_ne!(other.len(), skeleton.len());
    let level = &Levels::in_order(&other, &[]).unwrap().levels[0];
    assert!(matches!(
        LevelMotion::new(&other, &clip, level),
        Err(LodError::Joints { .. })
    ));
    let mut level = Levels::in_order(&skeleton, &[]).unwrap().levels.remove(0);
    level.kept[1] = JointId(4000);
    assert_eq!(
        LevelMotion::new(&skeleton, &clip, &level),
        Err(LodError::Level(4000))
    );
}
