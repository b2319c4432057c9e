//! `sabaki dodge --explain`: one query, with the outcome of each candidate.

use std::fmt::Write;

use sabaki::anim::Warp;
use sabaki::archive;
use sabaki::graph::{EdgeId, EdgeMotion};
use sabaki::maps::BakedGraph;
use sabaki::query::{Answer, CandidateReport, CandidateResult, QuerySettings, RateError};
use sabaki_fixtures::throw::Throw;
use sabaki_import::RecordedRequest;
use sabaki_import::export::{
    ExportedAnswer, describe_edge, describe_evasion, document, evasion_placement,
};
use serde_json::{Value, json};

use super::Failure;
use super::culling::Culling;
use super::export::recorded;
use super::output::usage;
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
    /// The query as exported files hold it.
    pub(crate) request: RecordedRequest,
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
    let graph = archive::checksum(baked).map_err(usage)?;
    Ok(Explained {
        baked,
        throw,
        method,
        request: recorded(graph, throw, &settings, method),
        runner,
        run,
    })
}

/// The group of a candidate in the list, best first, with its meaning.
fn outcome(report: &CandidateReport) -> (u8, &'static str) {
    match report.result {
        CandidateResult::Chosen => (0, "chosen"),
        CandidateResult::Outscored if report.clearance.is_some() => {
            (1, "outscored: another candidate has a smaller V")
        }
        CandidateResult::Outscored => (
            2,
            "not tested: no clearance would make V smaller than that of the chosen one",
        ),
        CandidateResult::Hit => (3, "hit: by the exact test"),
        CandidateResult::TooHard => (
            4,
            "too hard: the body would push off harder than in the clips",
        ),
        CandidateResult::Culled => (5, "culled: the body maps overlap the attack"),
        CandidateResult::NotInTime => (
            6,
            "not in time: no rate starts the evasion when the attack starts",
        ),
    }
}

impl Explained<'_> {
    pub(crate) fn answer(&self) -> &Answer {
        &self.runner.answer
    }

    fn exported(&self) -> ExportedAnswer<'_> {
        ExportedAnswer {
            baked: self.baked,
            request: &self.request,
            attack: &self.throw.attack,
            answer: self.answer(),
        }
    }

    /// Every candidate as JSON.
    pub(crate) fn document(&self, index: u64) -> Value {
        let mut document = document(self.exported());
        document["attack_index"] = json!(index);
        document["cull"] = json!(self.method.cull.name());
        document
    }

    /// The query, the answer, and the candidates by outcome; of long lists the best, unless `all` are wanted.
    pub(crate) fn text(&self, index: u64, all: bool) -> String {
        let mut text = self.summary(index);
        let mut reports: Vec<_> = self.answer().candidates.iter().collect();
        let order = |report| (outcome(report).0, rank(report));
        reports.sort_by(|&a, &b| {
            let (a, b) = (order(a), order(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        for some in reports.chunk_by(|a, b| outcome(a) == outcome(b)) {
            list(&mut text, self.exported(), some, all);
        }
        let lines = text.lines().map(|line| shortened(line, WIDTH) + "\n");
        lines.collect()
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
            rounded(place.x, 0.01),
            rounded(place.z, 0.01),
            rounded(place.heading().to_degrees(), 1.0),
        );
        for (number, sphere) in self.throw.attack.spheres().iter().enumerate() {
            let ends = [&sphere.keys()[0], &sphere.keys()[sphere.keys().len() - 1]];
            let [from, to] = ends.map(|key| {
                let [x, y, z] = key.center.to_array();
                format!("({x:.2}, {y:.2}, {z:.2}) at {:.3} s", key.t)
            });
            let _ = writeln!(
                text,
                "attack    sphere {number}: radius {:.2} m, {from} to {to}",
                ends[0].radius,
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

fn list(text: &mut String, exported: ExportedAnswer<'_>, some: &[&CandidateReport], all: bool) {
    let _ = writeln!(text, "\n{} ({})", outcome(some[0]).1, some.len());
    if some[0].result != CandidateResult::NotInTime {
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

/// A number in whole units, and 0 rather than -0.
fn rounded(value: f32, unit: f32) -> f32 {
    (value / unit).round() * unit + 0.0
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
