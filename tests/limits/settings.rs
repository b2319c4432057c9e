//! Settings and playheads that no program means.

use glam::Vec3;
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::{BakeError, BakeSettings, Baker, SphereKey};
use sabaki::math::Rigid2;
use sabaki::query::{
    Answer, Attack, AttackError, Evaluation, Query, QueryContext, QuerySettings, Request,
};

use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::small::small;
use sabaki_fixtures::throw::key;
use sabaki_fixtures::with;

/// A way to spoil what a bake is asked for.
type SpoilBake = fn(&mut BakeSettings);

/// A way to spoil a float of the settings.
type Spoil = fn(&mut QuerySettings, f32);

/// The first five are out of every range.
const EXTREMES: [f32; 8] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -1e30,
    1e30,
    0.0,
    -1.0,
    f32::MIN_POSITIVE,
];

const FLOATS: [(&str, Spoil); 10] = [
    ("rates.slowest", |s, v| s.rates.slowest = v),
    ("rates.fastest", |s, v| s.rates.fastest = v),
    ("rates.tolerance", |s, v| s.rates.tolerance = v),
    ("alike_distance", |s, v| s.alike_distance = v),
    ("alike_angle", |s, v| s.alike_angle = v),
    ("moves.alike_distance", |s, v| s.moves.alike_distance = v),
    ("moves.alike_angle", |s, v| s.moves.alike_angle = v),
    ("weights.avoid", |s, v| s.weights.avoid = v),
    ("weights.distance", |s, v| s.weights.distance = v),
    ("weights.time", |s, v| s.weights.time = v),
];

/// Floats that have no range.
const OTHERS: [Spoil; 5] = [
    |s, v| s.rates.nearest = v,
    |s, v| s.entries.slowest = v,
    |s, v| s.entries.fastest = v,
    |s, v| s.entries.longest_delay = v,
    |s, v| s.weights.warp = v,
];

fn ball(t: f32, radius: f32) -> Vec<Vec<SphereKey>> {
    let at = |t, z| key(t, Vec3::new(0.0, 1.0, z), radius);
    vec![vec![at(t, 2.0), at(t + 0.4, -1.0)]]
}

/// Balls that are avoided, balls that are not, and one that nothing but a move can answer.
fn ask(settings: &QuerySettings, playhead: Playhead) {
    let (mut context, mut answer) = (QueryContext::default(), Answer::default());
    for seconds in [0.05, 0.3, 0.8] {
        let attack = Attack::new(ball(seconds, 0.1)).unwrap();
        for evaluation in [Evaluation::Lazy, Evaluation::Exhaustive] {
            let mut request = Request::new(playhead, &attack);
            request.evaluation = evaluation;
            Query::new(small(), settings).answer(request, &mut context, &mut answer);
            assert!(answer.chosen < answer.candidates.len());
        }
    }
}

fn at(frame: f32, place: Rigid2) -> Playhead {
    Playhead::at(small().graph(), EdgeId(0), frame, place)
}

#[test]
fn query_settings_out_of_range_are_refused_by_name_and_crash_nothing() {
    assert_eq!(QuerySettings::default().check(), Ok(()));
    for (name, spoil) in FLOATS {
        for value in &EXTREMES[..5] {
            let mut settings = QuerySettings::default();
            spoil(&mut settings, *value);
            let error = Query::checked(small(), &settings).unwrap_err();
            assert_eq!(error.name, name);
            assert!(error.to_string().contains("must be"), "{error}");
        }
    }
    for spoil in FLOATS.iter().map(|(_, spoil)| spoil).chain(&OTHERS) {
        for value in EXTREMES {
            let mut settings = QuerySettings::default();
            spoil(&mut settings, value);
            ask(&settings, at(0.0, Rigid2::IDENTITY));
        }
    }
    let none = with(|s: &mut QuerySettings| s.most_evasions = 0);
    assert_eq!(none.check().unwrap_err().name, "most_evasions");
    ask(&none, at(0.0, Rigid2::IDENTITY));
    let mut many = QuerySettings::default();
    many.moves.width = usize::MAX;
    assert_eq!(many.check().unwrap_err().name, "moves.width");
    many.moves.width = 0;
    many.moves.candidates = 0;
    ask(&many, at(0.0, Rigid2::IDENTITY));
}

#[test]
fn a_playhead_at_no_place_crashes_nothing() {
    for frame in [f32::NAN, f32::INFINITY, -1e30, 1e30] {
        ask(&QuerySettings::default(), at(frame, Rigid2::IDENTITY));
    }
    for place in [f32::NAN, f32::INFINITY, 1e30] {
        let world = Rigid2::new(place, place, -place);
        ask(&QuerySettings::default(), at(0.0, world));
    }
}

#[test]
fn attacks_of_impossible_numbers_are_refused_by_place() {
    let refused = |keys| Attack::new(keys).unwrap_err();
    let at = |key| AttackError::Value { sphere: 0, key };
    for radius in [0.0, -0.1, 100.1, f32::NAN, f32::INFINITY] {
        assert_eq!(refused(ball(0.8, radius)), at(0));
    }
    for t in [-1e-6, -1.0, 600.1, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(refused(ball(t, 0.1)), at(0));
    }
    for place in [f32::NAN, f32::INFINITY, 1e5] {
        let mut keys = ball(0.8, 0.1);
        keys[0][1].center.x = place;
        assert_eq!(refused(keys), at(1));
    }
    let text = refused(ball(-1.0, 0.1)).to_string();
    let has_limits = text.contains("0 to 600 s") && text.contains("at most 100 m");
    assert!(has_limits, "{text}");
}

#[test]
fn bake_settings_out_of_range_are_refused_by_name() {
    let spoils: [(&str, SpoilBake); 7] = [
        ("retime.window", |s| s.retime.window = f64::NAN),
        ("retime.slow", |s| s.retime.slow = -1.0),
        ("retime.fast", |s| s.retime.fast = f32::INFINITY),
        ("paths.horizon", |s| s.paths.horizon = f32::NAN),
        ("paths.alike_distance", |s| s.paths.alike_distance = 0.0),
        ("paths.alike_angle", |s| s.paths.alike_angle = f32::NAN),
        ("paths.most", |s| s.paths.most = 0),
    ];
    for (wrong, spoil) in spoils {
        let mut settings = BakeSettings::default();
        spoil(&mut settings);
        match Baker::new(embedded().graph().clone(), settings).map(|_| ()) {
            Err(BakeError::Setting { name, .. }) => assert_eq!(name, wrong),
            other => panic!("{wrong}: {other:?}"),
        }
    }
    assert!(!embedded().evasions().is_empty());
}
