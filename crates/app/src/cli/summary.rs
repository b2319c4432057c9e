//! Statistics over many attacks.

use sabaki::maps::BakedGraph;
use sabaki::query::Source;
use sabaki_app::percentile::percentile;
use serde::Serialize;
use serde_json::{Value, json};

use super::output;
use super::queries::{Method, Pass, Run, Times};

/// Statistics of one method.
#[derive(Serialize)]
struct Summary {
    cull: &'static str,
    grid: &'static str,
    attacks: usize,
    avoided: usize,
    /// Attacks that hit the continued motion, and how many of these are avoided.
    would_hit: usize,
    avoided_of_would_hit: usize,
    hit: usize,
    /// Hits that no candidate avoids, according to the check.
    unavoidable: usize,
    hit_though_avoidable: usize,
    checked_by_exact: bool,
    grid_used: usize,
    grid_answered: usize,
    /// Median number of candidates that end in an evasion, and of all candidates.
    candidates_with_evasion: f64,
    candidates: f64,
    /// Share of the candidates with maps that the maps removed.
    culled_share: f64,
    /// Clearance of the avoided attacks, in metres; `None` without one.
    median_clearance: Option<f64>,
    query_ms: Times,
    cull_ms: Times,
    /// Number of answers with an evasion.
    by_evasion: usize,
}

/// The exact whole search among the passes, which the others' hits are checked against.
fn exact(passes: &[Pass]) -> Option<&Pass> {
    passes.iter().find(|pass| pass.method == Method::EXACT)
}

impl Summary {
    /// One summary for each pass. Hits are checked against the exact whole search among them, or against the answer's own tests without it.
    fn of_all(passes: &[Pass]) -> Vec<Self> {
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
        let (hit, unavoidable) = (runs.len() - clean.len(), unavoidable.count());
        Self {
            cull: pass.method.cull.name(),
            grid: pass.method.grid_name(),
            attacks: runs.len(),
            avoided: clean.len(),
            would_hit: count(|run| run.would_hit),
            avoided_of_would_hit: count(|run| run.would_hit && run.avoided),
            hit,
            unavoidable,
            hit_though_avoidable: hit - unavoidable,
            checked_by_exact: exact.is_some(),
            grid_used: count(Run::used_grid),
            grid_answered: count(|run| run.source == Source::Grid),
            candidates_with_evasion: percentile(values(|r| r.counts.with_evasion as f64), 0.5),
            candidates: percentile(values(|r| r.counts.candidates as f64), 0.5),
            culled_share: culled as f64 / mapped.max(1) as f64,
            median_clearance: (!clean.is_empty()).then(|| percentile(clean, 0.5)),
            query_ms: Times::new(runs, Run::query_ms),
            cull_ms: Times::new(runs, |r| r.cull_ms),
            by_evasion: count(|run| run.evasion.is_some()),
        }
    }
}

/// The statistics of the first pass, and in `rows` those of all.
pub(crate) fn document(passes: &[Pass]) -> Value {
    let rows = Summary::of_all(passes);
    let mut document = json!(rows[0]);
    document["rows"] = json!(rows);
    document
}

fn share(part: usize, whole: usize) -> String {
    match whole {
        0 => "-".to_owned(),
        _ => format!("{:.1}%", 100.0 * part as f64 / whole as f64),
    }
}

/// What each method answers, and what it costs: a table each.
pub(crate) fn tables(passes: &[Pass]) -> String {
    let all = Summary::of_all(passes);
    let answers = output::table_of(
        2,
        &all,
        &[
            ("culled by", &|s| s.cull.to_owned()),
            ("grid", &|s| s.grid.to_owned()),
            ("attacks", &|s| s.attacks.to_string()),
            ("avoided", &|s| share(s.avoided, s.attacks)),
            ("would hit", &|s| s.would_hit.to_string()),
            ("of them", &|s| share(s.avoided_of_would_hit, s.would_hit)),
            ("missed", &|s| s.hit_though_avoidable.to_string()),
            ("evading", &|s| share(s.by_evasion, s.attacks)),
            ("grid has", &|s| share(s.grid_used, s.attacks)),
            ("by grid", &|s| share(s.grid_answered, s.attacks)),
        ],
    );
    let centimetres = |metres: f64| format!("{:.1} cm", 100.0 * metres);
    let costs = output::table_of(
        2,
        &all,
        &[
            ("culled by", &|s| s.cull.to_owned()),
            ("grid", &|s| s.grid.to_owned()),
            ("candidates", &|s| format!("{:.0}", s.candidates)),
            ("to evasions", &|s| {
                format!("{:.0}", s.candidates_with_evasion)
            }),
            ("culled", &|s| format!("{:.0}%", 100.0 * s.culled_share)),
            ("clearance", &|s| {
                s.median_clearance.map_or("-".to_owned(), centimetres)
            }),
            ("query ms", &|s| s.query_ms.text(2)),
            ("culling ms", &|s| s.cull_ms.text(2)),
        ],
    );
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
    output::table_of(
        3,
        runs.iter().enumerate(),
        &[
            ("attack", &|(index, _)| index.to_string()),
            ("answer", &|(_, run)| {
                if run.avoided { "avoided" } else { "HIT" }.to_owned()
            }),
            ("by", &|(_, run)| {
                let evasion = run.evasion(baked);
                evasion.unwrap_or_else(|| "continued motion".to_owned())
            }),
            ("rate p", &|(_, run)| format!("{:.2}", run.rate)),
            ("clearance", &|(_, run)| {
                format!("{:.1} cm", run.clearance * 100.0)
            }),
            ("candidates", &|(_, run)| run.counts.candidates.to_string()),
            ("culled", &|(_, run)| run.counts.culled.to_string()),
            ("ms", &|(_, run)| format!("{:.2}", run.query_ms())),
        ],
    )
}
