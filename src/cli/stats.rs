//! Answers to many attacks, summed up.

use std::time::{Duration, Instant};

use sabaki::avoid::{Answer, Query, QueryContext, QuerySettings, Verdict};
use sabaki::demo::throw::Throw;
use sabaki::region::BakedGraph;
use serde_json::{Value, json};

use super::Failure;
use super::culling::{CullPath, Culling};

/// One attack and how it was answered.
pub(crate) struct Run {
    pub(crate) answer: Answer,
    /// Milliseconds: finding candidates, counting overlaps, exact test and choice.
    pub(crate) enumerate_ms: f64,
    pub(crate) cull_ms: f64,
    pub(crate) decide_ms: f64,
}

impl Run {
    pub(crate) fn query_ms(&self) -> f64 {
        self.enumerate_ms + self.cull_ms + self.decide_ms
    }

    /// Whether every candidate was exactly tested and is hit.
    fn unavoidable(&self) -> bool {
        let in_time = self
            .answer
            .candidates
            .iter()
            .filter(|candidate| candidate.rate.is_ok());
        in_time
            .map(|c| c.clearance.map(|clearance| clearance.metres))
            .all(|metres| metres.is_some_and(|m| m < 0.0))
    }

    /// The rate of the chosen path.
    pub(crate) fn rate(&self) -> f32 {
        self.answer
            .chosen()
            .rate
            .as_ref()
            .map_or(1.0, |rate| rate.rate)
    }

    /// The chosen evasion by clip and seconds; `None` where the path only moves.
    pub(crate) fn evasion(&self, baked: &BakedGraph) -> Option<String> {
        let edge = self.answer.chosen().evasion?;
        let event = baked.graph().edge(edge).event?;
        Some(baked.graph().describe_event(baked.graph().event(event)))
    }

    pub(crate) fn to_json(&self, baked: &BakedGraph, index: usize, cull: CullPath) -> Value {
        json!({
            "attack": index,
            "cull": cull.name(),
            "grid": "off",
            "avoided": self.answer.avoided,
            "clearance": self.answer.clearance().metres,
            "evasion": self.evasion(baked),
            "p": self.rate(),
            "counts": self.answer.counts,
            "search": self.answer.search,
            "ms": {
                "query": self.query_ms(),
                "enumerate": self.enumerate_ms,
                "cull": self.cull_ms,
                "decide": self.decide_ms,
            },
        })
    }
}

/// Answers one attack with one culling path.
pub(crate) fn answer(
    baked: &BakedGraph,
    settings: &QuerySettings,
    throw: &Throw,
    (culling, path): (&mut Culling, CullPath),
    context: &mut QueryContext,
) -> Result<Run, Failure> {
    let mut answer = Answer::default();
    let (mut enumerate, mut cull) = (Duration::ZERO, Duration::ZERO);
    let started = Instant::now();
    let mut prepared = Query::new(baked, settings).prepare(throw.playhead, &throw.attack, context);
    enumerate += started.elapsed();
    loop {
        let counting = Instant::now();
        let overlaps = culling.count(path, &prepared.cull_input())?;
        cull += counting.elapsed();
        match prepared.decide(&overlaps, path.judging(), &mut answer) {
            Verdict::Answered => break,
            Verdict::Widened(wider) => prepared = wider,
        }
    }
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    Ok(Run {
        answer,
        enumerate_ms: ms(enumerate),
        cull_ms: ms(cull),
        decide_ms: ms(started.elapsed() - enumerate - cull),
    })
}

/// Figures over many attacks.
pub(crate) struct Summary {
    pub(crate) attacks: usize,
    pub(crate) avoided: usize,
    /// Attacks of which the exact test says that every candidate is hit.
    pub(crate) unavoidable: usize,
    /// Median number of candidates that end in an evasion, and of all.
    pub(crate) with_evasion: f64,
    pub(crate) candidates: f64,
    /// Share of the candidates with maps that the maps removed.
    pub(crate) culled_share: f64,
    /// Of the clean answers, metres; `None` where there is none.
    pub(crate) median_clearance: Option<f64>,
    pub(crate) query_ms: [f64; 2],
    pub(crate) cull_ms: [f64; 2],
    /// Answers that perform an evasion.
    pub(crate) evading: usize,
}

impl Summary {
    pub(crate) fn of(runs: &[Run]) -> Self {
        let sum = |of: fn(&Run) -> usize| runs.iter().map(of).sum::<usize>();
        let (culled, mapped) = (
            sum(|r| r.answer.counts.culled),
            sum(|r| r.answer.counts.with_evasion),
        );
        let values = |of: fn(&Run) -> f64| runs.iter().map(of).collect::<Vec<_>>();
        let clean: Vec<f64> = runs
            .iter()
            .filter(|r| r.answer.avoided)
            .map(|r| f64::from(r.answer.clearance().metres))
            .collect();
        let times =
            |of: fn(&Run) -> f64| [percentile(values(of), 0.5), percentile(values(of), 0.99)];
        Self {
            attacks: runs.len(),
            avoided: clean.len(),
            unavoidable: runs.iter().filter(|run| run.unavoidable()).count(),
            with_evasion: percentile(values(|r| r.answer.counts.with_evasion as f64), 0.5),
            candidates: percentile(values(|r| r.answer.counts.candidates as f64), 0.5),
            culled_share: if mapped > 0 {
                culled as f64 / mapped as f64
            } else {
                0.0
            },
            median_clearance: (!clean.is_empty()).then(|| percentile(clean, 0.5)),
            query_ms: times(Run::query_ms),
            cull_ms: times(|r| r.cull_ms),
            evading: runs
                .iter()
                .filter(|r| r.answer.chosen().evasion.is_some())
                .count(),
        }
    }

    pub(crate) fn to_json(&self, cull: CullPath) -> Value {
        let times = |[median, p99]: [f64; 2]| json!({ "median": median, "p99": p99 });
        json!({
            "cull": cull.name(),
            "grid": "off",
            "attacks": self.attacks,
            "avoided": self.avoided,
            "hit": self.attacks - self.avoided,
            "unavoidable": self.unavoidable,
            "hit_though_avoidable": self.attacks - self.avoided - self.unavoidable,
            "grid_used": 0,
            "by_evasion": self.evading,
            "candidates": self.candidates,
            "candidates_with_evasion": self.with_evasion,
            "culled_share": self.culled_share,
            "median_clearance": self.median_clearance,
            "query_ms": times(self.query_ms),
            "cull_ms": times(self.cull_ms),
        })
    }
}

/// The value below which a share of all lies; 0 of none.
pub(crate) fn percentile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (share * (values.len().saturating_sub(1)) as f64).round() as usize;
    values.get(index).copied().unwrap_or(0.0)
}
