//! Promise: no body enters an obstacle, whatever it does; distances are those of a naive search; what cannot be avoided is said.

use glam::{Vec2, Vec3, Vec3Swizzles};
use sabaki::character::{
    CharacterEventKind, CharacterId, CharacterSettings, Characters, Goal, Threat,
};
use sabaki::math::Rigid2;
use sabaki::query::{Obstacle, ObstacleError};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;

use super::world::{FRAME, characters, count, game, joints, pelvis, play, throw_at, walk};

/// How deep a character's spheres are in obstacles.
fn depth(characters: &mut Characters, id: CharacterId, obstacles: &[Obstacle]) -> f32 {
    let joints = joints(characters, id);
    let spheres = &characters.baked().body().spheres;
    let of = |obstacle: &Obstacle| {
        let depths = spheres
            .iter()
            .map(|sphere| sphere.radius - obstacle.distance(sphere.centre(&joints), 0.0));
        depths.fold(f32::NEG_INFINITY, f32::max)
    };
    obstacles.iter().map(of).fold(f32::NEG_INFINITY, f32::max)
}

fn room() -> Vec<Obstacle> {
    let corner = |x: f32, z: f32| Vec2::new(x, z);
    vec![
        Obstacle::half_space(Vec3::Z * 2.5, -Vec3::Z).unwrap(),
        Obstacle::half_space(Vec3::X * -2.0, Vec3::X).unwrap(),
        Obstacle::block(Vec3::new(1.6, 0.5, 0.0), Vec3::new(0.5, 0.5, 0.8), 0.4).unwrap(),
        Obstacle::capsule(Vec3::new(0.0, 0.0, -1.8), Vec3::new(0.0, 2.0, -1.8), 0.3).unwrap(),
        Obstacle::polygon(&[corner(2.0, 2.0), corner(3.0, 1.0), corner(3.0, 2.5)]).unwrap(),
    ]
}

#[test]
fn nobody_enters_an_obstacle_while_steered_and_threatened() {
    let mut random = Random::new(17);
    let (mut game, ids) = game::<1>();
    let (mut planned, mut events) = (0, Vec::new());
    for frame in 0..60 * 40 {
        if frame % 90 == 0 {
            let heading = 1.9 * frame as f32;
            let velocity = Vec3::new(heading.sin(), 0.0, heading.cos()) * 1.4;
            game.steer(ids[0], walk(velocity)).unwrap();
        }
        if frame % 120 == 60 {
            throw_at(&mut game, &[ids[0]], &mut random);
        }
        let mut obstacles = room();
        let angle = 0.4 * game.now() as f32;
        let place = Vec2::from_angle(angle) * 1.5;
        let velocity = place.perp() * 0.4;
        let disc = Obstacle::disc(place, 0.25).unwrap();
        obstacles.push(disc.moving(Vec3::new(velocity.x, 0.0, velocity.y)).unwrap());
        events.clear();
        game.step(FRAME, &obstacles, &mut events);
        if frame > 60 {
            let last = obstacles.pop().unwrap();
            obstacles.push(Obstacle::disc(place + velocity * FRAME, 0.249).unwrap());
            assert_ne!(last, obstacles[5]);
            let deep = depth(&mut game, ids[0], &obstacles);
            assert!(deep < 1e-4, "frame {frame}: {deep} m");
        }
        planned += count(&events, |kind| {
            matches!(kind, CharacterEventKind::Planned { .. })
        });
    }
    assert!(planned > 4, "{planned}");
}

#[test]
fn a_point_behind_a_box_is_reached() {
    let (mut game, ids) = game::<1>();
    let obstacles =
        [Obstacle::block(Vec3::new(0.1, 1.0, 2.0), Vec3::new(0.8, 1.0, 0.3), 0.0).unwrap()];
    let (point, speed) = (Vec3::Z * 5.0, 1.2);
    game.steer(ids[0], Goal::GoTo { point, speed }).unwrap();
    let mut events = Vec::new();
    for _ in 0..60 * 15 {
        game.step(FRAME, &obstacles, &mut events);
        assert!(depth(&mut game, ids[0], &obstacles) < 1e-4);
    }
    let place = game.place(ids[0]).unwrap().ground();
    assert!(place.distance(Vec2::new(0.0, 5.0)) < 0.5, "{place}");
}

#[test]
fn who_is_cornered_says_so() {
    let (mut game, ids) = game::<1>();
    let mut events = Vec::new();
    let wall = |out: Vec3, far: f32| Obstacle::half_space(out * far, -out).unwrap();
    // A cell so narrow that a ball as large as a body cannot be avoided.
    let root = pelvis(&mut game, ids[0]);
    let ways = [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z];
    let cell = ways.map(|out| wall(out, root.dot(out) + 0.55));
    let from = root + Vec3::new(0.0, 3.0, 0.0);
    let threat = Threat::ball(0.6, from, -Vec3::Y * 6.0, 0.6);
    game.threaten(threat).unwrap();
    for _ in 0..90 {
        game.step(FRAME, &cell, &mut events);
        assert!(depth(&mut game, ids[0], &cell) < 0.1);
    }
    let cornered = count(&events, |kind| {
        matches!(kind, CharacterEventKind::Cornered { .. })
    });
    assert!(cornered > 0, "{events:?}");
}

