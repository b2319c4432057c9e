//! Statistics over many attacks.

use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

use super::output;
use super::passes::{Method, Pass};
use super::stats::{Run, Times};

/// Statistics of one method.
pub(crate) struct Summary {
    method: Method,
    attacks: usize,
    avoided: usize,
    /// Attacks that hit the continued motion, and how many of these are avoided.
    would_hit: usize,
    dodged: usize,
    /// Hits that no candidate avoids, according to the check.
    unavoidable: usize,
    checked: bool,
    grid_used: usize,
    grid_answered: usize,
    /// Median number of candidates that end in an evasion, and of all candidates.
    with_evasion: f64,
    candidates: f64,
    /// Share of the candidates with maps that the maps removed.
    culled_share: f64,
    /// Clearance of the avoided attacks, in metres; `None` without one.
    median_clearance: Option<f64>,
    query_ms: Times,
    cull_ms: Times,
    /// Number of answers with an evasion.
    evading: usize,
}

/// The exact whole search among the passes, which the others' hits are checked against.
pub(crate) fn exact(passes: &[Pass]) -> Option<&Pass> {
    passes.iter().find(|pass| pass.method == Method::EXACT)
}

impl Summary {
    /// Hits are checked against `exact`, or against the answer's own tests without it.
    pub(crate) fn of(pass: &Pass, exact: Option<&Pass>) -> Self {
        let runs = &pass.runs;
        let sum = |of: fn(&Run) -> usize| runs.iter().map(of).sum::<usize>();
        let count = |is: fn(&Run) -> bool| runs.iter().filter(|run| is(run)).count();
        let (culled, mapped) = (sum(|r| r.counts.culled), sum(Run::mapped));
        let values = |of: fn(&Run) -> f64| runs.iter().map(of).collect::<Vec<_>>();
        let clean = runs.iter().filter(|r| r.avoided);
        let clean: Vec<f64> = clean.map(|r| f64::from(r.clearance)).collect();
        let unavoidable = runs.iter().enumerate().filter(|(index, run)| {
            let by_exact = exact.map(|exact| !exact.runs[*index].avoided);
            !run.avoided && by_exact.unwrap_or(run.all_hit)
        });
        Self {
            method: pass.method,
            attacks: runs.len(),
            avoided: clean.len(),
            would_hit: count(|run| run.would_hit),
            dodged: count(|run| run.would_hit && run.avoided),
            unavoidable: unavoidable.count(),
            checked: exact.is_some(),
            grid_used: count(Run::used_grid),
            grid_answered: count(|run| run.source == sabaki::query::Source::Grid),
            with_evasion: percentile(values(|r| r.counts.with_evasion as f64), 0.5),
            candidates: percentile(values(|r| r.counts.candidates as f64), 0.5),
            culled_share: culled as f64 / mapped.max(1) as f64,
            median_clearance: (!clean.is_empty()).then(|| percentile(clean, 0.5)),
            query_ms: Times::of(runs, Run::query_ms),
            cull_ms: Times::of(runs, |r| r.cull_ms),
            evading: count(|run| run.evasion.is_some()),
        }
    }

    fn hit_though_avoidable(&self) -> usize {
        self.attacks - self.avoided - self.unavoidable
    }

    pub(crate) fn to_json(&self) -> Value {
        json!({
            "cull": self.method.cull.name(),
            "grid": self.method.grid_name(),
            "attacks": self.attacks,
            "avoided": self.avoided,
            "would_hit": self.would_hit,
            "avoided_of_would_hit": self.dodged,
            "hit": self.attacks - self.avoided,
            "unavoidable": self.unavoidable,
            "hit_though_avoidable": self.hit_though_avoidable(),
            "checked_by_exact": self.checked,
            "grid_used": self.grid_used,
            "grid_answered": self.grid_answered,
            "by_evasion": self.evading,
            "candidates": self.candidates,
            "candidates_with_evasion": self.with_evasion,
            "culled_share": self.culled_share,
            "median_clearance": self.median_clearance,
            "query_ms": self.query_ms.to_json(),
            "cull_ms": self.cull_ms.to_json(),
        })
    }
}

/// All passes as a table, with the reference of their hits.
pub(crate) fn table(passes: &[Pass]) -> String {
    let head = [
        "culled by",
        "grid",
        "attacks, would hit",
        "avoided: of those, of all",
        "hit though avoidable",
        "grid used, answered",
        "by an evasion",
        "candidates, with evasion",
        "culled, of those with maps",
        "clearance cm, median",
        "query ms, median / p99",
        "culling ms, median / p99",
    ];
    let mut table = output::table(&head, 2);
    let exact = exact(passes);
    for pass in passes {
        let s = Summary::of(pass, exact);
        let share = |part: usize, whole: usize| match whole {
            0 => "-".to_owned(),
            _ => format!("{:.1}%", 100.0 * part as f64 / whole as f64),
        };
        let percent = |part: usize| share(part, s.attacks);
        let metres = s.median_clearance;
        table.add_row(vec![
            s.method.cull.name().to_owned(),
            s.method.grid_name().to_owned(),
            format!("{}, {}", s.attacks, s.would_hit),
            format!("{}, {}", share(s.dodged, s.would_hit), percent(s.avoided)),
            s.hit_though_avoidable().to_string(),
            format!("{}, {}", percent(s.grid_used), percent(s.grid_answered)),
            percent(s.evading),
            format!("{:.0}, {:.0}", s.candidates, s.with_evasion),
            format!("{:.0}%", 100.0 * s.culled_share),
            metres.map_or("-".to_owned(), |metres| format!("{:.1}", 100.0 * metres)),
            s.query_ms.text(2),
            s.cull_ms.text(3),
        ]);
    }
    let check = match exact {
        Some(_) => {
            "hit though avoidable: attacks that hit, but that the exact search over the whole graph avoids."
        }
        None => {
            "hit though avoidable: attacks that hit with a candidate left untested; --check compares with the exact search over the whole graph."
        }
    };
    format!("{table}\nwould hit: attacks that hit a character whose motion continues. {check}")
}
