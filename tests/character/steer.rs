//! Promise: characters do what their goals ask, without labelled events, and an id names one character alone.

use sabaki_fixtures::with;
use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use sabaki::anim::{Leg, Pose, forward_kinematics};
use sabaki::character::{CharacterError, CharacterSettings, Characters, Goal};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;

use super::world::{self, FRAME, characters, game, play, way};

fn walk(heading: f32, speed: f32) -> Goal {
    world::walk(Vec3::new(heading.sin(), 0.0, heading.cos()) * speed)
}

#[test]
fn a_character_walks_where_it_is_told() {
    let mut characters = characters(CharacterSettings::default());
    let id = characters.spawn(Rigid2::new(1.0, 3.0, -2.0)).unwrap();
    for turn in 0..6 {
        let heading = turn as f32 * TAU * 0.39;
        characters.steer(id, walk(heading, 0.8)).unwrap();
        play(&mut characters, 90);
        let way = way(&mut characters, id, 60);
        let wanted = Vec2::new(heading.sin(), heading.cos());
        let off = way.angle_to(wanted).abs().to_degrees();
        assert!(off < 15.0, "turn {turn}: {off} degrees off");
        let metres = way.length();
        assert!(metres > 0.4, "turn {turn}: {metres} m in a second");
    }
}

#[test]
fn a_slowest_rate_above_that_of_the_clips_is_kept_in_turns() {
    let mut settings = CharacterSettings::default();
    (settings.steer.slowest, settings.steer.fastest) = (1.3, 1.5);
    let mut characters = characters(settings);
    let id = characters.spawn(Rigid2::IDENTITY).unwrap();
    for turn in 0..40 {
        characters.steer(id, walk(turn as f32 * 2.4, 3.0)).unwrap();
        play(&mut characters, 45);
    }
    characters.steer(id, walk(0.0, 3.0)).unwrap();
    play(&mut characters, 120);
    let way = way(&mut characters, id, 60).length();
    assert!(way > 0.3, "{way} m in a second");
}

#[test]
fn a_character_that_is_told_to_walk_slowly_does_not_stand() {
    let (mut characters, []) = game::<0>();
    let ids = [(); 12].map(|()| characters.spawn(Rigid2::IDENTITY).unwrap());
    for change in 0..8 {
        let wanted = |number: usize| {
            let heading = (number * 8 + change) as f32 * TAU * 0.381_966;
            (heading, 0.6 + 0.01 * number as f32)
        };
        for (number, &id) in ids.iter().enumerate() {
            let (heading, speed) = wanted(number);
            characters.steer(id, walk(heading, speed)).unwrap();
        }
        play(&mut characters, 90);
        let place = |id| characters.place(id).unwrap().ground();
        let from: Vec<Vec2> = ids.iter().map(|&id| place(id)).collect();
        // Two seconds: the clips walk to and fro.
        play(&mut characters, 120);
        for (number, &id) in ids.iter().enumerate() {
            let way = characters.place(id).unwrap().ground() - from[number];
            let (heading, speed) = wanted(number);
            let ahead = way.dot(Vec2::new(heading.sin(), heading.cos()));
            let least = 0.6 * 2.0 * speed;
            assert!(ahead > least, "change {change}, {speed} m/s: {ahead} m");
        }
        if change % 2 == 1 {
            ids.iter()
                .for_each(|&id| characters.steer(id, Goal::Stop).unwrap());
            play(&mut characters, 60);
        }
    }
}

