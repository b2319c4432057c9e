//! `sabaki compare --plot`: time of each culling path by the number of candidates.

use std::time::Instant;

use plotters::backend::DrawingBackend;
use sabaki::maps::BakedGraph;
use sabaki::query::cull::CullInput;
use sabaki::query::{Answer, CullPath, Evaluation, Query, QueryContext, QuerySettings, Request};
use sabaki_app::percentile::percentile;
use sabaki_fixtures::throw::Throw;
use serde_json::{Value, json};

use super::chart::{self, Chart, Scale};
use super::culling::{Culling, OnePath};
use super::passes::Method;
use super::plot::{Area, Drawn, Figure, Format, Paint};
use super::{Failure, cancel, output};

/// Numbers of candidates that are culled.
const SIZES: [usize; 11] = [5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];
/// Number of attacks that are measured, and the least number of candidates of each.
const ATTACKS: usize = 5;
const LEAST: usize = 5;
/// Largest number of repetitions, and the seconds after which none is added. The median counts.
const REPEATS: usize = 5;
const PATIENCE: f64 = 0.3;

/// Times of one path for each number of candidates, in milliseconds.
pub(crate) struct Line {
    path: CullPath,
    points: Vec<(usize, f64)>,
}

/// Times all paths that this machine supports. Candidates are those of real queries, repeated if there
/// are too few.
pub(crate) fn measure(
    baked: &BakedGraph,
    throws: &[Throw],
    culling: &mut Culling,
) -> Result<Vec<Line>, Failure> {
    let settings = all_candidates(usize::MAX);
    let mut context = QueryContext::default();
    let query = Query::new(baked, &settings);
    let mut count = |throw: &&Throw| {
        let session = query.start(throw.request(), &mut context);
        session.cull_input().candidates.len() >= LEAST
    };
    let chosen: Vec<&Throw> = throws.iter().filter(|t| count(t)).take(ATTACKS).collect();
    let paths = culling.paths();
    let bar = output::progress("crossover", (paths.len() * SIZES.len()) as u64);
    let mut lines = Vec::new();
    for path in paths {
        let mut points = Vec::new();
        for size in SIZES {
            // The median of each attack: a slow attack is measured less often and weighs the same.
            let mut times = Vec::new();
            for throw in &chosen {
                cancel::check()?;
                let sample = Sample { baked, throw, size };
                let of_throw = match path {
                    CullPath::Exact => sample.exact()?,
                    _ => sample.counted(culling.on(path))?,
                };
                if !of_throw.is_empty() {
                    times.push(percentile(of_throw, 0.5));
                }
            }
            if !times.is_empty() {
                let mean = times.iter().sum::<f64>() / times.len() as f64;
                points.push((size, mean));
            }
            bar.inc(1);
        }
        lines.push(Line { path, points });
    }
    bar.finish_and_clear();
    Ok(lines)
}

/// Settings that keep up to this number of candidates, similar ones too, and no moves.
fn all_candidates(most_evasions: usize) -> QuerySettings {
    let mut settings = Method::EXACT.settings();
    settings.most_evasions = most_evasions;
    (settings.alike_distance, settings.alike_angle) = (0.001, 0.001);
    settings.moves.candidates = 0;
    settings
}

/// Input of a measurement: a number of candidates of one throw.
#[derive(Clone, Copy)]
struct Sample<'a> {
    baked: &'a BakedGraph,
    throw: &'a Throw,
    /// Number of candidates.
    size: usize,
}

impl Sample<'_> {
    /// Times the exact test of the candidates, in milliseconds; empty if the query has fewer.
    fn exact(self) -> Result<Vec<f64>, Failure> {
        let Self { baked, throw, size } = self;
        let settings = all_candidates(size);
        let query = Query::new(baked, &settings);
        let (mut context, mut answer) = (QueryContext::default(), Answer::default());
        timed(|| {
            let request = Request {
                evaluation: Evaluation::Exhaustive,
                ..throw.request()
            };
            let mut session = query.start(request, &mut context);
            let enough = session.cull_input().candidates.len() >= size;
            Ok(enough.then(|| {
                let started = Instant::now();
                let _ = session.submit(&[], &mut answer);
                started.elapsed().as_secs_f64()
            }))
        })
    }

    /// Times counting the overlaps of the candidates, in milliseconds.
    fn counted(self, mut culling: OnePath<'_>) -> Result<Vec<f64>, Failure> {
        let Self { baked, throw, size } = self;
        let settings = all_candidates(usize::MAX);
        let mut context = QueryContext::default();
        let query = Query::new(baked, &settings);
        let session = query.start(throw.request(), &mut context);
        let input = session.cull_input();
        let candidates: Vec<_> = input
            .candidates
            .iter()
            .cycle()
            .take(size)
            .copied()
            .collect();
        let input = CullInput {
            candidates: &candidates,
            ..input
        };
        let mut overlaps = Vec::new();
        timed(|| {
            let started = Instant::now();
            culling.count(&input, &mut overlaps)?;
            Ok(Some(started.elapsed().as_secs_f64()))
        })
    }
}

