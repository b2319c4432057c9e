//! Attacks, the methods that answer them, and a summary of each answer.

use std::convert::Infallible;
use std::path::Path;
use std::time::{Duration, Instant};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use sabaki::graph::{EdgeId, Playhead};
use sabaki::maps::{BakedGraph, PathId};
use sabaki::math::{Rigid2, in_parallel, thread_count};
use sabaki::query::cull::{CullCandidate, Overlap};
use sabaki::query::{
    Answer, Counts, CullPath, Enumerate, Evaluation, Query, QueryContext, QuerySettings, Request,
    SearchReport, Source, Step,
};
use sabaki_app::percentile::percentile;
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};
use serde::Serialize;
use serde_json::{Value, json};

use super::culling::{Culling, path_parser};
use super::{Failure, cancel, output};

/// The methods to run.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Culling")]
pub(crate) struct MethodArgs {
    /// Culling paths, run one after the other on the same attacks.
    #[arg(long, value_delimiter = ',', default_value = "none", value_parser = path_parser())]
    cull: Vec<CullPath>,
    /// Source of the candidates. on: the node's grid, and the whole graph where the grid has none.
    /// off: always the whole graph.
    #[arg(long, value_delimiter = ',', default_value = "on", value_parser = grid_parser())]
    grid: Vec<Enumerate>,
}

fn grid_parser() -> impl TypedValueParser<Value = Enumerate> {
    PossibleValuesParser::new(["on", "off"]).map(|grid| match grid.as_str() {
        "on" => Enumerate::default(),
        _ => Enumerate::Whole,
    })
}

/// A culling path, the candidates that are tested, and their source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Method {
    pub(crate) cull: CullPath,
    pub(crate) evaluation: Evaluation,
    pub(crate) enumerate: Enumerate,
}

impl MethodArgs {
    /// Each culling path with each kind of grid.
    pub(crate) fn methods(&self) -> Vec<Method> {
        let with = |cull: CullPath| {
            let grids = self.grid.iter();
            grids.map(move |&enumerate| Method::new(cull, cull.evaluation(), enumerate))
        };
        self.cull.iter().copied().flat_map(with).collect()
    }
}

impl Method {
    /// The reference that the other methods are compared with.
    pub(crate) const EXACT: Self = Self {
        cull: CullPath::Exact,
        evaluation: Evaluation::Exhaustive,
        enumerate: Enumerate::Whole,
    };

    pub(crate) fn new(cull: CullPath, evaluation: Evaluation, enumerate: Enumerate) -> Self {
        Self {
            cull,
            evaluation,
            enumerate,
        }
    }

    /// Settings of its queries.
    pub(crate) fn settings(self) -> QuerySettings {
        QuerySettings {
            enumerate: self.enumerate,
            ..QuerySettings::default()
        }
    }

    pub(crate) fn grid_name(self) -> &'static str {
        if self.enumerate.uses_grid() {
            "on"
        } else {
            "off"
        }
    }
}

/// The random attacks with these indices.
pub(crate) fn random_throws(
    baked: &BakedGraph,
    seed: u64,
    indices: std::ops::Range<u64>,
) -> Result<Vec<Throw>, Failure> {
    let random = |index| {
        cancel::check()?;
        let thrown = throw(baked, &ThrowSettings::default(), seed, index);
        thrown.map_err(Failure::attack(index))
    };
    indices.map(random).collect()
}

/// The attacks of a file, on a character that stands in the graph's first pose.
pub(crate) fn file_throws(baked: &BakedGraph, path: &Path) -> Result<Vec<Throw>, Failure> {
    let playhead = Playhead::at(baked.graph(), EdgeId(0), 0.0, Rigid2::IDENTITY);
    let attacks = sabaki_import::AttackFile::read(path)?.attacks;
    let throw = |attack| Throw { playhead, attack };
    Ok(attacks.into_iter().map(throw).collect())
}

pub(crate) fn file_throw(baked: &BakedGraph, path: &Path, index: u64) -> Result<Throw, Failure> {
    let throws = file_throws(baked, path)?;
    let count = throws.len();
    throws.into_iter().nth(index as usize).ok_or_else(|| {
        let what = format!("there is no attack {index}: the file has {count}, from 0 on");
        Failure::Usage(what).within(path)
    })
}

