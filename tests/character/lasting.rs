//! Promise: what happens to a threat is said once and truly, however fast it is and however long a frame takes; a player is never left without
//! control for long; what is out of range is refused.

use glam::{Quat, Vec2, Vec3};
use sabaki::anim::Pose;
use sabaki::character::{
    CharacterEvent, CharacterEventKind as Kind, CharacterId, Characters, Goal, Threat,
};
use sabaki::math::Rigid2;
use sabaki::query::Obstacle;

use super::world::{FRAME, count, game, joints, pelvis, place, play, steps, walk, way};

/// One character at the origin that has stood for a while.
fn one() -> (Characters, CharacterId) {
    let (mut game, [id]) = game::<1>();
    play(&mut game, 30);
    (game, id)
}

/// Hits and misses among events.
fn outcomes(events: &[CharacterEvent]) -> [usize; 2] {
    [
        count(events, |kind| matches!(kind, Kind::Hit { .. })),
        count(events, |kind| matches!(kind, Kind::MissedBy { .. })),
    ]
}

/// A ball through the pelvis, too fast and too near to be avoided. It is there `late` seconds from now.
fn shot(game: &mut Characters, id: CharacterId, speed: f32, late: f64) -> Threat {
    let middle = pelvis(game, id);
    let way = Vec3::new(1.0, 0.0, 0.3).normalize();
    let (from, time) = (middle - way * 0.02 * speed, game.now() + late - 0.02);
    Threat {
        seconds: 0.5,
        ..Threat::ball(time, from, way * speed, 0.1)
    }
}

#[test]
fn what_hits_is_said_to_hit_at_any_speed_and_frame_time() {
    for speed in [3.0, 30.0, 200.0, 800.0] {
        for dt in [1.0 / 120.0, FRAME, 1.0 / 24.0, 0.4] {
            for late in [0.021, 0.0273, 0.035] {
                let (mut game, id) = one();
                let shot = shot(&mut game, id, speed, late);
                game.threaten(shot).unwrap();
                let found = outcomes(&steps(&mut game, dt, 60));
                assert_eq!(found, [1, 0], "{speed} m/s, {dt} s, {late} s");
            }
        }
    }
}

#[test]
fn a_swing_that_ends_where_it_touches_hits() {
    let (mut game, id) = one();
    let middle = pelvis(&mut game, id);
    let mut swing = Threat::ball(game.now(), middle - Vec3::X * 0.5, Vec3::X * 4.0, 0.05);
    swing.seconds = 0.1;
    game.threaten(swing).unwrap();
    assert_eq!(outcomes(&play(&mut game, 30)), [1, 0]);
}

#[test]
fn a_threat_that_is_left_and_met_again_is_reported_once() {
    let (mut game, id) = one();
    // A slow ball that passes the character's place after 4 s.
    let ball = Threat::ball(game.now(), Vec3::new(8.0, 1.0, 0.0), Vec3::NEG_X * 2.0, 0.1);
    game.threaten(Threat {
        seconds: 6.0,
        ..ball
    })
    .unwrap();
    let mut events = Vec::new();
    for frame in 0..420 {
        let way = if frame < 90 { Vec3::Z } else { Vec3::NEG_Z };
        game.steer(id, walk(way * 1.2)).unwrap();
        game.step(FRAME, &[], &mut events);
    }
    let [hits, misses] = outcomes(&events);
    assert_eq!(hits + misses, 1, "{events:?}");
}

#[test]
fn a_dodge_is_played_to_its_end_although_its_threat_is_seen_with_noise() {
    let evading = [false, true].map(|is_seen_again| {
        let (mut game, id) = one();
        let middle = pelvis(&mut game, id);
        let from = Vec3::new(3.0, 0.3, 1.0);
        let ball = Threat::ball(game.now() + 0.4, middle + from, -from * 3.0, 0.1);
        let threat = game.threaten(ball.clone()).unwrap();
        let (mut events, mut frames) = (Vec::new(), 0);
        for frame in 0..240 {
            if is_seen_again && frame < 60 {
                let noise = Vec3::Y * (1e-4 * (frame % 3) as f32);
                let position = ball.position + noise;
                let mut seen = ball.clone();
                seen.position = position;
                game.update(threat, seen).unwrap();
            }
            game.step(FRAME, &[], &mut events);
            let edge = game.playhead(id).unwrap().edge;
            frames += usize::from(game.baked().graph().edge(edge).event.is_some());
        }
        assert_eq!(outcomes(&events), [0, 1]);
        frames
    });
    assert!(evading[0] > 10, "{evading:?}");
    assert!(evading[1] + 6 >= evading[0], "{evading:?}");
}

