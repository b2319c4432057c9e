//! Answers attacks and keeps a summary of each answer.

use std::time::{Duration, Instant};

use super::map_quality::Round;
use sabaki::graph::EdgeId;
use sabaki::internal::SearchReport;
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, Counts, Query, QueryContext, QuerySettings, Request, Source};
use sabaki_app::percentile::percentile;
use sabaki_fixtures::throw::Throw;
use serde_json::{Value, json};

use super::Failure;
use super::culling::OnePath;
use super::method::Method;

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
    pub(crate) fn query_ms(&self) -> f64 {
        self.enumerate_ms + self.cull_ms + self.decide_ms
    }

    /// Number of candidates that have maps: paths to an evasion. An evasion that is entered or layered has none.
    pub(crate) fn mapped(&self) -> usize {
        let Counts {
            with_evasion,
            entered,
            layered,
            ..
        } = self.counts;
        with_evasion - entered - layered
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

/// Asks one query after the other, in the same memory.
pub(crate) struct QueryRunner<'a> {
    baked: &'a BakedGraph,
    context: QueryContext,
    /// Answer to the last query.
    pub(crate) answer: Answer,
    /// Rounds of culling of the last query, if they are recorded.
    pub(crate) rounds: Vec<Round>,
    /// Whether `rounds` are noted.
    pub(crate) watches: bool,
}

impl<'a> QueryRunner<'a> {
    pub(crate) fn new(baked: &'a BakedGraph) -> Self {
        Self {
            baked,
            context: QueryContext::default(),
            answer: Answer::default(),
            rounds: Vec::new(),
            watches: false,
        }
    }

    /// Answers one attack.
    pub(crate) fn ask(
        &mut self,
        settings: &QuerySettings,
        throw: &Throw,
        mut culling: OnePath<'_>,
    ) -> Result<Run, Failure> {
        self.rounds.clear();
        let query = Query::new(self.baked, settings);
        let (mut cull, mut watch) = (Duration::ZERO, Duration::ZERO);
        let started = Instant::now();
        let request = Request {
            evaluation: culling.path().evaluation(),
            ..throw.request()
        };
        let mut session = query.start(request, &mut self.context);
        let enumerate = started.elapsed();
        let deciding = Instant::now();
        session.run_rounds(&mut self.answer, |session| {
            let counting = Instant::now();
            session.count(|input, counts| culling.count(input, counts))?;
            cull += counting.elapsed();
            if self.watches || settings.list_late {
                session.draw_outer_maps();
                session.count(|input, counts| culling.count_whole(input, counts))?;
            }
            if self.watches {
                self.rounds.push(Round::new(session));
            }
            watch += counting.elapsed();
            Ok::<(), Failure>(())
        })?;
        let decide = deciding.elapsed() - watch;
        Ok(Run {
            would_hit: throw.would_hit(self.baked),
            ..self.run([enumerate, cull, decide])
        })
    }

    fn run(&self, times: [Duration; 3]) -> Run {
        let answer = &self.answer;
        let chosen = answer.chosen();
        let mut in_time = answer.candidates.iter().filter(|c| c.rate.is_ok());
        let [enumerate_ms, cull_ms, decide_ms] = times.map(|time| time.as_secs_f64() * 1e3);
        Run {
            avoided: answer.avoided,
            would_hit: true,
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
}

/// Median and 99th percentile, in milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Times {
    pub(crate) median: f64,
    pub(crate) p99: f64,
}

impl Times {
    pub(crate) fn of(runs: &[Run], milliseconds: fn(&Run) -> f64) -> Self {
        let all: Vec<f64> = runs.iter().map(milliseconds).collect();
        Self {
            median: percentile(all.clone(), 0.5),
            p99: percentile(all, 0.99),
        }
    }

    pub(crate) fn to_json(self) -> Value {
        json!({ "median": self.median, "p99": self.p99 })
    }

    /// Text with this number of decimals.
    pub(crate) fn text(self, decimals: usize) -> String {
        format!("{:.decimals$} / {:.decimals$}", self.median, self.p99)
    }
}