/// Summary of one answer, small enough to keep ten thousand.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) avoided: bool,
    /// Whether the attack hits the continued motion.
    pub(crate) would_hit: bool,
    /// Clearance between the attack and the body, in metres.
    pub(crate) clearance: f32,
    /// The evasion; `None` for a path without one.
    pub(crate) evasion: Option<EdgeId>,
    /// Playback rate of the path's retimable edges.
    pub(crate) rate: f32,
    /// Score V of the chosen path; `None` for a hit.
    pub(crate) score: Option<f32>,
    pub(crate) counts: Counts,
    search: SearchReport,
    pub(crate) source: Source,
    /// Every candidate was tested and is hit.
    pub(crate) all_hit: bool,
    /// Milliseconds of finding candidates, of counting overlaps, and of the exact test with the choice.
    pub(crate) enumerate_ms: f64,
    pub(crate) cull_ms: f64,
    pub(crate) decide_ms: f64,
}

impl Run {
    fn new(answer: &Answer, would_hit: bool, times: [Duration; 3]) -> Self {
        let chosen = answer.chosen();
        let mut in_time = answer.candidates.iter().filter(|c| c.rate.is_ok());
        let [enumerate_ms, cull_ms, decide_ms] = times.map(|time| time.as_secs_f64() * 1e3);
        Self {
            avoided: answer.avoided,
            would_hit,
            clearance: answer.clearance().metres,
            evasion: chosen.evasion,
            rate: chosen.rate.as_ref().map_or(1.0, |rate| rate.rate),
            score: chosen.score.map(|score| score.total),
            counts: answer.counts,
            search: answer.search,
            source: answer.source,
            all_hit: in_time.all(|c| c.clearance.is_some_and(|clearance| !clearance.is_clean())),
            enumerate_ms,
            cull_ms,
            decide_ms,
        }
    }

    pub(crate) fn query_ms(&self) -> f64 {
        self.enumerate_ms + self.cull_ms + self.decide_ms
    }

    /// Number of candidates that have maps: paths to an evasion. An evasion that is entered or layered has none.
    pub(crate) fn mapped(&self) -> usize {
        self.counts.with_evasion - self.counts.entered - self.counts.layered
    }

    /// Whether the grid holds paths in the cells that the attack touches.
    pub(crate) fn used_grid(&self) -> bool {
        matches!(self.source, Source::Grid | Source::NothingClean)
    }

    /// The chosen evasion: its clip and its seconds.
    pub(crate) fn evasion(&self, baked: &BakedGraph) -> Option<String> {
        sabaki_import::export::describe_evasion(baked, self.evasion?)
    }

    pub(crate) fn to_json(&self, baked: &BakedGraph, index: usize, method: Method) -> Value {
        json!({
            "attack": index,
            "cull": method.cull.name(),
            "grid": method.grid_name(),
            "source": self.source,
            "avoided": self.avoided,
            "would_hit": self.would_hit,
            "clearance": self.clearance,
            "evasion": self.evasion(baked),
            "p": self.rate,
            "score": self.score,
            "counts": self.counts,
            "search": self.search,
            "ms": {
                "query": self.query_ms(),
                "enumerate": self.enumerate_ms,
                "cull": self.cull_ms,
                "decide": self.decide_ms,
            },
        })
    }
}

/// The counts of one candidate in a round of culling. A query has two rounds if no candidate of the grid is clean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CountedOne {
    pub(crate) path: PathId,
    pub(crate) overlap: Overlap,
    /// Whether an outer count of 0 proves no miss.
    pub(crate) is_open: bool,
}

/// Asks one query after the other, in the same memory.
pub(crate) struct QueryRunner<'a> {
    baked: &'a BakedGraph,
    context: QueryContext,
    /// Answer to the last query.
    pub(crate) answer: Answer,
    /// Rounds of culling of the last query, if they are recorded.
    pub(crate) rounds: Vec<Vec<CountedOne>>,
    pub(crate) records_rounds: bool,
}

impl<'a> QueryRunner<'a> {
    pub(crate) fn new(baked: &'a BakedGraph) -> Self {
        Self {
            baked,
            context: QueryContext::default(),
            answer: Answer::default(),
            rounds: Vec::new(),
            records_rounds: false,
        }
    }

