//! `sabaki play`: a game without a window, measured.

use std::path::PathBuf;
use std::sync::Arc;

use sabaki::math::in_parallel;
use sabaki_app::play::{
    CROWD, CrowdedTimes, IdleReport, Outcome, PLAN_MILLISECONDS, PLANS_PER_STEP, PlayError,
    Scenario, Scenarios, Sight, SteerReport, Surroundings, crowded, idle,
};
use serde_json::{Value, json};

use super::bake::GraphArgs;
use super::numbers::whole;
use super::{Done, Failure, cancel, output};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    graph: GraphArgs,
    /// Number of attacks of each kind.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = whole::<u64>(1..=1_000_000))]
    threats: u64,
    /// Seed of the attacks and of the changes of direction.
    #[arg(long, value_name = "S", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Number of threads; 0 for all of the machine. Only times depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Writes what characters play to a folder, as BVH at 60 Hz, a file a minute: steering, threats, idle. It then measures as usual.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// Kinds of attacks, in the order of the table.
const ROWS: [(&str, Scenario); 10] = [
    ("one", scenario(1, Sight::Known)),
    ("two", scenario(2, Sight::Known)),
    ("three", scenario(3, Sight::Known)),
    ("flying", scenario(1, Sight::Flying)),
    ("noise", scenario(1, Sight::Noisy)),
    ("feint", scenario(1, Sight::Feint)),
    ("feint_known", scenario(1, Sight::FeintKnown)),
    ("delayed", scenario(1, Sight::Known)),
    ("walls", among(Surroundings::Walls)),
    ("opponents", among(Surroundings::Opponents)),
];

const fn scenario(balls: usize, sight: Sight) -> Scenario {
    Scenario {
        balls,
        sight,
        delay: 0,
        around: Surroundings::Empty,
    }
}

const fn among(around: Surroundings) -> Scenario {
    Scenario {
        around,
        ..scenario(1, Sight::Known)
    }
}

/// Results of one kind of attack.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    attacks: u32,
    avoided: u32,
    pops: u32,
    largest_pop: f32,
    takeovers: u32,
    /// Number of attacks during which the body entered an obstacle.
    entered: u32,
    /// Deepest entry, in metres.
    deepest: f32,
    cornered: u32,
    /// Number of attacks by number of changes of plan; the last entry counts all that have more.
    changes: [u32; 8],
}

struct Report {
    rows: Vec<Row>,
    steer: SteerReport,
    idle: IdleReport,
    times: CrowdedTimes,
}

fn refused(error: impl Into<PlayError>) -> Failure {
    Failure::Usage(error.into().to_string())
}

pub(crate) fn run(args: &Args, as_json: bool) -> Result<Done, Failure> {
    let baked = Arc::new(args.graph.load()?);
    let threads = args.threads as usize;
    cancel::listen();
    let bar = output::progress("playing", args.threats * ROWS.len() as u64);
    let scenarios = Scenarios::new(&baked, args.seed).map_err(refused)?;
    if let Some(folder) = &args.record {
        scenarios.record(folder, threads).map_err(refused)?;
    }
    let mut rows = Vec::new();
    for (name, scenario) in ROWS {
        let of = |index: usize| {
            cancel::check()?;
            let delay = match name {
                "delayed" => 1 + index as u32 % 6,
                _ => 0,
            };
            let scenario = Scenario { delay, ..scenario };
            let outcome = scenarios.run(scenario, index as u64);
            bar.inc(1);
            outcome.map_err(refused)
        };
        let mut row = Row::default();
        for outcome in in_parallel(threads, args.threats as usize, of) {
            row.add(&outcome?);
        }
        rows.push(row);
    }
    let changers = (args.threats as usize).clamp(4, 100);
    let steer = scenarios.steer(changers, threads).map_err(refused)?;
    cancel::check()?;
    let idle = idle(&baked, threads).map_err(refused)?;
    cancel::check()?;
    let report = Report {
        rows,
        steer,
        idle,
        times: crowded(&baked, threads).map_err(refused)?,
    };
    bar.finish_and_clear();
    Ok(Done::ok(match as_json {
        true => Done::json(&report.document()),
        false => report.text(),
    }))
}

impl Row {
    fn add(&mut self, outcome: &Outcome) {
        self.attacks += 1;
        self.avoided += u32::from(outcome.avoided);
        self.pops += outcome.pops;
        self.takeovers += outcome.takeovers;
        self.entered += u32::from(outcome.entered > 0.0);
        self.deepest = self.deepest.max(outcome.entered);
        self.cornered += u32::from(outcome.cornered > 0);
        self.largest_pop = self.largest_pop.max(outcome.largest_pop);
        if outcome.plans > 0 {
            let most = self.changes.len() - 1;
            self.changes[most.min(outcome.changes as usize)] += 1;
        }
    }

    fn share(&self) -> f64 {
        f64::from(self.avoided) / f64::from(self.attacks.max(1))
    }

    /// Median number of changes of plan, of the attacks that were planned for.
    fn changes_median(&self) -> usize {
        let all: u32 = self.changes.iter().sum();
        let mut sum = 0;
        let reaches = |count: &u32| {
            sum += count;
            2 * sum >= all
        };
        self.changes.iter().position(reaches).unwrap_or(0)
    }
}

fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

impl Report {
    fn row(&self, name: &str) -> Row {
        let place = ROWS.iter().position(|(of, _)| *of == name);
        place.map_or_else(Row::default, |place| self.rows[place])
    }