#[test]
fn a_threat_that_stays_near_leaves_the_player_in_control() {
    for is_seen_again in [false, true] {
        let (mut game, id) = one();
        // It hovers beside the path and stays for a minute.
        let mut hovering = Threat::ball(game.now(), Vec3::new(1.3, 1.2, 0.0), Vec3::ZERO, 0.2);
        hovering.seconds = 60.0;
        let threat = game.threaten(hovering.clone()).unwrap();
        let from = place(&game, id);
        game.steer(id, walk(Vec3::NEG_X * 1.2)).unwrap();
        let mut events = Vec::new();
        for _ in 0..360 {
            if is_seen_again {
                game.update(threat, hovering.clone()).unwrap();
            }
            game.step(FRAME, &[], &mut events);
        }
        let went = from.x - place(&game, id).x;
        assert!(went > 1.5, "updated: {is_seen_again}, {went} m");
        assert_eq!(outcomes(&events)[0], 0);
        let began = count(&events, |kind| kind == Kind::Began);
        assert!(began < 4, "{events:?}");
    }
}

#[test]
fn who_walks_towards_what_stays_plans_again() {
    let (mut game, id) = one();
    let mut hovering = Threat::ball(game.now(), Vec3::new(0.0, 1.3, 2.5), Vec3::ZERO, 0.15);
    hovering.seconds = 60.0;
    game.threaten(hovering).unwrap();
    game.steer(id, walk(Vec3::Z * 1.0)).unwrap();
    let events = play(&mut game, 600);
    let planned = count(&events, |kind| matches!(kind, Kind::Planned { .. }));
    assert!(planned > 0, "{events:?}");
}

#[test]
fn a_threat_that_is_gone_holds_nobody() {
    let (mut game, id) = one();
    game.steer(id, walk(Vec3::X * 1.2)).unwrap();
    play(&mut game, 90);
    // It will pass in front of who walks.
    let at = pelvis(&mut game, id);
    let start = at + Vec3::new(2.0, 0.0, 3.0);
    let ball = Threat::ball(game.now(), start, Vec3::NEG_Z * 2.0, 0.3);
    let ball = game.threaten(ball).unwrap();
    play(&mut game, 2);
    game.remove(ball).unwrap();
    game.steer(id, Goal::Stop).unwrap();
    play(&mut game, 60);
    let went = way(&mut game, id, 60).length();
    assert!(went < 0.25, "{went} m in a second");
}

#[test]
fn each_threat_that_cannot_be_avoided_is_reported() {
    let (mut game, id) = one();
    for _ in 0..3 {
        let shot = shot(&mut game, id, 20.0, 0.05);
        let shot = game.threaten(shot).unwrap();
        let events = play(&mut game, 6);
        let cannot = count(&events, |kind| kind == Kind::Cannot);
        assert_eq!(cannot, 1, "{events:?}");
        game.remove(shot).unwrap();
        play(&mut game, 120);
    }
}

#[test]
fn a_threat_for_one_who_is_gone_concerns_nobody_else() {
    let (mut game, id) = one();
    let mut shot = shot(&mut game, id, 10.0, 0.3);
    shot.target = Some(id);
    game.threaten(shot).unwrap();
    game.despawn(id).unwrap();
    let other = game.spawn(Rigid2::IDENTITY).unwrap();
    assert_eq!(other.index(), id.index());
    assert!(play(&mut game, 60).is_empty());
}

#[test]
fn a_frame_of_any_length_leaves_a_state_that_can_be_loaded() {
    let (mut game, id) = one();
    for dt in [0.3, 2.0, 900.0, 1.7e9, f32::MAX] {
        game.steer(id, walk(Vec3::X)).unwrap();
        game.step(dt, &[], &mut Vec::new());
        let saved = game.save().unwrap();
        game.load(&saved).unwrap();
    }
    assert!(game.now() < 10.0);
}

#[test]
fn a_slow_frame_turns_nobody_past_the_way() {
    for dt in [0.1, 0.3, 0.9] {
        let (mut game, id) = one();
        let before = game.place(id).unwrap().heading();
        let heading = before + 0.2;
        game.steer(id, Goal::Face { heading }).unwrap();
        for _ in 0..8 {
            game.step(dt, &[], &mut Vec::new());
            let off = game.place(id).unwrap().heading() - heading;
            let off = off - std::f32::consts::TAU * (off / std::f32::consts::TAU).round();
            assert!(off.abs() < 0.6, "{off} rad after a step of {dt} s");
        }
    }
}

#[test]
fn who_has_arrived_stays() {
    let (mut game, id) = one();
    let point = Vec3::new(2.0, 0.0, 1.0);
    game.steer(id, Goal::GoTo { point, speed: 1.0 }).unwrap();
    play(&mut game, 480);
    for frame in 0..60 * 120 {
        game.steer(id, Goal::GoTo { point, speed: 1.0 }).unwrap();
        play(&mut game, 1);
        let off = place(&game, id).distance(Vec2::new(point.x, point.z));
        assert!(off < 0.4, "{off} m after {frame} frames");
    }
}

