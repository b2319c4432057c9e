//! `sabaki dodge --explain`: one query, with the outcome of each candidate.

use std::fmt::Write;

use sabaki::anim::Warp;
use sabaki::archive;
use sabaki::graph::{EdgeId, EdgeMotion};
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, CandidateReport, CandidateResult, QuerySettings, RateError};
use sabaki_fixtures::throw::Throw;
use sabaki_import::export::{
    ExportedAnswer, describe_edge, describe_evasion, document, evasion_placement,
};
use serde_json::{Value, json};

use super::Failure;
use super::culling::Culling;
use super::export::recorded;
use super::queries::{Method, QueryRunner, Run};

/// Width of a line, in characters.
const WIDTH: usize = 100;
/// Number of candidates listed for each outcome, unless `--all` is given.
const LISTED: usize = 8;

/// A query and its answer.
pub(crate) struct Explained<'a> {
    baked: &'a BakedGraph,
    throw: &'a Throw,
    method: Method,
    pub(crate) settings: QuerySettings,
    runner: QueryRunner<'a>,
    pub(crate) run: Run,
}

/// Asks the query, and lists candidates that are not in time, too.
pub(crate) fn ask<'a>(
    baked: &'a BakedGraph,
    throw: &'a Throw,
    method: Method,
    culling: &mut Culling,
) -> Result<Explained<'a>, Failure> {
    let settings = QuerySettings {
        list_late: true,
        ..method.settings()
    };
    let mut runner = QueryRunner::new(baked);
    let run = runner.ask(method, &settings, throw, culling)?;
    Ok(Explained {
        baked,
        throw,
        method,
        settings,
        runner,
        run,
    })
}

/// A group of candidates in the list.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Chosen,
    Outscored,
    Untested,
    Hit,
    TooHard,
    Culled,
    NotInTime,
}

/// The outcomes, best first, with their meanings.
const OUTCOMES: [(Outcome, &str); 7] = [
    (Outcome::Chosen, "chosen"),
    (
        Outcome::Outscored,
        "outscored: another candidate has a smaller V",
    ),
    (
        Outcome::Untested,
        "not tested: no clearance would make V smaller than that of the chosen one",
    ),
    (Outcome::Hit, "hit: by the exact test"),
    (
        Outcome::TooHard,
        "too hard: the body would push off harder than in the clips",
    ),
    (Outcome::Culled, "culled: the body maps overlap the attack"),
    (
        Outcome::NotInTime,
        "not in time: no rate starts the evasion when the attack starts",
    ),
];

impl Outcome {
    fn of(report: &CandidateReport) -> Self {
        match report.result {
            CandidateResult::Chosen => Self::Chosen,
            CandidateResult::Outscored if report.clearance.is_none() => Self::Untested,
            CandidateResult::Outscored => Self::Outscored,
            CandidateResult::Hit => Self::Hit,
            CandidateResult::TooHard => Self::TooHard,
            CandidateResult::Culled => Self::Culled,
            CandidateResult::NotInTime => Self::NotInTime,
        }
    }
}