    fn pops(&self) -> (u32, f32) {
        self.rows.iter().fold((0, 0.0), |(pops, largest), row| {
            (pops + row.pops, f32::max(largest, row.largest_pop))
        })
    }

    /// Number of attacks during which the body entered an obstacle, and the deepest entry, in metres.
    fn entered(&self) -> (u32, f32) {
        self.rows.iter().fold((0, 0.0), |(count, deepest), row| {
            (count + row.entered, f32::max(deepest, row.deepest))
        })
    }

    fn feints_kept(&self) -> f64 {
        self.row("feint").share() / self.row("feint_known").share().max(1e-9)
    }

    fn document(&self) -> Value {
        let share = |name: &str| round(self.row(name).share());
        let (pops, largest) = self.pops();
        let Self {
            steer, idle, times, ..
        } = self;
        let number = |value: f32| round(f64::from(value));
        let takeovers: u32 = self.rows.iter().map(|row| row.takeovers).sum();
        json!({
            "threats": self.row("one").attacks,
            "pops_over_5mm": pops,
            "largest_pop_mm": number(1e3 * largest),
            "takeovers": takeovers,
            "avoided": {
                "one": share("one"),
                "two": share("two"),
                "three": share("three"),
                "flying": share("flying"),
                "noise": share("noise"),
                "feint": share("feint"),
                "feint_known": share("feint_known"),
                "delayed": share("delayed"),
                "walls": share("walls"),
                "opponents": share("opponents"),
            },
            "entered_obstacles": self.entered().0,
            "deepest_entry_mm": number(1e3 * self.entered().1),
            "cornered": {
                "walls": self.row("walls").cornered,
                "opponents": self.row("opponents").cornered,
            },
            "plan_changes_median": self.row("noise").changes_median(),
            "feints_kept": round(self.feints_kept()),
            "steer": {
                "speed_error": number(steer.speed_error),
                "heading_settle_s": {
                    "median": number(steer.settle_median),
                    "p95": number(steer.settle_p95),
                    "unsettled": number(steer.unsettled),
                },
                "path_error_m": number(steer.path_error),
                "path_error_max_m": number(steer.path_error_max),
            },
            "idle_events_per_hour": number(idle.events_per_hour),
            "idle_repeated": number(idle.repeated),
            "idle_drift_m": number(idle.drift),
            "idle_in_step": number(idle.in_step),
            "batch_200_ms": number(times.batch_200_ms),
            "batch_200_budget": {
                "plans_per_step": PLANS_PER_STEP,
                "worst_step_ms": number(times.budget_200_ms),
                "steps": times.budget_steps,
            },
            "batch_200_timed": {
                "budget_ms": PLAN_MILLISECONDS,
                "worst_step_ms": number(times.timed_200_ms),
                "steps": times.timed_steps,
            },
            "plan_ms": {
                "median": number(times.plan[0].all[0]),
                "p99": number(times.plan[0].all[1]),
                "median_needed": number(times.plan[0].needed[0]),
                "p99_needed": number(times.plan[0].needed[1]),
                "median_100_obstacles": number(times.plan[1].all[0]),
                "p99_100_obstacles": number(times.plan[1].all[1]),
                "median_needed_100_obstacles": number(times.plan[1].needed[0]),
                "p99_needed_100_obstacles": number(times.plan[1].needed[1]),
            },
            "us_per_character": number(times.us_per_character),
            "crowd": {
                "characters": CROWD,
                "us_step": number(times.crowd.step),
                "us_pose_one_by_one": number(times.crowd.one_by_one),
                "us_pose_all": number(times.crowd.all_at_once),
                "posed_by_crowd": number(times.crowd.by_crowd),
            },
        })
    }

    fn text(&self) -> String {
        let mut table = output::table(&["attack", "attacks", "avoided", "changes of plan"], 1);
        for ((name, _), row) in ROWS.iter().zip(&self.rows) {
            table.add_row([
                (*name).replace('_', " "),
                row.attacks.to_string(),
                format!("{:.1}%", 100.0 * row.share()),
                row.changes_median().to_string(),
            ]);
        }
        let ((pops, largest), (entered, deepest)) = (self.pops(), self.entered());
        let Self {
            steer, idle, times, ..
        } = self;
        format!(
            "{table}\n\
             pops over 5 mm: {pops}; the largest step of a joint within 20 microseconds is {:.2} mm\n\
             of feints {:.0}% of what full knowledge avoids\n\
             steering: speed off by {:.1}%; within 10 degrees of the direction after {:.2} s (median), {:.2} s (95%)\n\
             figure of eight: {:.2} m off at the 95th percentile, {:.2} m at most\n\
             idle: {:.0} events an hour; {:.1}% repeats what was played within 10 s; {:.2} m from the start at most\n\
             walls and opponents: the body entered one in {entered} attacks, by {:.1} mm at most\n\
             200 new threats in one step: {:.1} ms; with {PLANS_PER_STEP} plans a step {:.1} ms at most\n\
             {CROWD} characters, microseconds each: {:.1} to step, {:.2} to pose, {:.2} to pose one by one\n",
            1e3 * largest,
            100.0 * self.feints_kept(),
            100.0 * steer.speed_error,
            steer.settle_median,
            steer.settle_p95,
            steer.path_error,
            steer.path_error_max,
            idle.events_per_hour,
            100.0 * idle.repeated,
            idle.drift,
            1e3 * deepest,
            times.batch_200_ms,
            times.budget_200_ms,
            times.crowd.step,
            times.crowd.all_at_once,
            times.crowd.one_by_one,
        )
    }
}