#[test]
fn who_stands_makes_way_across_what_comes() {
    for (side, from) in [(1.0, -1.4), (-1.0, -1.4), (1.0, 1.4), (-1.0, 1.4)] {
        let (mut game, id) = one();
        let start = place(&game, id);
        let velocity = Vec3::new(0.0, 0.0, -0.8 * f32::signum(from));
        // It passes the body a little to one side.
        let at = Vec2::new(start.x - 0.2 * side, start.y + 2.0 * from);
        for frame in 0..150 {
            let now = at + Vec2::new(velocity.x, velocity.z) * (frame as f32 * FRAME);
            let cart = Obstacle::disc(now, 0.4).unwrap().moving(velocity).unwrap();
            game.step(FRAME, &[cart], &mut Vec::new());
        }
        let went = place(&game, id) - start;
        assert!(went.x * side > 0.1, "{side} {from}: {went}");
        assert!(went.x.abs() > went.y.abs(), "{side} {from}: {went}");
    }
}

#[test]
fn poses_that_are_none_are_not_resumed() {
    let (mut game, id) = one();
    let skeleton = game.baked().graph().skeleton().len();
    let pose = |translations: Vec<Vec3>| Pose {
        root: Vec3::Y,
        rotations: vec![Quat::IDENTITY; skeleton],
        translations,
    };
    let wrong = [
        (
            pose(vec![Vec3::ZERO]),
            format!("1 joints are given; the skeleton has {skeleton}"),
        ),
        (
            pose(vec![Vec3::NAN; skeleton]),
            "the distance of a joint from its parent is NaN; it must be 0 to 5000".to_owned(),
        ),
        (
            Pose {
                rotations: vec![Quat::IDENTITY * 2.0; skeleton],
                ..pose(Vec::new())
            },
            "the squared length of a rotation is 4; it must be 0.9998 to 1.0002".to_owned(),
        ),
    ];
    for (wrong, words) in wrong {
        let found = game.resume(id, [&wrong, &wrong], 0.1);
        assert_eq!(found.unwrap_err().to_string(), words);
    }
}

#[test]
fn a_game_on_a_platform_is_that_on_the_ground_as_high_as_the_platform() {
    const HEIGHT: f32 = 3.5;
    let mut games = [0.0, HEIGHT].map(|height| {
        let (mut game, id) = one();
        game.set_height(id, height).unwrap();
        game.steer(id, walk(Vec3::X)).unwrap();
        let up = Vec3::Y * height;
        let from = Vec3::new(1.5, 1.2, 8.0) + up;
        let ball = Threat::ball(game.now(), from, Vec3::NEG_Z * 6.0, 0.1);
        game.threaten(ball).unwrap();
        let block = Obstacle::block(Vec3::new(4.0, 0.5, 0.0) + up, Vec3::splat(0.5), 0.3);
        (game, id, [block.unwrap()], Vec::new(), up)
    });
    let mut planned = 0;
    for frame in 0..300 {
        let [low, high] = &mut games;
        for (game, id, obstacles, events, up) in [&mut *low, &mut *high] {
            events.clear();
            game.step(FRAME, obstacles, events);
            if frame == 200 {
                let middle = pelvis(game, *id);
                let hit = Threat::ball(game.now(), middle + Vec3::Z, Vec3::NEG_Z * 9.0, 0.1);
                game.threaten(hit).unwrap();
            }
            assert!(pelvis(game, *id).y > up.y);
        }
        let [of_low, of_high] = [&mut *low, &mut *high].map(|(game, id, ..)| joints(game, *id));
        for (low, high) in of_low.iter().zip(&of_high) {
            let apart = low.translation + Vec3::Y * HEIGHT - high.translation;
            assert!(apart.length() < 2e-2, "frame {frame}: {apart}");
        }
        let kinds = |events: &[CharacterEvent]| {
            let kinds = events.iter().map(|e| std::mem::discriminant(&e.kind));
            kinds.collect::<Vec<_>>()
        };
        assert_eq!(kinds(&low.3), kinds(&high.3), "frame {frame}");
        planned += low.3.len();
    }
    assert!(planned > 2, "{planned}");
}

#[test]
fn who_is_moved_goes_on_from_there_and_looks_at_threats_again() {
    let (mut game, id) = one();
    let by = Rigid2::new(0.7, 2.0, -1.0);
    let before = joints(&mut game, id);
    game.move_by(id, by).unwrap();
    for (before, after) in before.iter().zip(joints(&mut game, id)) {
        assert!((by.point(before.translation) - after.translation).length() < 1e-4);
    }
    // A ball that passes beside it, seen and left alone, until a platform carries the character there.
    let middle = pelvis(&mut game, id);
    let from = middle + Vec3::new(0.9, 0.3, 8.4);
    game.threaten(Threat::ball(game.now(), from, Vec3::NEG_Z * 7.0, 0.1))
        .unwrap();
    let events = play(&mut game, 3);
    let kept = count(&events, |kind| matches!(kind, Kind::Kept { .. }));
    assert!(kept > 0, "{events:?}");
    let mut events = Vec::new();
    for _ in 0..18 {
        game.move_by(id, Rigid2::new(0.0, 0.05, 0.0)).unwrap();
        events.extend(play(&mut game, 1));
    }
    let planned = count(&events, |kind| matches!(kind, Kind::Planned { .. }));
    assert!(planned > 0, "{events:?}");
    let beyond = game.move_by(id, Rigid2::new(0.0, 1e4, 0.0));
    assert!(beyond.is_err() && game.set_height(id, f32::NAN).is_err());
}