impl Explained<'_> {
    pub(crate) fn answer(&self) -> &Answer {
        &self.runner.answer
    }

    /// Calls `use_it` with the answer as exported files hold it.
    fn with_exported<T>(&self, use_it: impl FnOnce(ExportedAnswer<'_>) -> T) -> Result<T, Failure> {
        let graph = archive::checksum(self.baked);
        let graph = graph.map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(use_it(ExportedAnswer {
            baked: self.baked,
            request: &recorded(graph, self.throw, &self.settings, self.method),
            answer: self.answer(),
        }))
    }

    /// Every candidate as JSON.
    pub(crate) fn document(&self, index: u64) -> Result<Value, Failure> {
        let mut document = self.with_exported(document)?;
        document["attack_index"] = json!(index);
        document["cull"] = json!(self.method.cull.name());
        Ok(document)
    }

    /// The query, the answer, and the candidates by outcome; of long lists the best, unless `all` are wanted.
    pub(crate) fn text(&self, index: u64, all: bool) -> Result<String, Failure> {
        let mut text = self.summary(index);
        self.with_exported(|exported| {
            for (outcome, meaning) in OUTCOMES {
                list(&mut text, exported, outcome, meaning, all);
            }
        })?;
        let lines = text.lines().map(|line| shortened(line, WIDTH) + "\n");
        Ok(lines.collect())
    }

    fn summary(&self, index: u64) -> String {
        let answer = self.answer();
        let (playhead, graph) = (self.throw.playhead, self.baked.graph());
        let mut text = format!(
            "Attack {index}, culled by {}, grid {}; candidates from: {}\n",
            self.method.cull.name(),
            self.method.grid_name(),
            answer.source.describe(),
        );
        let place = playhead.placement(graph);
        let _ = writeln!(
            text,
            "moment    {}, {:.2} frames on; {:.3} s to the next node\n\
         stands    at x {:.2} z {:.2} m, facing {:.0}°",
            describe_edge(self.baked, playhead.edge),
            playhead.frame,
            playhead.seconds_to_next_node(graph),
            // Prints 0 rather than -0.
            place.x + 0.0,
            place.z + 0.0,
            place.heading().to_degrees(),
        );
        for (number, sphere) in self.throw.attack.spheres().iter().enumerate() {
            let ends = [&sphere.keys()[0], &sphere.keys()[sphere.keys().len() - 1]];
            let [from, to] = ends.map(|key| {
                let [x, y, z] = key.center.to_array();
                format!("({x:.2}, {y:.2}, {z:.2}) at {:.3} s", key.t)
            });
            let _ = writeln!(
                text,
                "attack    sphere {number}: radius {:.2} m, {} keys, from {from} to {to}",
                ends[0].radius,
                sphere.keys().len(),
            );
        }
        let counts = answer.counts;
        let _ = writeln!(
            text,
            "answer    {}, clearance {:.1} cm at {:.3} s; {:.2} ms\n\
         counted   {} candidates, {} with an evasion, {} clean\n\
         rejected  {} culled ({} tested), {} hit, {} too hard, {} late",
            if answer.avoided { "avoided" } else { "HIT" },
            answer.clearance().metres * 100.0,
            answer.clearance().time,
            self.run.query_ms(),
            counts.candidates,
            counts.with_evasion,
            counts.clean,
            counts.culled,
            counts.reconsidered,
            counts.hits,
            counts.too_hard,
            counts.not_in_time,
        );
        if let Some(warp) = answer.chosen().warp {
            text.push_str(&warp_line(&warp));
        }
        text.push_str(
            "\np: rate of the way there. texels: of the attack on the body maps, the outer maps (0: proven\n\
             clean) and the evasion map. V = weighted sum of Va (evasion region missed), Vd (m) and\n\
             Vt ((p-1)²). clear: clearance, cm.\n",
        );
        text
    }
}

/// Lists the candidates with one outcome, best first.
fn list(
    text: &mut String,
    exported: ExportedAnswer<'_>,
    outcome: Outcome,
    meaning: &str,
    all: bool,
) {
    let reports = exported.answer.candidates.iter();
    let mut some: Vec<&CandidateReport> = reports
        .filter(|report| Outcome::of(report) == outcome)
        .collect();
    if some.is_empty() {
        return;
    }
    some.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    let _ = writeln!(text, "\n{meaning} ({})", some.len());
    if outcome != Outcome::NotInTime {
        let _ = writeln!(
            text,
            "  {:>5}  {:<22} {:>22}  {:>26}  {:>7}",
            "p",
            "evades at x, z, facing",
            "texels body/outer/evas.",
            "Va    Vd    Vt     V",
            "clear"
        );
    }
    let shown = if all { some.len() } else { LISTED };
    for report in some.iter().take(shown) {
        list_candidate(text, exported, report);
    }
    if let Some(more) = some.len().checked_sub(shown + 1) {
        let _ = writeln!(text, "  ... and {} more; --all lists them", more + 1);
    }
}

