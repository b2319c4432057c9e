//! Promise: what goes on in a window goes on without one: the fighter does what the query answered, by the maps that were chosen.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use sabaki_fixtures as common;

use common::baked::embedded;
use glam::Vec3;
use sabaki::maps::{BakedGraph, MapGrid};
use sabaki::query::cull::cpu;
use sabaki::query::{Answer, CullPath, Query, QueryContext, Request};
use sabaki_app::live::{
    Drive, Event, Fighter, FighterSettings, MapChoice, MapChoices, Orbit, QueryWorkerDesc, Throw,
    with_query_worker,
};
use sabaki_draw::scene::Camera;

#[test]
fn a_candidate_that_was_chosen_plays_the_answers_motion() {
    let baked = embedded();
    let maps = MapChoices::slabs(baked);
    let (events, _) = with_query_worker(&maps, &QueryWorkerDesc::default(), |worker| {
        let mut fighter = Fighter::new(&maps, worker, waiting()).with_seed(3);
        let mut events = Vec::new();
        for _ in 0..4 {
            fighter.advance(0.4);
            throw_at(&mut fighter);
            let last = fighter.last().unwrap();
            let (answer, end) = (last.answer(), last.ball.attack.end());
            let again = answer.motion_of(baked, last.playhead, answer.chosen());
            let mut again = again.unwrap();
            again.extend(baked.graph(), end);
            for step in 0..=20 {
                let t = end * step as f32 / 20.0;
                let (one, other) = (
                    again.playhead(baked.graph(), t),
                    answer.motion.playhead(baked.graph(), t),
                );
                assert_eq!(one, other, "at {t} of {end}");
            }
            // Another candidate is another motion; to show it is to replay.
            let other = (0..answer.candidates.len()).find(|&index| index != answer.chosen);
            let count = answer.candidates.len();
            fighter.pick(other);
            assert_eq!(fighter.picked(), other, "of {count}");
            while fighter.moment().is_some_and(|t| t <= end + 1.0) && !fighter.is_replaying() {
                fighter.advance(0.05);
            }
            fighter.pick(None);
            events.extend(fighter.take_events());
        }
        events
    });
    let answers = events
        .iter()
        .filter(|event| matches!(event, Event::Answer { .. }));
    assert_eq!(answers.count(), 4);
}

#[test]
fn slabs_of_another_height_cull_the_next_throw_on_every_path() {
    let baked = embedded();
    let choices = MapChoices::slabs(baked);
    let desc = QueryWorkerDesc {
        validation: true,
        ..QueryWorkerDesc::default()
    };
    let ((), heard) = with_query_worker(&choices, &desc, |worker| {
        let mut fighter = Fighter::new(&choices, worker, waiting()).with_seed(5);
        let grids: Vec<(MapChoice, MapGrid)> = choices.grids().collect();
        let heights: Vec<f32> = grids.iter().map(|(_, grid)| grid.slab_height).collect();
        assert_eq!(heights, [0.05, 0.10, 0.20, 0.30, 0.30]);
        for (round, (choice, grid)) in grids.iter().chain(&grids[1..3]).enumerate() {
            fighter.settings.culling = CullPath::ALL[1 + round % 3];
            fighter.choose_maps(*choice);
            fighter.advance(3.0);
            throw_at(&mut fighter);
            let last = fighter.last().unwrap();
            assert_eq!((last.response.maps, last.maps), (*choice, *grid));
            assert_eq!(last.response.culling, CullPath::ALL[1 + round % 3]);
            assert_eq!(last.response.trouble, None);

            // What maps that were drawn for this alone count, and what is chosen by them.
            let other = baked.with_maps(*grid).unwrap();
            let answer = answered(&other, last);
            assert_eq!(answer.counts, last.answer().counts, "{grid:?}");
            assert_eq!(answer.motion, last.answer().motion, "{grid:?}");
            while fighter.moment().is_some() {
                fighter.advance(0.1);
            }
        }
    });
    assert!(heard.is_empty(), "{heard:?}");
}

