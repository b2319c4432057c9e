//! Statistics over many attacks.

use sabaki::maps::BakedGraph;
use sabaki::query::Source;
use sabaki_app::percentile::percentile;
use serde_json::{Value, json};

use super::output;
use super::queries::{Method, Pass, Run, Times};

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
fn exact(passes: &[Pass]) -> Option<&Pass> {
    passes.iter().find(|pass| pass.method == Method::EXACT)
}

impl Summary {
    /// One summary for each pass. Hits are checked against the exact whole search among them, or against the answer's own tests without it.
    pub(crate) fn of_all(passes: &[Pass]) -> Vec<Self> {
        let exact = exact(passes);
        passes.iter().map(|pass| Self::new(pass, exact)).collect()
    }

    fn new(pass: &Pass, exact: Option<&Pass>) -> Self {
        let runs = &pass.runs;
        let sum = |number: fn(&Run) -> usize| runs.iter().map(number).sum::<usize>();
        let count = |is: fn(&Run) -> bool| runs.iter().filter(|run| is(run)).count();
        let (culled, mapped) = (sum(|r| r.counts.culled), sum(Run::mapped));
        let values = |number: fn(&Run) -> f64| runs.iter().map(number).collect::<Vec<_>>();
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
            grid_answered: count(|run| run.source == Source::Grid),
            with_evasion: percentile(values(|r| r.counts.with_evasion as f64), 0.5),
            candidates: percentile(values(|r| r.counts.candidates as f64), 0.5),
            culled_share: culled as f64 / mapped.max(1) as f64,
            median_clearance: (!clean.is_empty()).then(|| percentile(clean, 0.5)),
            query_ms: Times::new(runs, Run::query_ms),
            cull_ms: Times::new(runs, |r| r.cull_ms),
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

fn share(part: usize, whole: usize) -> String {
    match whole {
        0 => "-".to_owned(),
        _ => format!("{:.1}%", 100.0 * part as f64 / whole as f64),
    }
}

/// What each method answers, and what it costs: a table each.
pub(crate) fn tables(passes: &[Pass]) -> String {
    let head = [
        "culled by",
        "grid",
        "attacks",
        "avoided",
        "would hit",
        "of them",
        "missed",
        "evading",
        "grid has",
        "by grid",
    ];
    let mut answers = output::table(&head, 2);
    let head = [
        "culled by",
        "grid",
        "candidates",
        "to evasions",
        "culled",
        "clearance",
        "query ms",
        "culling ms",
    ];
    let mut costs = output::table(&head, 2);
    for s in Summary::of_all(passes) {
        let name = [
            s.method.cull.name().to_owned(),
            s.method.grid_name().to_owned(),
        ];
        let percent = |part: usize| share(part, s.attacks);
        answers.add_row(name.clone().into_iter().chain([
            s.attacks.to_string(),
            percent(s.avoided),
            s.would_hit.to_string(),
            share(s.dodged, s.would_hit),
            s.hit_though_avoidable().to_string(),
            percent(s.evading),
            percent(s.grid_used),
            percent(s.grid_answered),
        ]));
        let clearance = s.median_clearance;
        costs.add_row(name.into_iter().chain([
            format!("{:.0}", s.candidates),
            format!("{:.0}", s.with_evasion),
            format!("{:.0}%", 100.0 * s.culled_share),
            clearance.map_or("-".to_owned(), |metres| format!("{:.1} cm", 100.0 * metres)),
            s.query_ms.text(2),
            s.cull_ms.text(2),
        ]));
    }
    let missed = match exact(passes) {
        Some(_) => "the attack hits, but the exact search of the whole graph avoids it",
        None => {
            "the attack hits, and a candidate was left untested (--check compares with the exact search)"
        }
    };
    format!(
        "{answers}\n\
         would hit: attacks that hit if the motion goes on, and how many of them are avoided.\n\
         missed: {missed}.\n\
         evading: answers that perform an evasion. grid has: attacks whose candidates\n\
         come from the grid. by grid: answers that do.\n\n\
         {costs}\n\
         Medians of one query; times: median / 99th percentile. culled: share of the candidates with maps.\n"
    )
}

/// One line for each attack.
pub(crate) fn attack_table(baked: &BakedGraph, runs: &[Run]) -> comfy_table::Table {
    let head = [
        "attack",
        "answer",
        "by",
        "rate p",
        "clearance",
        "candidates",
        "culled",
        "ms",
    ];
    let mut table = output::table(&head, 3);
    for (index, run) in runs.iter().enumerate() {
        table.add_row([
            index.to_string(),
            if run.avoided { "avoided" } else { "HIT" }.to_owned(),
            run.evasion(baked)
                .unwrap_or_else(|| "continued motion".to_owned()),
            format!("{:.2}", run.rate),
            format!("{:.1} cm", run.clearance * 100.0),
            run.counts.candidates.to_string(),
            run.counts.culled.to_string(),
            format!("{:.2}", run.query_ms()),
        ]);
    }
    table
}