    /// Answers one attack with a method.
    pub(crate) fn ask(
        &mut self,
        method: Method,
        settings: &QuerySettings,
        throw: &Throw,
        culling: &mut Culling,
    ) -> Result<Run, Failure> {
        self.rounds.clear();
        let query = Query::new(self.baked, settings);
        // Recording is no part of the query, and is not timed.
        let (mut cull, mut count_and_record) = (Duration::ZERO, Duration::ZERO);
        let started = Instant::now();
        let request = Request {
            evaluation: method.evaluation,
            ..throw.request()
        };
        let mut session = query.start(request, &mut self.context);
        let enumerate = started.elapsed();
        let deciding = Instant::now();
        loop {
            let counting = Instant::now();
            session.count(|input, counts| culling.count(method.cull, input, counts))?;
            cull += counting.elapsed();
            // The choice sees what its method counts.
            let counted = self.records_rounds.then(|| session.counts().to_vec());
            if self.records_rounds || settings.list_late {
                session.draw_outer_maps();
                let Ok(()) = session.count(|input, counts| {
                    culling.count_whole(input, counts);
                    Ok::<(), Infallible>(())
                });
            }
            if self.records_rounds {
                let candidates = session.cull_input().candidates;
                let counted = session.counted_paths().zip(candidates);
                let one = |((path, candidate), &overlap): ((PathId, &CullCandidate), &Overlap)| {
                    let is_open = candidate.open;
                    CountedOne {
                        path,
                        overlap,
                        is_open,
                    }
                };
                self.rounds
                    .push(counted.zip(session.counts()).map(one).collect());
            }
            count_and_record += counting.elapsed();
            let step = match &counted {
                Some(counts) => session.submit(counts, &mut self.answer),
                None => session.submit_counted(&mut self.answer),
            };
            if step == Step::Done {
                break;
            }
        }
        let decide = deciding.elapsed() - count_and_record;
        let would_hit = throw.would_hit(self.baked);
        Ok(Run::new(&self.answer, would_hit, [enumerate, cull, decide]))
    }
}

/// The answers of one method to all attacks.
pub(crate) struct Pass {
    pub(crate) method: Method,
    pub(crate) runs: Vec<Run>,
}

impl Pass {
    /// Answers all attacks with one method. `threads` share them where no device culls; 0: all of the machine. `each` is called with
    /// each answer, which is then dropped.
    pub(crate) fn new(
        baked: &BakedGraph,
        throws: &[Throw],
        method: Method,
        query: &QuerySettings,
        threads: usize,
        culling: &mut Culling,
        each: impl Fn(usize, &Answer) -> Result<(), Failure> + Sync,
    ) -> Result<Self, Failure> {
        culling.warm_up(method.cull, baked.atlas())?;
        let bar = output::progress(method.cull.name(), throws.len() as u64);
        // Every n-th attack, from the given one on.
        let part = |first: usize, step: usize, culling: &mut Culling| {
            let mut runner = QueryRunner::new(baked);
            let numbered = throws.iter().enumerate().skip(first).step_by(step);
            let runs = numbered.map(|(index, throw)| {
                cancel::check()?;
                let run = runner.ask(method, query, throw, culling)?;
                each(index, &runner.answer)?;
                bar.inc(1);
                Ok(run)
            });
            runs.collect::<Result<Vec<Run>, Failure>>()
        };
        let threads = thread_count(threads).min(throws.len()).max(1);
        let runs = if threads == 1 || method.cull.needs_device() {
            part(0, 1, culling)?
        } else {
            let parts = in_parallel(threads, threads, |first| {
                let mut culling = Culling::without_device("it is for one thread only".to_owned());
                part(first, threads, &mut culling)
            });
            let parts = parts.into_iter().collect::<Result<Vec<_>, Failure>>()?;
            let run = |index: usize| parts[index % threads][index / threads].clone();
            (0..throws.len()).map(run).collect()
        };
        bar.finish_and_clear();
        Ok(Self { method, runs })
    }
}

/// Median and 99th percentile, in milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Times {
    pub(crate) median: f64,
    pub(crate) p99: f64,
}

impl Times {
    pub(crate) fn new(runs: &[Run], milliseconds: fn(&Run) -> f64) -> Self {
        let all: Vec<f64> = runs.iter().map(milliseconds).collect();
        Self {
            median: percentile(all.clone(), 0.5),
            p99: percentile(all, 0.99),
        }
    }

    /// Text with this number of decimals.
    pub(crate) fn text(self, decimals: usize) -> String {
        format!("{:.decimals$} / {:.decimals$}", self.median, self.p99)
    }
}