/// Two lines: the numbers, then the path.
fn list_candidate(text: &mut String, exported: ExportedAnswer<'_>, report: &CandidateReport) {
    match &report.rate {
        Err(reason) => {
            let reason = match reason {
                RateError::OutOfRange { rate } if rate.is_infinite() => {
                    "too long at any rate".to_owned()
                }
                _ => reason.to_string(),
            };
            let _ = writeln!(text, "  {reason}");
        }
        Ok(rate) => {
            let place = evasion_placement(exported, report);
            let without = match report.layer {
                Some(_) => "upper body only",
                None => "no evasion",
            };
            let place = place.map_or(without.to_owned(), |at| {
                let degrees = at.heading().to_degrees();
                format!("{:.2}, {:.2}, {degrees:.0}°", at.x, at.z)
            });
            let texels = report.overlap.map_or("-".to_owned(), |overlap| {
                format!("{}/{}/{}", overlap.body, overlap.outer, overlap.evasion)
            });
            let score = report.score.map_or("-".to_owned(), |score| {
                format!(
                    "{:.2}  {:.2}  {:.2}  {:.3}",
                    score.avoid, score.distance, score.time, score.total
                )
            });
            let clear = report.clearance.map_or("-".to_owned(), |clearance| {
                format!("{:.1}", clearance.metres * 100.0)
            });
            let _ = writeln!(
                text,
                "  {:>5.2}  {place:<22} {texels:>22}  {score:>26}  {clear:>7}",
                rate.rate
            );
        }
    }
    let edges: Vec<EdgeId> = exported.answer.path(exported.baked, report).collect();
    let mut path = describe_path(exported.baked, &edges, report.evasion);
    if let Some(entered) = report.entry {
        let (delay, blend) = (entered.delay, entered.entry.blend);
        path = format!("entered after {delay:.1} s within {blend:.2} s: {path}");
    }
    if let Some(layer) = report.layer {
        let (start, end) = (layer.envelope.start, layer.envelope.end);
        path = format!("upper body from {start:.2} to {end:.2} s, legs go on: {path}");
    }
    let _ = writeln!(text, "         {path}");
}

/// How the chosen motion is bent.
fn warp_line(warp: &Warp) -> String {
    let (bend, envelope) = (warp.bend, warp.envelope);
    let [left_foot, right_foot, left_hand, right_hand] = bend.ends.map(|end| end.length() * 100.0);
    format!(
        "warped    from {:.2} to {:.2} s, in full from {:.2} to {:.2} s, {:.0} ms ahead\n\
         bent      spine {:.1}°, pelvis {:.1} cm, feet {left_foot:.1} and {right_foot:.1} cm, \
         hands {left_hand:.1} and {right_hand:.1} cm\n",
        envelope.start,
        envelope.end,
        envelope.full,
        envelope.release,
        bend.ahead * 1e3,
        bend.spine.length().to_degrees(),
        bend.pelvis.length() * 100.0,
    )
}

/// Sort key among candidates with one outcome; smaller is better.
fn rank(report: &CandidateReport) -> f32 {
    let by_clearance = report.clearance.map(|clearance| -clearance.metres);
    let by_maps = report.overlap.map(|overlap| overlap.body as f32);
    match report.result {
        CandidateResult::Chosen | CandidateResult::Outscored => {
            report.score.map_or(f32::MAX, |score| score.total)
        }
        CandidateResult::Hit | CandidateResult::TooHard => by_clearance.unwrap_or(f32::MAX),
        CandidateResult::Culled => by_maps.unwrap_or(f32::MAX),
        CandidateResult::NotInTime => match report.rate {
            Err(RateError::OutOfRange { rate }) => rate.ln().abs(),
            _ => f32::INFINITY,
        },
    }
}

/// Describes a path. Consecutive edges of one clip are merged.
fn describe_path(baked: &BakedGraph, edges: &[EdgeId], evasion: Option<EdgeId>) -> String {
    let graph = baked.graph();
    let is_stretch = |edge: EdgeId| graph.edge(edge).motion == EdgeMotion::Clip;
    let mut words: Vec<String> = Vec::new();
    for part in edges.chunk_by(|&a, &b| is_stretch(a) && is_stretch(b)) {
        let (first, last) = (part[0], part[part.len() - 1]);
        words.push(if part.len() == 1 {
            describe_edge(baked, first)
        } else {
            let from = graph.node(graph.edge(first).from);
            let to = graph.node(graph.edge(last).to);
            format!(
                "{} {}-{}",
                graph.clip(from.clip).name(),
                from.frame,
                to.frame
            )
        });
    }
    if let Some(evasion) = evasion {
        let event = describe_evasion(baked, evasion);
        words.push(format!("evades: {}", event.unwrap_or_default()));
    }
    if words.is_empty() {
        return "continued motion".to_owned();
    }
    words.join(", ")
}

/// Shortens a text by leaving out its middle.
fn shortened(text: &str, width: usize) -> String {
    let letters: Vec<char> = text.chars().collect();
    if letters.len() <= width {
        return text.to_owned();
    }
    let (head, tail) = (width / 3, width - width / 3 - 5);
    let part = |letters: &[char]| letters.iter().collect::<String>();
    format!(
        "{} ... {}",
        part(&letters[..head]),
        part(&letters[letters.len() - tail..])
    )
}
