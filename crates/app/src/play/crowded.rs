//! Many characters in one frame.

use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use sabaki::character::{
    CharacterError, CharacterEvent, CharacterEventKind, CharacterId, CharacterSettings, Characters,
    CrowdPoseSettings, Goal, Threat,
};
use sabaki::crowd::CrowdError;
use sabaki::lod::{LevelSettings, Levels, SwitchSettings, Switching};
use sabaki::maps::BakedGraph;
use sabaki::math::{F32x16, Rigid2};
use sabaki::query::Obstacle;

use super::{FRAME, joints_of, percentile};

/// Times of many characters.
#[derive(Clone, Copy, Debug, Default)]
pub struct CrowdedTimes {
    /// Median time of a step in which each of 200 characters is newly threatened, in milliseconds.
    pub batch_200_ms: f32,
    /// Duration of the longest step with at most [`PLANS_PER_STEP`] plans in a step, in milliseconds.
    pub budget_200_ms: f32,
    /// Number of steps until all 200 have planned, with at most [`PLANS_PER_STEP`] plans in a step.
    pub budget_steps: usize,
    /// Duration of the longest step with at most [`PLAN_MILLISECONDS`] for plans in a step, in milliseconds.
    pub timed_200_ms: f32,
    /// Number of steps until all 200 have planned, with at most [`PLAN_MILLISECONDS`] for plans in a step.
    pub timed_steps: usize,
    /// Time of a step in which one character looks at a new threat, without obstacles and with 100 near it.
    pub plan: [PlanTimes; 2],
    /// Mean time of a frame in which 200 characters are steered and posed on one thread, for each, in microseconds.
    pub us_per_character: f32,
    /// Times of a crowd's frame.
    pub crowd: CrowdTimes,
}

/// Mean times of a frame of [`CROWD`] characters that walk, on one thread, for each character, in microseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct CrowdTimes {
    /// Time of a step.
    pub step: f32,
    /// Time of the poses, one character after the other with all joints.
    pub one_by_one: f32,
    /// Time of the poses of all characters at once, on levels of detail seen from the edge of the crowd.
    pub all_at_once: f32,
    /// Share of the characters that the crowd's kernels pose when all are posed at once.
    pub by_crowd: f32,
}

/// Number of characters of [`CrowdTimes`].
pub const CROWD: usize = 1_000;

/// Times of steps in which one character looks at a new threat, in milliseconds. A step counts whole, with all queries of the plan.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlanTimes {
    /// Median and 99th percentile of all steps.
    pub all: [f32; 2],
    /// Median and 99th percentile of the steps in which the present motion could not be kept.
    pub needed: [f32; 2],
}

const COUNT: usize = 200;

/// Time for the plans of one step, where there is a budget of time, in milliseconds.
pub const PLAN_MILLISECONDS: f32 = 8.0;

/// Plans of one step, where there is a budget.
pub const PLANS_PER_STEP: usize = 4;

/// Steers 200 characters, and threatens all of them in one frame, several times.
///
/// # Errors
/// A graph in which nothing can be played.
pub fn crowded(baked: &Arc<BakedGraph>, threads: usize) -> Result<CrowdedTimes, CharacterError> {
    /// Frames that are steered, and frames in which all are threatened.
    const STEERED: usize = 300;
    const BATCHES: usize = 7;
    let settings = CharacterSettings {
        threads: 1,
        ..CharacterSettings::default()
    };
    let (mut joints, mut events) = (Vec::new(), Vec::new());
    let (mut characters, ids) = walking(baked, settings, COUNT)?;
    let started = Instant::now();
    for frame in 0..STEERED {
        turn_in_turn(&mut characters, &ids, frame)?;
        characters.step(FRAME, &[], &mut events);
        for &id in &ids {
            joints_of(&mut characters, id, &mut joints)?;
        }
    }
    let us = started.elapsed().as_secs_f32() * 1e6 / (STEERED * COUNT) as f32;
    let settings = CharacterSettings {
        threads,
        ..CharacterSettings::default()
    };
    let mut times = Vec::new();
    let (mut characters, ids) = walking(baked, settings, COUNT)?;
    for _ in 0..BATCHES {
        threaten_all(&mut characters, &ids)?;
        let started = Instant::now();
        characters.step(FRAME, &[], &mut events);
        times.push(started.elapsed().as_secs_f32() * 1e3);
    }
    let steps = steps_to_plan(
        baked,
        CharacterSettings {
            plans_per_step: PLANS_PER_STEP,
            ..settings
        },
    )?;
    let timed = steps_to_plan(
        baked,
        CharacterSettings {
            plans_per_step: usize::MAX,
            plan_milliseconds: PLAN_MILLISECONDS,
            ..settings
        },
    )?;
    Ok(CrowdedTimes {
        timed_200_ms: percentile(timed.clone(), 1.0),
        timed_steps: timed.len(),
        plan: [plan_times(baked, 0)?, plan_times(baked, 100)?],
        batch_200_ms: percentile(times, 0.5),
        budget_200_ms: percentile(steps.clone(), 1.0),
        budget_steps: steps.len(),
        us_per_character: us,
        crowd: crowd_times(baked)?,
    })
}