#[test]
fn characters_avoid_each_other() {
    let mut game = characters(with(|s: &mut CharacterSettings| s.body_radius = 0.25));
    let ids = [0.0, 4.0].map(|z| game.spawn(Rigid2::new(0.0, 0.0, z)).unwrap());
    for (id, towards) in ids.into_iter().zip([1.0, -1.0]) {
        game.steer(id, walk(Vec3::Z * towards)).unwrap();
    }
    let mut least = f32::INFINITY;
    for _ in 0..300 {
        play(&mut game, 1);
        let [a, b] = ids.map(|id| game.place(id).unwrap().ground());
        least = least.min(a.distance(b));
    }
    assert!((0.3..2.0).contains(&least), "{least}");
}

/// The distance to the nearest of many points inside.
#[test]
fn distances_are_those_of_a_search_over_points() {
    let mut random = Random::new(23);
    let mut number = |most: f32| random.float(0.0, most);
    let corners: Vec<Vec2> = (0..5)
        .map(|at| Vec2::from_angle(at as f32 * 1.2566) * 0.8)
        .collect();
    let velocity = Vec3::new(0.3, 0.0, -0.2);
    let solids = [
        Obstacle::block(Vec3::new(0.1, 0.5, 0.0), Vec3::new(0.5, 0.4, 0.7), 0.7).unwrap(),
        Obstacle::capsule(Vec3::new(-0.4, 0.3, 0.0), Vec3::new(0.4, 1.0, 0.3), 0.3).unwrap(),
        Obstacle::polygon(&corners).unwrap(),
        Obstacle::disc(Vec2::new(0.2, 0.1), 0.6).unwrap(),
    ];
    for solid in solids {
        let solid = solid.moving(velocity).unwrap();
        let mut inside = Vec::new();
        while inside.len() < 30_000 {
            let point = Vec3::new(number(2.4) - 1.2, number(1.6) - 0.1, number(2.4) - 1.2);
            if solid.distance(point, 0.0) < 0.0 {
                inside.push(point);
            }
        }
        for _ in 0..60 {
            let point = Vec3::new(number(4.0) - 2.0, number(1.0) + 0.2, number(4.0) - 2.0);
            let found = solid.distance(point + velocity * 2.0, 2.0);
            let least = inside.iter().map(|one| one.distance(point));
            let least = least.fold(f32::INFINITY, f32::min);
            assert!(found <= least + 1e-3, "{solid:?} {point}: {found} {least}");
            if found > 0.0 {
                assert!(least < found + 0.12, "{solid:?} {point}: {found} {least}");
            }
        }
    }
}

#[test]
fn obstacles_without_sense_are_refused() {
    let star: Vec<Vec2> = (0..5)
        .map(|at| Vec2::from_angle(at as f32 * 2.0 * 1.2566))
        .collect();
    assert_eq!(Obstacle::polygon(&star), Err(ObstacleError::Corners));
    assert_eq!(Obstacle::polygon(&star[..2]), Err(ObstacleError::Corners));
    assert!(Obstacle::half_space(Vec3::ZERO, Vec3::ZERO).is_err());
    assert!(Obstacle::disc(Vec2::NAN, 1.0).is_err());
    assert!(Obstacle::capsule(Vec3::ZERO, Vec3::Y, 0.0).is_err());
    assert!(Obstacle::block(Vec3::ZERO, Vec3::new(1.0, -1.0, 1.0), 0.0).is_err());
    let disc = Obstacle::disc(Vec2::ZERO, 1.0).unwrap();
    assert!(disc.moving(Vec3::INFINITY).is_err() && disc.weighing(0.0).is_err());
}

#[test]
fn who_has_an_obstacle_put_on_it_is_shoved_out_at_the_speed_of_a_run_and_who_is_wedged_stays() {
    let (mut game, ids) = game::<1>();
    let place = |game: &Characters| game.place(ids[0]).unwrap().ground();
    let middle = place(&game);
    let shoved = |kind| kind == CharacterEventKind::Shoved;
    let stuck = |kind| matches!(kind, CharacterEventKind::Stuck { depth } if depth > 0.1);
    // A car on the body.
    let half = Vec3::new(0.9, 1.0, 0.9);
    let car = [Obstacle::block(Vec3::new(middle.x + 0.3, 1.0, middle.y), half, 0.0).unwrap()];
    let mut events = Vec::new();
    for frame in 0..60 {
        let before = place(&game);
        game.step(FRAME, &car, &mut events);
        let went = place(&game).distance(before);
        assert!(went < 0.1 || frame > 30, "frame {frame}: {went} m");
    }
    assert!(depth(&mut game, ids[0], &car) < 1e-3);
    let said = [count(&events, shoved), count(&events, stuck)];
    assert_eq!(said, [1, 0], "{events:?}");
    // A hall of stone.
    let here = place(&game);
    let stone = [Obstacle::block(here.extend(0.0).xzy(), Vec3::splat(9.0), 0.0).unwrap()];
    events.clear();
    for _ in 0..120 {
        game.step(FRAME, &stone, &mut events);
    }
    assert!(place(&game).distance(here) < 0.3);
    let said = [count(&events, shoved), count(&events, stuck)];
    assert_eq!(said, [0, 1], "{events:?}");
}
