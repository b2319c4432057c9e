//! Promise: what goes on in a window goes on without one: the fighter does what the query answered, and a driven character obeys and dodges.

use glam::{Vec2, Vec3};
use sabaki_app::window::{DriveScene, Event, MouseCamera, Scene, ThrowScene, ThrowSettings};
use sabaki_draw::scene::Camera;
use sabaki_fixtures::baked::embedded;

#[test]
fn a_candidate_that_was_chosen_plays_the_answers_motion() {
    let baked = embedded();
    let mut scene = ThrowScene::new(baked, None, ThrowSettings::default(), 3);
    let mut events = Vec::new();
    for _ in 0..4 {
        scene.advance(0.4);
        // A ball at the fighter's middle.
        let camera = MouseCamera::new(scene.focus(), scene.distance()).camera();
        let ray = (scene.focus() - camera.eye).normalize();
        scene.throw(&camera, ray, None).unwrap();
        let last = scene.last().unwrap();
        let (answer, end) = (&last.answer, last.attack.end());
        let again = answer.motion_of(baked, last.playhead, answer.chosen());
        let mut again = again.unwrap();
        again.extend(baked.graph(), end);
        for step in 0..=20 {
            let t = end * step as f32 / 20.0;
            let [one, other] =
                [&again, &answer.motion].map(|motion| motion.playhead(baked.graph(), t));
            assert_eq!(one, other, "at {t} of {end}");
        }
        // Another candidate is another motion; to show it is to replay.
        let count = answer.candidates.len();
        let other = (0..count).find(|&index| index != answer.chosen);
        scene.pick(other);
        assert_eq!(scene.picked(), other, "of {count}");
        while scene.moment().is_some_and(|t| t <= end + 1.0) && !scene.is_replaying() {
            scene.advance(0.05);
        }
        scene.pick(None);
        events.extend(scene.take_events());
    }
    let is_answer = |event: &&Event| matches!(event, Event::Answer { .. });
    assert_eq!(events.iter().filter(is_answer).count(), 4);
}

#[test]
fn what_hides_a_driven_character_is_translucent() {
    let mut drive = DriveScene::new(embedded(), None, 5).unwrap();
    drive.advance(1.0 / 60.0);
    let mut seen_from = |x: f32, z: f32| {
        let camera = Camera {
            eye: Vec3::new(x, 2.0, z),
            target: drive.focus(),
            field: 0.8,
        };
        let shot = drive.shot(camera).unwrap();
        assert!(shot.ghosts.iter().all(|ghost| ghost.colour[3] < 0.5));
        (shot.solids.len(), shot.ghosts.len())
    };
    let (all, none) = seen_from(-4.0, 5.0);
    assert_eq!(none, 0);
    // A pillar and an opponent behind it.
    let (solids, ghosts) = seen_from(5.0, 4.0);
    assert_eq!(solids + ghosts, all);
    assert!(ghosts > 10, "{ghosts}");
}

#[test]
fn a_driven_character_goes_where_the_keys_lead_dodges_and_enters_no_wall() {
    let mut drive = DriveScene::new(embedded(), None, 5).unwrap();
    let camera = MouseCamera::new(drive.focus(), 4.6).camera();
    drive.shot(camera).unwrap();
    assert!(drive.key("w", true) && !drive.key("x", true));
    let start = drive.place().unwrap().ground();
    for _ in 0..120 {
        drive.advance(1.0 / 60.0);
    }
    let ahead = camera.target - camera.eye;
    let way = drive.place().unwrap().ground() - start;
    let along = way.dot(glam::Vec2::new(ahead.x, ahead.z).normalize());
    assert!(along > 0.6, "{way}");
    // It turns around first. On into the wall, then around the room.
    let mut deepest = f32::NEG_INFINITY;
    for (key, next) in [("w", "a"), ("a", "s"), ("s", "d")] {
        for _ in 0..60 * 7 {
            drive.advance(1.0 / 60.0);
            deepest = deepest.max(drive.depth());
        }
        drive.key(key, false);
        drive.key(next, true);
    }
    assert!(deepest < 1e-3, "{deepest}");
    let score = drive.score();
    assert!(score.missed >= 8.max(4 * score.hits + 1), "{score:?}");
    let passed = drive
        .take_events()
        .into_iter()
        .filter(|event| matches!(event, Event::Passed { .. }))
        .count();
    assert_eq!(passed as u32, score.missed + score.hits);
    assert!(drive.shot(camera).unwrap().solids.len() > 60);
    // Without its own reflexes it is hit, unless the key is pressed.
    let hits = |key: bool| {
        let mut drive = DriveScene::new(embedded(), None, 5).unwrap();
        drive.key("f", true);
        for frame in 0..60 * 20 {
            drive.key("space", key && frame % 10 == 0);
            drive.advance(1.0 / 60.0);
        }
        (drive.score().hits, drive.score().missed)
    };
    let (without, with) = (hits(false), hits(true));
    assert!(without.0 > with.0 + 2, "{without:?} {with:?}");
}

#[test]
fn the_focus_is_in_the_middle_and_the_eye_above_the_ground() {
    let mut camera = MouseCamera::new(Vec3::new(0.4, 0.9, -0.2), 4.6);
    let middle = camera.camera().pixel(camera.orbit.target, [1280, 720]);
    let middle = middle.unwrap();
    assert!(middle.distance(Vec2::new(640.0, 360.0)) < 0.5, "{middle}");
    camera.drag(Vec2::new(0.0, -1e6));
    assert!(camera.camera().eye.y > 0.1, "never below the ground");
    camera.zoom(1e3);
    assert!(camera.orbit.distance >= 1.2);
}
