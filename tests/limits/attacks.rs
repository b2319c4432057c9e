//! Attacks that nobody throws.

use std::thread;

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::math::Rigid2;
use sabaki::query::{
    Answer, Attack, AttackError, Enumerate, Query, QueryContext, QuerySettings, Request,
};

use super::MB;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::memory::{alone, held_at_most};
use sabaki_fixtures::random::Random;
use sabaki_fixtures::throw::key;
use sabaki_fixtures::with;

/// Answers an attack in both ways of looking for candidates, at the same time, within so many bytes together.
fn answered(attack: &Attack, most: usize) -> Answer {
    let baked = embedded();
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let answer = |enumerate| {
        let settings = with(|s: &mut QuerySettings| (s.enumerate, s.threads) = (enumerate, 0));
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        Query::new(baked, &settings).answer(
            Request::new(playhead, attack),
            &mut context,
            &mut answer,
        );
        answer
    };
    let (answers, held) = held_at_most(|| {
        thread::scope(|scope| {
            let by_grid = scope.spawn(|| answer(Enumerate::default()));
            [answer(Enumerate::Whole), by_grid.join().unwrap()]
        })
    });
    assert!(held <= most, "{} MB", held / MB);
    for answer in &answers {
        assert!(!answer.candidates.is_empty());
        assert!(!answer.clearance().metres.is_nan());
    }
    let [whole, _] = answers;
    whole
}

#[test]
fn a_hundred_thousand_spheres_are_answered() {
    alone(|| {
        let mut random = Random::new(5);
        let mut share = |span: f32| (random.below(1000) as f32 / 1000.0 - 0.5) * span;
        let sphere = |_| {
            let from = Vec3::new(share(6.0), 1.2 + share(1.0), 3.0 + share(2.0));
            let to = Vec3::new(share(6.0), 1.2 + share(1.0), -3.0);
            vec![key(0.8, from, 0.05), key(1.3, to, 0.05)]
        };
        let attack = Attack::new((0..100_000).map(sphere).collect()).unwrap();
        let answer = answered(&attack, 512 * MB);
        assert!(!answer.avoided);
    });
}

#[test]
fn a_sphere_as_large_as_a_hall_for_ten_minutes_is_answered() {
    alone(|| {
        let hall = |t: usize| key(t as f32, Vec3::new((t % 2) as f32 * 90.0, 0.0, 0.0), 100.0);
        let attack = Attack::new(vec![(0..=600).map(hall).collect()]).unwrap();
        assert!(!answered(&attack, 512 * MB).avoided);
    });
}

#[test]
fn more_keys_than_there_may_be_are_refused() {
    alone(|| {
        let sphere = || vec![key(0.5, Vec3::Z, 0.1)];
        let (refused, held) =
            held_at_most(|| Attack::new((0..=Attack::MOST_KEYS).map(|_| sphere()).collect()));
        assert_eq!(
            refused.unwrap_err(),
            AttackError::TooMany(Attack::MOST_KEYS + 1)
        );
        assert!(held < 64 * MB, "{held}");
    });
}

#[test]
fn an_attack_that_starts_inside_the_body_now_is_a_hit() {
    alone(|| {
        let now = key(0.0, Vec3::new(0.0, 1.0, 0.0), 0.2);
        for keys in [
            vec![now],
            vec![now, key(0.5, now.center, 0.2)],
            vec![now, key(100.0, now.center, 0.2)],
        ] {
            let answer = answered(&Attack::new(vec![keys]).unwrap(), 64 * MB);
            assert!(!answer.avoided && answer.clearance().metres < 0.0);
        }
    });
}

#[test]
fn a_sphere_as_small_and_as_fast_as_numbers_go_is_answered() {
    alone(|| {
        let far = Vec3::new(0.0, 1.2, 9000.0);
        for radius in [f32::MIN_POSITIVE, 1e-20, 1e-3] {
            let keys = vec![
                key(0.7, far, radius),
                key(0.7000001, -far, radius),
                key(1.0, far, radius),
            ];
            answered(&Attack::new(vec![keys]).unwrap(), 64 * MB);
        }
    });
}
