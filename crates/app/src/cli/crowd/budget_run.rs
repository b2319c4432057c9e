//! A crowd that is kept within a budget while the camera runs through it.

use std::time::Instant;

use sabaki::crowd::Frame;
use sabaki::lod::{Budget, Cost, CostMonitor, Measure, Plan, Planner, SwitchSettings};
use sabaki::math::F32x16;
use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

use super::cases::{Case, Lod, Motion, TimedWork};
use super::row::Row;
use super::scene::{SECONDS, Scene};
use super::{Args, usage};
use crate::cli::{Failure, cancel};

/// Number of frames that are measured.
const FRAMES: u32 = 2000;
/// Number of frames before, from which the costs are learned.
const LEARNING: u32 = 240;
/// Error on the screen of the first frame, in pixels: few joints, so that costs are learned within the budget.
const FIRST_PIXELS: f32 = 8.0;
/// The default budget in times of a frame whose levels are chosen by `--error`, without a plan.
const SHARE: f64 = 2.0;

/// Times of the frames, and errors of the bodies on the screen.
pub(super) struct BudgetRun {
    budget: f64,
    /// Duration of each frame, in milliseconds: distances, plan, levels and poses.
    frames: Vec<f64>,
    /// Duration of each frame's plan, in milliseconds.
    plans: Vec<f64>,
    /// Greatest error on the screen that each plan allows, in pixels.
    pixels: Vec<f64>,
}

impl Scene {
    /// Runs through the column with the budget that was asked for. `rows` tell what joints cost.
    pub(super) fn run_in_budget(&self, args: &Args, rows: &[Row]) -> Result<BudgetRun, Failure> {
        let plain = PlainRows::of(rows, self.animations.levels());
        let case = Case {
            what: TimedWork::Frame(Motion::Run),
            lod: Lod::Distance,
            ..Case::plain()
        };
        let unplanned = rows.iter().find(|row| row.case == case);
        let unplanned = unplanned.map_or(1.0, |row| row.ms);
        let budget_ms = args.budget.map_or(SHARE * unplanned, f64::from);
        let mut budget = Budget {
            milliseconds: budget_ms as f32,
            cost: plain.cost(args),
            switching: SwitchSettings::default(),
            measure: Measure::Greatest,
            before: Some(FIRST_PIXELS),
        };
        let cost = budget.cost;
        let case = Case {
            lod: Lod::Off,
            ..case
        };
        let (mut planner, mut monitor) = (Planner::default(), CostMonitor::default());
        let (mut crowd, _) = self.crowd(args, case)?;
        let mut out = vec![F32x16::ZERO; crowd.max_output_len(crowd.len())];
        let mut distances = Vec::with_capacity(self.characters.len());
        let mut run = BudgetRun {
            budget: budget_ms,
            frames: Vec::with_capacity(FRAMES as usize),
            plans: Vec::with_capacity(FRAMES as usize),
            pixels: Vec::with_capacity(FRAMES as usize),
        };
        for frame in 0..LEARNING + FRAMES {
            cancel::check()?;
            let started = Instant::now();
            let eye = self.eye(Motion::Run, frame);
            distances.clear();
            let positions = self.characters.iter().map(|it| it.placement.position());
            distances.extend(positions.map(|position| eye.distance(position)));
            budget.cost = monitor.corrected(&cost);
            let plan = planner
                .plan(&self.levels, &distances, &budget)
                .map_err(usage)?;
            budget.before = Some(plan.pixels);
            let planned = started.elapsed().as_secs_f64();
            let frame_input = Frame {
                seconds: SECONDS,
                switching: Some(planner.switching()),
                eye,
                ..Frame::default()
            };
            crowd.frame(&frame_input, &mut out).map_err(usage)?;
            let taken = started.elapsed().as_secs_f64();
            monitor.observe(&plan, (taken * 1e3) as f32);
            if frame >= LEARNING {
                run.frames.push(taken * 1e3);
                run.plans.push(planned * 1e3);
                run.pixels.push(f64::from(plan.pixels));
            }
        }
        Ok(run)
    }
}

/// Poses of all characters on the finest and on the coarsest level.
struct PlainRows<'a> {
    finest: Option<&'a Row>,
    coarsest: Option<&'a Row>,
}

impl<'a> PlainRows<'a> {
    fn of(rows: &'a [Row], levels: usize) -> Self {
        let plain = |lod: Lod| rows.iter().find(|row| is_plain_pose(&row.case, lod));
        Self {
            finest: plain(Lod::Off),
            coarsest: plain(Lod::Level(levels.saturating_sub(1) as u16)),
        }
    }

    /// Measures the costs of characters and of joints.
    fn cost(&self, args: &Args) -> Cost {
        let count = f64::from(args.count);
        let (Some(finest), Some(coarsest)) = (self.finest, self.coarsest) else {
            return Cost {
                character: 0.0,
                joint: self.finest.map_or(1.0, |row| row.per_joint(args)) as f32,
                blend: 0.0,
            };
        };
        let joints = (finest.joints - coarsest.joints).max(1.0);
        let joint = ((finest.ms - coarsest.ms) / joints * 1e6 / count).max(0.0);
        let character = coarsest.ms * 1e6 / count - joint * coarsest.joints;
        Cost {
            character: character.max(0.0) as f32,
            joint: joint as f32,
            // A joint between two levels is computed twice.
            blend: joint as f32,
        }
    }
}

/// Poses of one level in blocks, on one thread and the widest registers.
fn is_plain_pose(case: &Case, lod: Lod) -> bool {
    let plain = Case {
        lod,
        ..Case::plain()
    };
    *case == plain
}

impl BudgetRun {
    fn over(&self) -> f64 {
        let over = self.frames.iter();
        let over = over.filter(|&&ms| ms > self.budget).count();
        over as f64 / self.frames.len().max(1) as f64
    }

    fn shares(values: &[f64]) -> Value {
        let at = |share: f64| percentile(values.to_vec(), share);
        json!({ "median": at(0.5), "p99": at(0.99), "greatest": at(1.0) })
    }

    /// A percentile of the errors on the screen, in pixels; `None` where the plan allows any error.
    fn pixels(&self, share: f64) -> Option<f64> {
        let pixels = percentile(self.pixels.clone(), share);
        (pixels < f64::from(Plan::MOST_PIXELS)).then_some(pixels)
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "budget_ms": self.budget,
            "frames": self.frames.len(),
            "share_over_budget": self.over(),
            "frame_ms": Self::shares(&self.frames),
            "plan_ms": Self::shares(&self.plans),
            "error_pixels": {
                "median": self.pixels(0.5),
                "p99": self.pixels(0.99),
                "greatest": self.pixels(1.0),
            },
        })
    }

    pub(super) fn describe(&self) -> String {
        let at = |values: &[f64], share: f64| percentile(values.to_vec(), share);
        let pixels = |share: f64| match self.pixels(share) {
            Some(pixels) => format!("{pixels:.1} pixels"),
            None => "without limit (all on the coarsest level)".to_owned(),
        };
        format!(
            "budget of {:.3} ms, camera running, {} frames: {:.3} ms in the median, {:.3} at 99%, {:.3} at most (plan {:.3}); \
             {:.1}% over the budget; error on the screen {} in the median, {} at most",
            self.budget,
            self.frames.len(),
            at(&self.frames, 0.5),
            at(&self.frames, 0.99),
            at(&self.frames, 1.0),
            at(&self.plans, 0.5),
            100.0 * self.over(),
            pixels(0.5),
            pixels(1.0),
        )
    }
}
