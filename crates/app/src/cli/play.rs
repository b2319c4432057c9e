//! `sabaki play`: a game without a window, measured. `cargo bench --bench game` measures its times.

use std::path::PathBuf;
use std::sync::Arc;

use sabaki::anim::Pose;
use sabaki::math::in_parallel;
use sabaki_app::play::{
    FRAME, IdleReport, Outcome, PlayError, Scenario, Scenarios, Sight, SteerReport, Surroundings,
    idle,
};
use serde_json::{Map, Value, json};

use super::bake::GraphArgs;
use super::numbers::whole;
use super::{Done, Failure, cancel, output, quality};
use crate::measure::quality::{Quality, QualityMeter};

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
    /// Number of threads; 0 for all of the machine. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=1024))]
    threads: u64,
    /// Writes what characters play to a folder, as BVH at 60 Hz, a file a minute: steering, threats, idle. It then measures these minutes beside the
    /// clips, too.
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

struct Report {
    rows: Vec<Vec<Outcome>>,
    steer: SteerReport,
    idle: IdleReport,
    /// The clips, and the recorded minutes.
    recorded: Option<Vec<(&'static str, Quality)>>,
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
    let recorded = match &args.record {
        None => None,
        Some(folder) => {
            let meter = QualityMeter::new(&baked);
            let measure = |poses: &[Pose]| meter.played(poses, FRAME);
            let minutes = scenarios
                .record(folder, threads, measure)
                .map_err(refused)?;
            let each = minutes.into_iter();
            let played = each.map(|(name, parts)| (name, Quality::of_all(parts)));
            Some(
                [("clips", meter.clips())]
                    .into_iter()
                    .chain(played)
                    .collect(),
            )
        }
    };
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
        let outcomes = in_parallel(threads, args.threats as usize, of);
        rows.push(outcomes.into_iter().collect::<Result<_, _>>()?);
    }
    let changers = (args.threats as usize).clamp(4, 100);
    let steer = scenarios.steer(changers, threads).map_err(refused)?;
    cancel::check()?;
    let idle = idle(&baked, threads).map_err(refused)?;
    let report = Report {
        rows,
        steer,
        idle,
        recorded,
    };
    bar.finish_and_clear();
    Ok(Done::ok(match as_json {
        true => Done::json(&report.document()),
        false => report.text(),
    }))
}

/// Share of the attacks that were avoided.
fn share(row: &[Outcome]) -> f64 {
    let avoided = row.iter().filter(|outcome| outcome.avoided).count();
    avoided as f64 / row.len().max(1) as f64
}

/// Median number of changes of plan, of the attacks that were planned for.
fn changes_median(row: &[Outcome]) -> u32 {
    let planned = row.iter().filter(|outcome| outcome.plans > 0);
    let mut changes: Vec<u32> = planned.map(|outcome| outcome.changes).collect();
    changes.sort_unstable();
    let middle = changes.len().saturating_sub(1) / 2;
    changes.get(middle).copied().unwrap_or(0)
}

fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

impl Report {
    fn row(&self, name: &str) -> &[Outcome] {
        let place = ROWS.iter().position(|(of, _)| *of == name);
        place.map_or(&[], |place| &self.rows[place])
    }

    fn pops(&self) -> (u32, f32) {
        let all = self.rows.iter().flatten();
        all.fold((0, 0.0), |(pops, largest), one| {
            (pops + one.pops, f32::max(largest, one.largest_pop))
        })
    }

    /// Number of attacks during which the body entered an obstacle, and the deepest entry, in metres.
    fn entered(&self) -> (usize, f32) {
        let all = self.rows.iter().flatten();
        let entered = all.filter(|one| one.entered > 0.0);
        entered.fold((0, 0.0), |(count, deepest), one| {
            (count + 1, f32::max(deepest, one.entered))
        })
    }

    fn feints_kept(&self) -> f64 {
        share(self.row("feint")) / share(self.row("feint_known")).max(1e-9)
    }

    fn document(&self) -> Value {
        let avoided = ROWS.iter().zip(&self.rows);
        let avoided =
            avoided.map(|((name, _), row)| ((*name).to_owned(), json!(round(share(row)))));
        let (pops, largest) = self.pops();
        let Self { steer, idle, .. } = self;
        let number = |value: f32| round(f64::from(value));
        let takeovers: u32 = self.rows.iter().flatten().map(|one| one.takeovers).sum();
        let cornered = |name| {
            let cornered = self.row(name).iter().filter(|one| one.cornered > 0);
            cornered.count()
        };
        let mut document = json!({
            "threats": self.row("one").len(),
            "pops_over_5mm": pops,
            "largest_pop_mm": number(1e3 * largest),
            "takeovers": takeovers,
            "avoided": avoided.collect::<Map<_, _>>(),
            "entered_obstacles": self.entered().0,
            "deepest_entry_mm": number(1e3 * self.entered().1),
            "cornered": {
                "walls": cornered("walls"),
                "opponents": cornered("opponents"),
            },
            "plan_changes_median": changes_median(self.row("noise")),
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
        });
        if let Some(columns) = &self.recorded {
            document["quality"] = quality::columns_document(columns);
        }
        document
    }

    fn text(&self) -> String {
        let mut table = output::table(&["attack", "attacks", "avoided", "changes of plan"], 1);
        for ((name, _), row) in ROWS.iter().zip(&self.rows) {
            table.add_row([
                (*name).replace('_', " "),
                row.len().to_string(),
                format!("{:.1}%", 100.0 * share(row)),
                changes_median(row).to_string(),
            ]);
        }
        let ((pops, largest), (entered, deepest)) = (self.pops(), self.entered());
        let Self { steer, idle, .. } = self;
        let recorded = self.recorded.as_ref();
        let recorded = recorded.map_or(String::new(), |columns| quality::columns_text(columns));
        format!(
            "{table}\n\
             pops over 5 mm: {pops}; the largest step of a joint within 20 microseconds is {:.2} mm\n\
             of feints {:.0}% of what full knowledge avoids\n\
             steering: speed off by {:.1}%; within 10 degrees of the direction after {:.2} s (median), {:.2} s (95%)\n\
             figure of eight: {:.2} m off at the 95th percentile, {:.2} m at most\n\
             idle: {:.0} events an hour; {:.1}% repeats what was played within 10 s; {:.2} m from the start at most\n\
             walls and opponents: the body entered one in {entered} attacks, by {:.1} mm at most\n{recorded}",
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
        )
    }
}
