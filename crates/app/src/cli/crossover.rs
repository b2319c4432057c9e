//! `sabaki compare --plot`: from how many candidates on does which culling path pay?

use std::time::Instant;

use sabaki::maps::BakedGraph;
use sabaki::query::cull::CullInput;
use sabaki::query::{Answer, CullPath, Evaluation, Query, QueryContext, QuerySettings, Request};
use sabaki_app::demo::throw::Throw;
use serde_json::{Value, json};

use super::chart::{self, Chart};
use super::culling::Culling;
use super::passes::Method;
use super::picture::{COLOURS, Picture, RULE};
use super::plot::Paint;
use super::stats::percentile;
use super::{Failure, cancel, output};

/// How many candidates are counted.
const SIZES: [usize; 11] = [5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000];
/// Attacks whose candidates are taken, and how many of them each must have.
const ATTACKS: usize = 5;
const LEAST: usize = 5;
/// Times that each is measured at most, and for how long it is measured again; the median counts.
const REPEATS: usize = 5;
const PATIENCE: f64 = 0.3;

/// Milliseconds of one path over the number of candidates.
pub(crate) struct Line {
    path: CullPath,
    points: Vec<(usize, f64)>,
}

/// Times all paths that run here. Candidates are those of real queries, again and again where there
/// are not as many.
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
    cancel::listen();
    let bar = output::progress("crossover", (paths.len() * SIZES.len()) as u64);
    let mut lines = Vec::new();
    for path in paths {
        let mut points = Vec::new();
        for size in SIZES {
            // The median of each attack, so that a slow one, measured less often, weighs as much.
            let mut times = Vec::new();
            for throw in &chosen {
                cancel::check()?;
                let of_throw = match path {
                    CullPath::Exact => exact(baked, throw, size)?,
                    _ => counted(baked, throw, (size, path, culling))?,
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

/// As many candidates as there are, up to a number, however alike, and no moves.
fn all_candidates(most_evasions: usize) -> QuerySettings {
    let mut settings = Method::EXACT.settings();
    settings.most_evasions = most_evasions;
    (settings.alike_distance, settings.alike_angle) = (0.001, 0.001);
    settings.moves.candidates = 0;
    settings
}

/// The exact test of so many candidates, milliseconds; nothing where the query has fewer.
fn exact(baked: &BakedGraph, throw: &Throw, size: usize) -> Result<Vec<f64>, Failure> {
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

/// Counting the overlaps of so many candidates, milliseconds.
fn counted(
    baked: &BakedGraph,
    throw: &Throw,
    (size, path, culling): (usize, CullPath, &mut Culling),
) -> Result<Vec<f64>, Failure> {
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
        culling.count(path, &input, &mut overlaps)?;
        Ok(Some(started.elapsed().as_secs_f64()))
    })
}

/// The milliseconds of some runs of `work`, which says how many seconds it took, or that it cannot.
/// The first one fills the memory and does not count.
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

/// From how many candidates on a device is faster than the CPU.
fn crossings(lines: &[Line]) -> String {
    let Some(cpu) = lines.iter().find(|line| line.path == CullPath::Cpu) else {
        return String::new();
    };
    let devices = lines.iter().filter(|line| line.path.needs_device());
    let say = |line: &Line| {
        let pairs = cpu.points.iter().zip(&line.points);
        let slower = { pairs }.rfind(|(cpu, device)| device.1 >= cpu.1);
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

/// The same in letters, both axes logarithmic.
pub(crate) fn letters(lines: &[Line], paint: Paint) -> String {
    let line = |line: &Line| {
        let log = |&(size, ms): &(usize, f64)| ((size as f64).log10(), ms.max(1e-6).log10());
        chart::Line {
            name: line.path.name(),
            points: line.points.iter().map(log).collect(),
            marks: true,
        }
    };
    let chart = Chart {
        x: "candidates, powers of ten",
        y: "ms, powers of ten",
        lines: lines.iter().map(line).collect(),
    };
    format!("\n{}", chart.text(paint))
}

const SIZE: (usize, usize) = (900, 640);
/// Pixels left of the plot and below it, and at the other sides.
const AXIS: (usize, usize) = (90, 60);
const MARGIN: usize = 30;

/// The decades of both axes.
struct Axes {
    x: (f64, f64),
    y: (f64, f64),
}

impl Axes {
    fn new(lines: &[Line]) -> Self {
        let all = lines.iter().flat_map(|line| &line.points);
        let times = all.map(|point| point.1.max(1e-6).log10());
        let (low, high) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| {
            (low.min(t), high.max(t))
        });
        let (low, high) = if low > high { (0.0, 0.0) } else { (low, high) };
        Self {
            x: (0.0, 4.0),
            y: (low.floor(), high.ceil().max(low.floor() + 1.0)),
        }
    }

    /// Pixels.
    fn place(&self, size: f64, ms: f64) -> (f64, f64) {
        let share = |value: f64, (low, high): (f64, f64)| (value.log10() - low) / (high - low);
        let (width, height) = (
            (SIZE.0 - AXIS.0 - MARGIN) as f64,
            (SIZE.1 - AXIS.1 - MARGIN) as f64,
        );
        (
            AXIS.0 as f64 + width * share(size, self.x),
            MARGIN as f64 + height * (1.0 - share(ms.max(1e-6), self.y)),
        )
    }
}

/// The same as a picture, both axes logarithmic.
pub(crate) fn plot(lines: &[Line]) -> Picture {
    let axes = Axes::new(lines);
    let mut picture = Picture::new(SIZE.0, SIZE.1);
    let (low, high) = (10f64.powf(axes.y.0), 10f64.powf(axes.y.1));
    for decade in axes.x.0 as i32..=axes.x.1 as i32 {
        let size = 10f64.powi(decade);
        let (from, to) = (axes.place(size, low), axes.place(size, high));
        picture.line(from, to, RULE);
        let label = format!("{size}");
        let half = 4 * label.len();
        picture.text(
            (from.0 as usize).saturating_sub(half),
            from.1 as usize + 10,
            &label,
        );
    }
    for decade in axes.y.0 as i32..=axes.y.1 as i32 {
        let ms = 10f64.powi(decade);
        let (from, to) = (axes.place(1.0, ms), axes.place(10_000.0, ms));
        picture.line(from, to, RULE);
        picture.text(8, (from.1 as usize).saturating_sub(4), &format!("{ms}"));
    }
    picture.text(SIZE.0 / 2 - 40, SIZE.1 - 20, "candidates");
    picture.text(8, 8, "ms");
    for (line, colour) in lines.iter().zip(COLOURS.iter().cycle()) {
        let place = |&(size, ms): &(usize, f64)| axes.place(size as f64, ms);
        for pair in line.points.windows(2) {
            picture.line(place(&pair[0]), place(&pair[1]), *colour);
        }
        for (x, y) in line.points.iter().map(place) {
            picture.fill((x as usize - 3, y as usize - 3), (7, 7), *colour);
        }
    }
    for (index, (line, colour)) in lines.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let y = MARGIN + 12 + 18 * index;
        picture.fill((AXIS.0 + 14, y), (20, 8), *colour);
        picture.text(AXIS.0 + 42, y, line.path.name());
    }
    picture
}
