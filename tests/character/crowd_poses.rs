//! Promise: in the buffer of all poses each character is where it is, on its level of detail, whoever poses it; nothing depends on
//! threads, and a place that is used again shows its new character.

use std::sync::OnceLock;

use glam::{Affine3A, DVec3, Quat, Vec3};
use sabaki::anim::{JointId, Pose};
use sabaki::character::{
    CharacterError, CharacterId, CharacterSettings, Characters, CrowdPoseSettings, KindId,
};
use sabaki::crowd::{CrowdSettings, Layout, Output};
use sabaki::lod::{Choice, LevelId, LevelSettings, Levels, Rule, SwitchSettings, Switching};
use sabaki::math::{F32x16, Rigid2};
use sabaki_fixtures::clips::joints_of;
use sabaki_fixtures::crowd::{joint_of, outputs};
use sabaki_fixtures::lod::drawn;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;

use super::world::{baked, characters, play, throw_at, walk};

/// Largest error of a point within 10 cm of a joint, in metres.
const NEAR: f64 = 4e-4;
/// The same on levels without some joints, for what the crowd poses: where a joint between is removed, a foot goes straight from frame
/// to frame, and not along its arc.
const COARSE: f64 = 3.5e-3;

struct Scene {
    levels: Levels,
    switching: Switching,
}

impl Scene {
    fn shared() -> &'static Self {
        static SCENE: OnceLock<Scene> = OnceLock::new();
        SCENE.get_or_init(|| {
            let baked = baked();
            let graph = baked.graph();
            let settings = LevelSettings::default();
            let levels = Levels::build(graph.skeleton(), graph.clips(), &settings).unwrap();
            let settings = with(|s: &mut SwitchSettings| s.rule = Rule::Energy { furthest: 12.0 });
            let switching = Switching::new(&levels, &settings).unwrap();
            assert!(switching.bands().len() > 2, "{switching:?}");
            Self { levels, switching }
        })
    }

    /// Characters everywhere on the ground: some stand, others walk, turn, or avoid balls.
    fn characters(&self, crowd: CrowdSettings, threads: usize) -> Characters {
        let mut characters = characters(with(|s: &mut CharacterSettings| s.threads = threads));
        let settings = CrowdPoseSettings {
            crowd,
            near: 3.0,
            switching: self.switching.clone(),
            blend_error: 0.0,
        };
        characters
            .use_crowd(KindId::default(), &self.levels, settings)
            .unwrap();
        characters
    }

    /// The joints of the finest level where a character has them, drawn on its level.
    fn drawn(&self, characters: &Characters, id: CharacterId) -> Vec<Affine3A> {
        let mut pose = Pose::default();
        characters.local_pose(id, &mut pose).unwrap();
        let joints = joints_of(characters.baked().graph().skeleton(), &pose);
        let detail = characters.detail(id).unwrap();
        let (level, blend) = (LevelId(detail as u16), detail.fract());
        drawn(&self.levels, Choice { level, blend }, &joints)
    }

    /// How far the worst point of a character is from where it should be, in metres.
    fn worst(&self, (characters, out): (&Characters, &[F32x16]), id: CharacterId) -> f64 {
        let slice = characters.pose_slice(id).unwrap();
        let drawn = self.drawn(characters, id);
        let level = &self.levels.levels[usize::from(slice.level.0)];
        let mut worst: f64 = 0.0;
        for (joint, id) in level.kept.iter().enumerate() {
            let found = joint_of(out, &slice, joint);
            for point in [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1] {
                let expected = drawn[id.index()].transform_point3(point.as_vec3());
                let apart = found.transform_point3(point).distance(expected.as_dvec3());
                assert!(!apart.is_nan());
                worst = worst.max(apart);
            }
        }
        worst
    }
}