#[test]
fn maps_that_cannot_be_drawn_are_said_and_the_baked_ones_cull() {
    let thin = MapGrid {
        slab_height: 0.0,
        ..MapGrid::default()
    };
    let choices = MapChoices::new(embedded(), [MapGrid::default(), thin]);
    assert_eq!(choices.grids().count(), 2, "the baked ones only once");
    let (events, _) = with_query_worker(&choices, &QueryWorkerDesc::default(), |worker| {
        let mut fighter = Fighter::new(&choices, worker, waiting()).with_seed(1);
        fighter.choose_maps(MapChoice(1));
        throw_at(&mut fighter);
        assert_eq!(fighter.last().unwrap().maps, MapGrid::default());
        fighter.take_events()
    });
    let said = |event: &Event| matches!(event, Event::Trouble { why } if why.contains("slabs"));
    assert!(events.iter().any(said), "{events:?}");
}

/// Every answer is waited for.
fn waiting() -> FighterSettings {
    FighterSettings {
        waits: true,
        ..FighterSettings::default()
    }
}

/// A ball at the fighter's middle.
fn throw_at(fighter: &mut Fighter<'_>) {
    let camera = Orbit::around_fighter(fighter.focus()).camera();
    let ray = (fighter.focus() - camera.eye).normalize();
    fighter.throw(&camera, ray).unwrap();
}

/// What a query answers to a throw, culled on the CPU.
fn answered(baked: &BakedGraph, throw: &Throw<'_>) -> Answer {
    let query = Query::new(baked, &throw.settings);
    let (mut context, mut culler) = (QueryContext::default(), cpu::Culler::default());
    let mut answer = Answer::default();
    let request = Request::new(throw.playhead, &throw.ball.attack);
    query
        .start(request, &mut context)
        .run_on_cpu(&mut culler, &mut answer);
    answer
}

#[test]
fn what_hides_a_driven_character_is_translucent() {
    let mut drive = Drive::new(embedded(), 5).unwrap();
    drive.advance(1.0 / 60.0).unwrap();
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
    let mut drive = Drive::new(embedded(), 5).unwrap();
    let camera = Orbit::around_fighter(drive.focus()).camera();
    drive.look(&camera);
    assert!(drive.hold("w", true) && !drive.hold("x", true));
    let start = drive.place().unwrap().ground();
    for _ in 0..120 {
        drive.advance(1.0 / 60.0).unwrap();
    }
    let ahead = camera.target - camera.eye;
    let way = drive.place().unwrap().ground() - start;
    let along = way.dot(glam::Vec2::new(ahead.x, ahead.z).normalize());
    assert!(along > 0.6, "{way}");
    // It turns around first. On into the wall, then around the room.
    let mut deepest = f32::NEG_INFINITY;
    for (key, next) in [("w", "a"), ("a", "s"), ("s", "d")] {
        for _ in 0..60 * 7 {
            drive.advance(1.0 / 60.0).unwrap();
            deepest = deepest.max(drive.depth());
        }
        drive.hold(key, false);
        drive.hold(next, true);
    }
    assert!(deepest < 1e-3, "{deepest}");
    let score = drive.score();
    assert!(
        score.missed >= 8 && score.missed > 4 * score.hits,
        "{score:?}"
    );
    let passed = drive
        .take_events()
        .into_iter()
        .filter(|event| matches!(event, Event::Passed { .. }))
        .count();
    assert_eq!(passed as u32, score.missed + score.hits);
    assert!(drive.shot(camera).unwrap().solids.len() > 60);
    // Without its own reflexes it is hit, unless the key is pressed.
    let hits = |key: bool| {
        let mut drive = Drive::new(embedded(), 5).unwrap();
        drive.hold("f", true);
        for frame in 0..60 * 20 {
            drive.hold("space", key && frame % 10 == 0);
            drive.advance(1.0 / 60.0).unwrap();
        }
        (drive.score().hits, drive.score().missed)
    };
    let (without, with) = (hits(false), hits(true));
    assert!(without.0 > with.0 + 2, "{without:?} {with:?}");
}