/// Durations of the steps in which 200 newly threatened characters plan, in milliseconds.
fn steps_to_plan(
    baked: &Arc<BakedGraph>,
    settings: CharacterSettings,
) -> Result<Vec<f32>, CharacterError> {
    let (mut characters, ids) = walking(baked, settings, COUNT)?;
    threaten_all(&mut characters, &ids)?;
    let (mut steps, mut events, mut planned) = (Vec::new(), Vec::new(), 0);
    while planned < COUNT && steps.len() < COUNT {
        events.clear();
        let started = Instant::now();
        characters.step(FRAME, &[], &mut events);
        steps.push(started.elapsed().as_secs_f32() * 1e3);
        planned += events.iter().filter(|event| looks(event)).count();
    }
    Ok(steps)
}

/// Steps and poses many characters that walk.
fn crowd_times(baked: &Arc<BakedGraph>) -> Result<CrowdTimes, CharacterError> {
    const FRAMES: usize = 100;
    let (mut characters, ids) = walking(baked, CharacterSettings::default(), CROWD)?;
    let graph = baked.graph();
    let levels = Levels::build(graph.skeleton(), graph.clips(), &LevelSettings::default());
    let levels = levels.map_err(CrowdError::from)?;
    let switching =
        Switching::new(&levels, &SwitchSettings::default()).map_err(CrowdError::from)?;
    let settings = CrowdPoseSettings {
        switching,
        ..CrowdPoseSettings::default()
    };
    characters.use_crowd(&levels, settings)?;
    let mut out = vec![F32x16::ZERO; characters.max_output_len(ids.len())];
    let eye = Vec3::new(-5.0, 1.7, -5.0);
    let (mut joints, mut events) = (Vec::new(), Vec::new());
    let mut times = CrowdTimes::default();
    let each = |started: Instant| started.elapsed().as_secs_f32() * 1e6 / (FRAMES * CROWD) as f32;
    for frame in 0..FRAMES {
        turn_in_turn(&mut characters, &ids, frame)?;
        let started = Instant::now();
        characters.step(FRAME, &[], &mut events);
        times.step += each(started);
        let started = Instant::now();
        for &id in &ids {
            joints_of(&mut characters, id, &mut joints)?;
        }
        times.one_by_one += each(started);
        let started = Instant::now();
        characters.pose_all(eye, &mut out)?;
        times.all_at_once += each(started);
        for &id in &ids {
            let by_crowd = characters.is_posed_by_crowd(id)?;
            times.by_crowd += f32::from(u8::from(by_crowd)) / (FRAMES * CROWD) as f32;
        }
    }
    Ok(times)
}

/// Throws a ball at each character, after they have walked on for a while.
fn threaten_all(characters: &mut Characters, ids: &[CharacterId]) -> Result<(), CharacterError> {
    let (mut joints, mut events) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        characters.step(FRAME, &[], &mut events);
    }
    for &id in ids {
        joints_of(characters, id, &mut joints)?;
        let middle = joints[0].translation;
        let from = Vec3::new(3.0, 0.2, 1.0);
        let ball = Threat::ball(characters.now() + 0.4, middle + from, -from * 3.0, 0.1);
        characters.threaten(Threat {
            target: Some(id),
            seconds: 1.0,
            ..ball
        })?;
    }
    Ok(())
}