fn spawn(characters: &mut Characters, count: usize) -> Vec<CharacterId> {
    let one = |index: usize| {
        let turn = index as f32;
        let place = Rigid2::new(
            turn,
            3.0 * (index % 12) as f32 - 18.0,
            (index / 12) as f32 * 3.0 - 12.0,
        );
        let id = characters.spawn(place).unwrap();
        if !index.is_multiple_of(4) {
            let goal = walk(Vec3::new(turn.sin(), 0.0, turn.cos()) * 1.2);
            characters.steer(id, goal).unwrap();
        }
        id
    };
    (0..count).map(one).collect()
}

#[test]
fn each_character_is_where_it_is_whoever_poses_it() {
    let scene = Scene::shared();
    for output in outputs() {
        let settings = with(|s: &mut CrowdSettings| s.output = output);
        let mut characters = scene.characters(settings, 2);
        let ids = spawn(&mut characters, 60);
        let mut random = Random::new(4);
        let mut out = vec![F32x16::ZERO; characters.max_output_len(KindId::default(), ids.len())];
        let mut before = vec![false; ids.len()];
        let (mut seen, mut changes) = ([0, 0], 0);
        for frame in 0..60 {
            if frame % 10 == 0 {
                let id = ids[frame % ids.len()];
                throw_at(&mut characters, &[id], &mut random);
                // Some bow, and rise again.
                let bowed = [(JointId(1), Quat::from_rotation_x(0.02 * frame as f32))];
                let added = &bowed[..usize::from(frame % 20 == 0)];
                characters.set_additive(ids[frame % 7], added).unwrap();
            }
            play(&mut characters, 1);
            // A camera that flies across.
            let eye = Vec3::new(frame as f32 * 0.5 - 20.0, 1.6, 0.0);
            characters
                .pose_all(KindId::default(), eye, &mut out)
                .unwrap();
            for (&id, before) in ids.iter().zip(&mut before) {
                let by_crowd = characters.is_posed_by_crowd(id).unwrap();
                let detail = characters.detail(id).unwrap();
                let is_coarse = by_crowd && detail >= 1.0;
                if frame % 3 == 0 {
                    let worst = scene.worst((&characters, &out), id);
                    assert!(
                        worst < if is_coarse { COARSE } else { NEAR },
                        "{output:?}, frame {frame}: {worst} m, by the crowd: {by_crowd}"
                    );
                }
                seen[usize::from(by_crowd)] += 1;
                changes += usize::from(*before != by_crowd);
                *before = by_crowd;
            }
        }
        assert!(
            seen[0] > 300 && seen[1] > 600 && changes > 20,
            "{seen:?} {changes}"
        );
    }
}

#[test]
fn a_blend_is_left_out_only_where_it_is_too_small_to_be_seen() {
    let scene = Scene::shared();
    let mut seen = [0, 0];
    let by_crowd = [0.0, 0.01].map(|blend_error| {
        let mut characters = characters(CharacterSettings::default());
        let settings = CrowdPoseSettings {
            switching: scene.switching.clone(),
            blend_error,
            ..CrowdPoseSettings::default()
        };
        characters
            .use_crowd(KindId::default(), &scene.levels, settings)
            .unwrap();
        let ids = spawn(&mut characters, 40);
        let mut out = vec![F32x16::ZERO; characters.max_output_len(KindId::default(), ids.len())];
        let eye = Vec3::new(0.0, 1.6, -20.0);
        let mut by_crowd = 0;
        for _ in 0..60 {
            play(&mut characters, 1);
            characters
                .pose_all(KindId::default(), eye, &mut out)
                .unwrap();
            for &id in &ids {
                let place = characters.place(id).unwrap();
                let distance = eye.distance(Vec3::new(place.x, 1.0, place.z)) + 1.0;
                let worst = scene.worst((&characters, &out), id);
                let most = COARSE + f64::from(blend_error * distance);
                assert!(worst < most, "{worst} m at {distance} m");
                seen[usize::from(worst > COARSE)] += 1;
                by_crowd += usize::from(characters.is_posed_by_crowd(id).unwrap());
            }
        }
        by_crowd
    });
    assert!(by_crowd[1] > by_crowd[0] + 100, "{by_crowd:?}");
    assert!(seen[1] > 20, "{seen:?}");
}