/// With the rate of the clips, only the strides can make it slower.
fn strides_get_shorter_on_feet_that_stay(baked: &BakedGraph) {
    let mut settings = CharacterSettings::default();
    (settings.steer.slowest, settings.steer.fastest) = (1.0, 1.0);
    let mut characters = Characters::new(Arc::new(baked.clone()), settings).unwrap();
    let id = characters.spawn(Rigid2::IDENTITY).unwrap();
    let mut measured = |speed: f32| {
        characters.steer(id, walk(0.0, speed)).unwrap();
        play(&mut characters, 240);
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        let mut toes = Vec::new();
        let graph = baked.graph();
        let from = characters.place(id).unwrap().ground();
        for _ in 0..360 {
            play(&mut characters, 1);
            characters.local_pose(id, &mut pose).unwrap();
            forward_kinematics(graph.skeleton(), &pose, &mut joints);
            let legs = graph.feet().legs().iter();
            let toe = |leg: &Leg| joints[leg.toe_or_foot().index()].translation;
            toes.push(legs.map(toe).collect::<Vec<Vec3>>());
        }
        let slower = |frames: &[Vec<Vec3>]| {
            let both = frames[0].iter().zip(&frames[1]);
            both.map(|(a, b)| a.distance(*b) / FRAME)
                .fold(f32::INFINITY, f32::min)
        };
        let mut slide: Vec<f32> = toes.windows(2).map(slower).collect();
        slide.sort_by(f32::total_cmp);
        let way = characters.place(id).unwrap().ground() - from;
        (way.length() / 6.0, slide[slide.len() / 2])
    };
    let (natural, slide) = measured(1.2);
    let (slow, slow_slide) = measured(0.75 * natural);
    assert!(
        (slow / (0.75 * natural) - 1.0).abs() < 0.1,
        "{natural} m/s, then {slow}"
    );
    assert!(slow_slide < slide + 0.03, "{slide} m/s, then {slow_slide}");
}
on_both!(strides_get_shorter_on_feet_that_stay);

#[test]
fn a_character_turns_to_a_heading() {
    let (mut characters, [id]) = game::<1>();
    characters.steer(id, Goal::Face { heading: 2.0 }).unwrap();
    play(&mut characters, 180);
    let heading = characters.place(id).unwrap().heading();
    assert!((heading - 2.0).abs() < 0.5, "{heading}");
}

#[test]
fn what_is_steered_plays_no_labelled_events_and_its_state_does_not_grow() {
    let (mut characters, [id]) = game::<1>();
    let mut sizes = Vec::new();
    for frame in 0..60 * 60 {
        if frame % 240 == 0 {
            let goal = match frame / 240 % 3 {
                0 => Goal::Idle,
                1 => walk(frame as f32, 0.8),
                _ => Goal::Stop,
            };
            characters.steer(id, goal).unwrap();
        }
        assert_eq!(play(&mut characters, 1), []);
        let edge = characters.playhead(id).unwrap().edge;
        let event = characters.baked().graph().edge(edge).event;
        assert_eq!(event, None, "frame {frame}");
        if frame % 60 == 0 {
            sizes.push(characters.save().unwrap().len());
        }
    }
    let (early, late) = sizes.split_at(sizes.len() / 2);
    let most = |sizes: &[usize]| sizes.iter().copied().max().unwrap();
    assert!(most(late) < 2 * most(early), "{sizes:?}");
}

#[test]
fn who_stands_for_an_hour_stays_where_it_came_to_stand() {
    let mut characters = characters(CharacterSettings::default());
    let ids = [0.0, 1.0, 2.0].map(|heading| {
        let place = Rigid2::new(heading, 5.0 * heading, 0.0);
        characters.spawn(place).unwrap()
    });
    // Two stand where a walk and a run end.
    characters.steer(ids[1], walk(0.4, 0.8)).unwrap();
    characters.steer(ids[2], walk(1.6, 1.6)).unwrap();
    play(&mut characters, 300);
    for id in ids {
        characters.steer(id, Goal::Stop).unwrap();
    }
    play(&mut characters, 120);
    let start = ids.map(|id| characters.place(id).unwrap().ground());
    for minute in 1..=60 {
        play(&mut characters, 3600);
        for ((&id, start), most) in ids.iter().zip(start).zip([0.5, 0.5, 0.35]) {
            let off = characters.place(id).unwrap().ground().distance(start);
            assert!(off < most, "{off} m after {minute} minutes");
        }
    }
}