fn walk(heading: f32) -> Goal {
    Goal::Walk {
        velocity: Vec3::new(heading.sin(), 0.0, heading.cos()) * 1.3,
        facing: None,
    }
}

/// Gives each character a new direction every second, some in each frame.
fn turn_in_turn(
    characters: &mut Characters,
    ids: &[CharacterId],
    frame: usize,
) -> Result<(), CharacterError> {
    for (index, &id) in ids.iter().enumerate() {
        if (frame + index).is_multiple_of(60) {
            characters.steer(id, walk((frame + 7 * index) as f32 * 0.7))?;
        }
    }
    Ok(())
}

type Walking = (Characters, Vec<CharacterId>);

/// Characters in a grid, each walking somewhere.
fn walking(
    baked: &Arc<BakedGraph>,
    settings: CharacterSettings,
    count: usize,
) -> Result<Walking, CharacterError> {
    let mut characters = Characters::new(Arc::clone(baked), settings)?;
    let mut ids = Vec::new();
    for index in 0..count {
        let (x, z) = ((index % 20) as f32 * 10.0, (index / 20) as f32 * 10.0);
        let id = characters.spawn(Rigid2::new(index as f32, x, z))?;
        characters.steer(id, walk(index as f32))?;
        ids.push(id);
    }
    let mut events = Vec::new();
    for _ in 0..30 {
        characters.step(FRAME, &[], &mut events);
    }
    Ok((characters, ids))
}

/// Whether an event is the first of a plan.
fn looks(event: &CharacterEvent) -> bool {
    matches!(
        event.kind,
        CharacterEventKind::Planned { .. }
            | CharacterEventKind::Kept { .. }
            | CharacterEventKind::Cannot
            | CharacterEventKind::Cornered { .. }
    )
}

/// Times of the steps in which one character looks at a new threat among obstacles. All rounds are in one pool, as in a game.
fn plan_times(baked: &Arc<BakedGraph>, obstacles: usize) -> Result<PlanTimes, CharacterError> {
    const ROUNDS: usize = 200;
    let (mut joints, mut events) = (Vec::new(), Vec::new());
    let (mut times, mut needed) = (Vec::new(), Vec::new());
    let mut game = Characters::new(Arc::clone(baked), CharacterSettings::default())?;
    for round in 0..ROUNDS {
        let id = game.spawn(Rigid2::new(round as f32, 0.0, 0.0))?;
        game.steer(id, walk(round as f32 * 0.7))?;
        for _ in 0..40 + round % 30 {
            game.step(FRAME, &[], &mut events);
        }
        joints_of(&mut game, id, &mut joints)?;
        let middle = joints[0].translation;
        let discs = (0..obstacles).filter_map(|index| {
            let way = Vec2::from_angle(index as f32 * 2.4);
            let far = 1.2 + 4.0 * index as f32 / obstacles as f32;
            let place = Vec2::new(middle.x, middle.z) + way * far;
            Obstacle::disc(place, 0.2).ok()
        });
        let discs: Vec<Obstacle> = discs.collect();
        game.step(FRAME, &discs, &mut events);
        let from = Vec3::new(3.0, 0.2, 1.0);
        let ball = Threat::ball(game.now() + 0.4, middle + from, -from * 3.0, 0.1);
        let ball = game.threaten(ball)?;
        events.clear();
        let started = Instant::now();
        game.step(FRAME, &discs, &mut events);
        let milliseconds = started.elapsed().as_secs_f32() * 1e3;
        game.remove(ball)?;
        game.despawn(id)?;
        if events.iter().any(looks) {
            times.push(milliseconds);
            let is_kept =
                |event: &CharacterEvent| matches!(event.kind, CharacterEventKind::Kept { .. });
            if !events.iter().any(is_kept) {
                needed.push(milliseconds);
            }
        }
    }
    let percentiles = |times: &[f32]| [0.5, 0.99].map(|share| percentile(times.to_vec(), share));
    Ok(PlanTimes {
        all: percentiles(&times),
        needed: percentiles(&needed),
    })
}