#[test]
fn poses_do_not_depend_on_threads() {
    let scene = Scene::shared();
    let written = [1, 3].map(|threads| {
        let crowd = with(|s: &mut CrowdSettings| s.threads = threads);
        let mut characters = scene.characters(crowd, threads);
        let ids = spawn(&mut characters, 60);
        let mut out = vec![F32x16::ZERO; characters.max_output_len(KindId::default(), ids.len())];
        for _ in 0..40 {
            play(&mut characters, 1);
            let eye = Vec3::new(0.0, 1.6, -14.0);
            characters
                .pose_all(KindId::default(), eye, &mut out)
                .unwrap();
        }
        let numbers = |&id: &CharacterId| {
            let slice = characters.pose_slice(id).unwrap();
            let joints: Vec<u16> = (0..slice.joints as u16).collect();
            let mut to = vec![0.0; 12 * joints.len()];
            slice.copy_joints(&out, &joints, &mut to);
            to
        };
        ids.iter().map(numbers).collect::<Vec<_>>()
    });
    assert!(written[0] == written[1]);
}

#[test]
fn instances_stand_at_the_row_of_their_place() {
    let scene = Scene::shared();
    let output = with(|s: &mut Output| s.layout = Layout::Instances);
    let crowd = with(|s: &mut CrowdSettings| s.output = output);
    let mut characters = scene.characters(crowd, 1);
    let mut ids = spawn(&mut characters, 20);
    let mut out = vec![F32x16::ZERO; characters.max_output_len(KindId::default(), 20)];
    let mut pose = |characters: &mut Characters| {
        play(characters, 1);
        characters
            .pose_all(KindId::default(), Vec3::ZERO, &mut out)
            .unwrap();
    };
    pose(&mut characters);
    // A place that is used again.
    characters.despawn(ids[7]).unwrap();
    assert!(characters.pose_slice(ids[7]).is_err());
    pose(&mut characters);
    ids[7] = characters.spawn(Rigid2::new(0.5, 40.0, 40.0)).unwrap();
    pose(&mut characters);
    let row = 16 * output.row_len(characters.baked().graph().skeleton().len());
    for &id in &ids {
        let start = characters.pose_slice(id).unwrap().start;
        assert_eq!(start, row * id.index() as usize);
        assert!(scene.worst((&characters, &out), id) < NEAR);
    }
}

#[test]
fn what_cannot_be_posed_is_an_error() {
    let scene = Scene::shared();
    let mut characters = characters(CharacterSettings::default());
    let ids = spawn(&mut characters, 3);
    assert_eq!(characters.max_output_len(KindId::default(), 3), 0);
    let without = characters.pose_all(KindId::default(), Vec3::ZERO, &mut []);
    assert_eq!(without, Err(CharacterError::NoCrowd));
    characters
        .use_crowd(
            KindId::default(),
            &scene.levels,
            CrowdPoseSettings::default(),
        )
        .unwrap();
    assert_eq!(characters.pose_slice(ids[0]), Err(CharacterError::NotPosed));
    assert!(
        characters
            .pose_all(KindId::default(), Vec3::ZERO, &mut [])
            .is_err()
    );
    let mut out = vec![F32x16::ZERO; characters.max_output_len(KindId::default(), 3)];
    characters
        .pose_all(KindId::default(), Vec3::ZERO, &mut out)
        .unwrap();
    assert!(characters.pose_slice(ids[0]).is_ok());
    let saved = characters.save().unwrap();
    characters.load(&saved).unwrap();
    characters
        .pose_all(KindId::default(), Vec3::NAN, &mut out)
        .unwrap();
    let mut levels = scene.levels.clone();
    levels.levels.clear();
    let none = characters.use_crowd(KindId::default(), &levels, CrowdPoseSettings::default());
    assert!(none.is_err());
}