/// Milliseconds of several runs of `work`, which returns its seconds, or `None` if it cannot run. The
/// first run is a warm-up.
fn timed(mut work: impl FnMut() -> Result<Option<f64>, Failure>) -> Result<Vec<f64>, Failure> {
    let (started, mut times) = (Instant::now(), Vec::new());
    for repeat in 0..=REPEATS {
        let Some(seconds) = work()? else {
            return Ok(Vec::new());
        };
        if repeat > 0 {
            times.push(seconds * 1e3);
        }
        if !times.is_empty() && started.elapsed().as_secs_f64() > PATIENCE {
            break;
        }
    }
    Ok(times)
}

pub(crate) fn to_json(lines: &[Line]) -> Value {
    let point = |&(candidates, ms): &(usize, f64)| json!({ "candidates": candidates, "ms": ms });
    let line = |line: &Line| {
        let points: Vec<Value> = line.points.iter().map(point).collect();
        json!({ "cull": line.path.name(), "points": points })
    };
    lines.iter().map(line).collect()
}

pub(crate) fn text(lines: &[Line]) -> String {
    let names = lines.iter().map(|line| line.path.name());
    let head: Vec<&str> = std::iter::once("candidates").chain(names).collect();
    let mut table = output::table(&head, 0);
    for size in SIZES {
        let of = |line: &Line| {
            let point = line.points.iter().find(|point| point.0 == size);
            point.map_or("-".to_owned(), |point| format!("{:.4}", point.1))
        };
        table.add_row(std::iter::once(size.to_string()).chain(lines.iter().map(of)));
    }
    format!(
        "\nMilliseconds to cull so many candidates (exact: to test them all; -: no query has as many):\n{table}\n\
         {}The mean of some attacks, of each the median. Candidates are those of real queries, again and again where there\n\
         are not as many (exact: of those attacks that have as many). A device's time is from the\n\
         upload to the counts in the caller's hands.\n",
        crossings(lines)
    )
}

/// The number of candidates from which each device path is faster than the CPU.
fn crossings(lines: &[Line]) -> String {
    let Some(cpu) = lines.iter().find(|line| line.path == CullPath::Cpu) else {
        return String::new();
    };
    let devices = lines.iter().filter(|line| line.path.needs_device());
    let say = |line: &Line| {
        let mut pairs = cpu.points.iter().zip(&line.points);
        let slower = pairs.rfind(|(cpu, device)| device.1 >= cpu.1);
        let last = slower.map(|(cpu, _)| cpu.0);
        let name = line.path.name();
        match last {
            None => format!(
                "{name} is faster than cpu from {} candidates on.\n",
                SIZES[0]
            ),
            Some(last) if last == SIZES[SIZES.len() - 1] => {
                format!("{name} is not faster than cpu for up to {last} candidates.\n")
            }
            Some(last) => format!("{name} is faster than cpu from above {last} candidates on.\n"),
        }
    };
    devices.map(say).collect()
}

/// The measured times as a figure, both axes logarithmic.
pub(crate) struct CrossoverFigure<'a> {
    pub(crate) lines: &'a [Line],
}

impl CrossoverFigure<'_> {
    fn chart(&self) -> Chart<'_> {
        let line = |line: &Line| {
            let points = line.points.iter();
            chart::Line {
                name: line.path.name(),
                points: points.map(|&(size, ms)| (size as f64, ms)).collect(),
                marks: true,
            }
        };
        Chart {
            title: "Time to cull, by the number of candidates",
            x: "candidates",
            y: "ms",
            scale: Scale::Log,
            lines: self.lines.iter().map(line).collect(),
        }
    }
}

impl Figure for CrossoverFigure<'_> {
    fn size(&self) -> (u32, u32) {
        (900, 640)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, _: Format) -> Drawn<DB> {
        self.chart().draw(area)
    }

    fn letters(&self, paint: Paint) -> String {
        format!("\n{}", self.chart().text(paint))
    }
}