#[test]
fn an_id_names_one_character() {
    let mut characters = characters(CharacterSettings::default());
    let first = characters.spawn(Rigid2::IDENTITY).unwrap();
    characters.despawn(first).unwrap();
    let second = characters.spawn(Rigid2::IDENTITY).unwrap();
    assert_ne!(first, second);
    assert_eq!(characters.len(), 1);
    let gone = characters.steer(first, Goal::Idle);
    assert!(matches!(gone, Err(CharacterError::NoSuchCharacter { .. })));
    assert!(characters.despawn(first).is_err() && characters.place(first).is_err());
    let nowhere = Goal::Face { heading: f32::NAN };
    assert!(characters.steer(second, nowhere).is_err());
    let far = characters.spawn(Rigid2::new(0.0, f32::INFINITY, 0.0));
    assert!(far.is_err());
}

#[test]
fn a_body_is_taken_back_from_any_pose_with_its_speed() {
    let mut characters = characters(CharacterSettings::default());
    let id = characters.spawn(Rigid2::new(0.5, 1.0, 2.0)).unwrap();
    characters.steer(id, walk(1.0, 0.8)).unwrap();
    play(&mut characters, 60);
    characters.release(id).unwrap();
    let (mut before, mut now) = (Pose::default(), Pose::default());
    characters.local_pose(id, &mut before).unwrap();
    play(&mut characters, 30);
    characters.local_pose(id, &mut now).unwrap();
    assert_eq!(before, now, "what is released is not moved");
    // Thrown over, and still moving.
    now.root += Vec3::new(0.02, -0.3, 0.01);
    now.rotations[0] = Quat::from_rotation_x(0.7) * now.rotations[0];
    before.rotations[0] = Quat::from_rotation_x(0.66) * before.rotations[0];
    before.root += Vec3::new(0.0, -0.28, 0.0);
    characters.resume(id, [&before, &now], FRAME).unwrap();
    let mut resumed = Pose::default();
    characters.local_pose(id, &mut resumed).unwrap();
    assert!(resumed.root.distance(now.root) < 1e-4);
    let turned = |a: &Pose, b: &Pose| {
        let both = a.rotations.iter().zip(&b.rotations);
        both.map(|(a, b)| a.angle_between(*b)).fold(0.0, f32::max)
    };
    assert!(turned(&resumed, &now) < 0.02, "{}", turned(&resumed, &now));
    characters.step(FRAME, &[], &mut Vec::new());
    let mut later = Pose::default();
    characters.local_pose(id, &mut later).unwrap();
    let goes = (later.root - now.root) - (now.root - before.root);
    assert!(goes.length() < 0.01, "{goes}");
    play(&mut characters, 120);
    let way = way(&mut characters, id, 60).length();
    assert!(way > 0.4, "{way} m");
    let of_no_joints = characters.resume(id, [&Pose::default(), &now], FRAME);
    assert!(of_no_joints.is_err());
}

#[test]
fn the_searches_of_many_characters_are_spread_over_the_frames() {
    const COUNT: usize = 60;
    let settings = with(|s: &mut CharacterSettings| s.searches_per_step = 1);
    let mut game = characters(settings);
    let place = |index: usize| Rigid2::new(0.0, 4.0 * index as f32, 0.0);
    let ids: [_; COUNT] = std::array::from_fn(|index| game.spawn(place(index)).unwrap());
    play(&mut game, 30);
    let mut idle = characters(settings);
    idle.restore(game.state()).unwrap();
    for &id in &ids {
        game.steer(id, walk(1.0, 1.0)).unwrap();
    }
    // All would search each 9 frames, and those that stand count twice.
    let most = COUNT.div_ceil(9).div_ceil(2);
    let mut before = 0;
    for frame in 0..2 * 9 + 2 {
        play(&mut game, 1);
        play(&mut idle, 1);
        let at = |game: &Characters, id| {
            let playhead = game.playhead(id).unwrap();
            (playhead.edge, playhead.frame)
        };
        let went = ids.iter().filter(|&&id| at(&game, id) != at(&idle, id));
        let went = went.count();
        assert!(went <= before + most, "frame {frame}: {before} then {went}");
        before = went;
    }
    assert!(before > COUNT * 9 / 10, "{before}");
}
