//! Promise: a budget is kept, with the least error that it allows.

use sabaki_fixtures::lod::{random_levels, screen_error, setting_of};
use sabaki_fixtures::random::Random;
use sabaki_motion::lod::{
    Budget, Choice, Cost, LevelId, Levels, Measure, Planner, SwitchSettings, Switching,
};

fn budget(milliseconds: f32) -> Budget {
    Budget {
        milliseconds,
        cost: Cost {
            character: 100.0,
            joint: 30.0,
            blend: 60.0,
        },
        switching: SwitchSettings::default(),
        measure: Measure::Greatest,
    }
}

fn crowd(random: &mut Random, count: usize) -> Vec<f32> {
    (0..count)
        .map(|_| 1.0 + random.below(200_000) as f32 * 1e-3)
        .collect()
}

/// Character by character, milliseconds.
fn cost_of(levels: &Levels, choices: impl Iterator<Item = Choice>) -> f32 {
    let cost = budget(0.0).cost;
    let of = |choice: Choice| {
        let joints = levels.levels[choice.level.index()].kept.len() as f32;
        let blend = if choice.blend > 0.0 { cost.blend } else { 0.0 };
        f64::from(cost.character + joints * cost.joint + blend)
    };
    (choices.map(of).sum::<f64>() * 1e-6) as f32
}

#[test]
fn a_budget_is_kept_with_the_least_error() {
    let mut planner = Planner::default();
    let mut met = 0;
    for seed in 0..12 {
        let (_, _, levels) = random_levels(seed);
        let count = levels.levels.len();
        let distances = crowd(&mut Random::new(seed), 3000);
        let finest = 3000.0 * (100.0 + 30.0 * levels.levels[0].kept.len() as f32) * 1e-6;
        for share in [0.5, 0.7, 0.9, 2.0] {
            let budget = budget(finest * share);
            let plan = planner.plan(&levels, &distances, &budget).unwrap();
            for before in 0..3 {
                let before = |index: usize| match before {
                    0 => None,
                    1 => Some(LevelId(0)),
                    _ => Some(LevelId((index * 7 % count) as u16)),
                };
                let choices = distances.iter().enumerate();
                let choices = choices
                    .map(|(index, &distance)| planner.switching().choose(distance, before(index)));
                let cost = cost_of(&levels, choices);
                assert!(cost <= plan.milliseconds * 1.0001, "{cost} {plan:?}");
            }
            assert_eq!(plan.is_met, plan.milliseconds <= budget.milliseconds);
            // No error that is clearly smaller would do, and where none would do, none is promised.
            let mut tries = (0..400).map(|step| 1e-3 * 1.05f32.powi(step));
            let fits = |pixels: &f32| {
                let mut settings = budget.switching;
                settings.rule = screen_error(*pixels);
                let switching = Switching::new(&levels, &settings).unwrap();
                let choose = |&distance: &f32| switching.choose(distance, Some(LevelId(0)));
                let cost = cost_of(&levels, distances.iter().map(choose));
                cost <= 0.995 * budget.milliseconds
            };
            if let Some(least) = tries.find(fits) {
                let is_least = plan.pixels <= 1.06 * least;
                assert!(plan.is_met && is_least, "{plan:?} {least}");
                met += 1;
            }
        }
    }
    assert!(met > 20, "{met} of 48 budgets could be met");
}

#[test]
fn a_crowd_of_none_and_a_lone_joint_have_plans() {
    let (_, _, levels) = random_levels(4);
    let plan = Planner::default().plan(&levels, &[], &budget(0.0)).unwrap();
    assert!(plan.is_met && plan.milliseconds == 0.0);
    let (skeleton, _, _) = random_levels(4);
    let lone = Levels::in_order(&skeleton, &[]).unwrap();
    let switching = Switching::new(&lone, &SwitchSettings::default()).unwrap();
    assert_eq!(switching.furthest(), 0.0);
    for distance in [-1.0, 0.0, 1e9, f32::NAN] {
        let choice = switching.choose(distance, Some(LevelId(7)));
        assert_eq!((choice.level, choice.blend), (LevelId(0), 0.0));
    }
    let odd = [f32::NAN, -3.0, f32::INFINITY, 0.0];
    let plan = Planner::default().plan(&lone, &odd, &budget(1.0)).unwrap();
    assert!(plan.is_met);
}

#[test]
fn budgets_that_make_no_sense_are_errors() {
    let (_, _, levels) = random_levels(1);
    for wrong in [-0.1, 1.0, f32::NAN] {
        let mut planner = Planner::default();
        let mut fails = |change: &dyn Fn(&mut Budget)| {
            let mut budget = budget(1.0);
            change(&mut budget);
            setting_of(planner.plan(&levels, &[1.0], &budget).unwrap_err())
        };
        let wrong = -wrong.abs();
        assert_eq!(fails(&|b| b.milliseconds = wrong), "milliseconds");
        assert_eq!(fails(&|b| b.cost.joint = wrong), "joint");
        assert_eq!(fails(&|b| b.cost.character = wrong), "character");
        assert_eq!(fails(&|b| b.cost.blend = wrong), "blend");
        assert_eq!(fails(&|b| b.switching.hysteresis = -1.0), "hysteresis");
    }
}
