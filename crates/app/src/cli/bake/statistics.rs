//! Statistics of a graph and of how it was built.

use sabaki::anim::EventKind;
use sabaki::graph::{BuildReport, DroppedPart, MotionGraph};
use sabaki::maps::BakedGraph;
use serde::Serialize;
use serde_json::{Value, json};

use super::super::output::counted;
use super::run::Baked;

fn count(graph: &MotionGraph, kind: EventKind) -> usize {
    graph
        .events()
        .iter()
        .filter(|event| event.kind == kind)
        .count()
}

/// Largest number of joined clips, and of clips that lose seconds, that are listed; the JSON document has all.
const MOST_JOINED: usize = 20;
const MOST_DROPPED: usize = 8;

/// Seconds of a clip below which a loss is not listed: the length of a blend.
const BLEND: f64 = 0.5;

/// A clip's name in at most 48 letters.
fn short(name: &str) -> String {
    const MOST: usize = 48;
    let length = name.chars().count();
    match length > MOST {
        true => format!(
            "…{}",
            name.chars().skip(length + 1 - MOST).collect::<String>()
        ),
        false => name.to_owned(),
    }
}

/// What is not in the graph, and what would keep it, a line for each clip.
fn islands(report: &BuildReport) -> Vec<String> {
    let dropped = &report.dropped;
    let apart = report.islands.iter().map(|island| {
        let clip = short(&island.clip);
        match island.links {
            [Some(into), Some(out)] => format!(
                "island {clip}: in {into:.2} m, out {out:.2} m; --threshold {:.2} joins it",
                into.max(out) + 0.005
            ),
            _ => format!("island {clip}: shorter than a blend, or all of it is one event"),
        }
    });
    let is_known = |clip: &&String| !report.islands.iter().any(|island| island.clip == **clip);
    let whole = dropped.clips.iter().filter(is_known);
    let whole = whole.map(|clip| format!("island {}: it has no motion to join", short(clip)));
    let long = |part: &&DroppedPart| part.start + part.end > BLEND;
    let parts: Vec<String> = dropped.parts.iter().filter(long).map(part).collect();
    let hint = parts.first().map(|_| {
        "  nothing near leads into these starts, or out of these ends; a blend takes 1/3 s of a clip".to_owned()
    });
    let parts = parts.into_iter().take(MOST_DROPPED);
    apart.chain(whole).chain(parts).chain(hint).collect()
}

fn part(DroppedPart { clip, start, end }: &DroppedPart) -> String {
    let places = [(start, "first"), (end, "last")].into_iter();
    let lost = places.filter(|(seconds, _)| **seconds > 0.0);
    let lost = lost.map(|(seconds, place)| format!("the {place} {seconds:.1} s"));
    let lost = lost.collect::<Vec<_>>().join(" and ");
    format!("dropped of {}: {lost}", short(clip))
}

/// Statistics of a graph as JSON, with stable keys.
pub(crate) fn statistics(baked: &BakedGraph) -> Value {
    let graph = baked.graph();
    let entries = baked.entry_report();
    let mut value = json!({
        "joints": graph.skeleton().len(),
        "frame_rate": graph.frame_rate(),
        "clips": graph.clips().len(),
        "nodes": graph.nodes().len(),
        "edges": graph.edges().len(),
        "transitions": graph.transitions(),
        "seconds_kept": graph.seconds_kept(),
        "evasions": count(graph, EventKind::Evasion),
        "attacks": count(graph, EventKind::Attack),
        "body_spheres": baked.body().spheres.len(),
        "props": baked.body().props.len(),
        "map_bytes": baked.atlas().bytes(),
        "evasion_within": {
            "0.5": baked.responsive_share(0.5),
            "1.0": baked.responsive_share(1.0),
            "1.5": baked.responsive_share(1.5),
        },
        "push_limit": baked.push_limit(),
        "clip_bytes": ClipSizes::new(graph),
        "entries": entries,
    });
    value["entries"]["share"] = json!(entries.share());
    value
}

pub(crate) fn bake_statistics(baked: &Baked) -> Value {
    let mut value = statistics(&baked.graph);
    value["build_seconds"] = json!(baked.seconds);
    value["report"] = json!(baked.report);
    value["islands"] = json!(islands(&baked.report));
    value["foot_slide"] = json!(baked.feet);
    value["warnings"] = json!(baked.warnings);
    value["left_out"] = json!(baked.left_out);
    value["figure"] = json!(baked.joints);
    value["fits"] = json!(baked.figure.fits);
    value
}

/// A graph in one line.
pub(crate) fn headline(baked: &BakedGraph) -> String {
    let graph = baked.graph();
    format!(
        "{}, {:.1} s; {}, {}; {}, {}\n",
        counted(graph.clips().len(), "clip"),
        graph.seconds_kept(),
        counted(graph.nodes().len(), "node"),
        counted(graph.edges().len(), "edge"),
        counted(count(graph, EventKind::Evasion), "evasion"),
        counted(count(graph, EventKind::Attack), "attack"),
    )
}

/// A graph as text.
pub(crate) fn describe(baked: &BakedGraph) -> String {
    let graph = baked.graph();
    let entries = baked.entry_report();
    let moments = entries.moments.max(1) as f64;
    let [all, events] = [entries.unbranched, entries.unbranched_in_events];
    let percent = |seconds| 100.0 * baked.responsive_share(seconds);
    format!(
        "{headline}{clips}\n\
         {transitions} of the edges are transitions; {maps:.1} MB of maps\n\
         evasions: one can start within 0.5 s from {:.0}% of all moments, within 1.0 s from {:.0}%,\n\
         \x20 within 1.5 s from {:.0}%; one can be entered at once from {:.0}%\n\
         entries: {:.0} for each moment, and {:.0} layers over legs that go on; none for {:.2} s at most\n\
         seconds without a branch point (entry, exit, choice of edges): {:.2} in the median, {:.2} at most;\n\
         \x20 in evasions and attacks {:.2} and {:.2}\n\
         push: the centre of mass accelerates by {:.1} m/s² at most in answers, by what it does in the clips\n",
        percent(0.5),
        percent(1.0),
        percent(1.5),
        100.0 * entries.share(),
        entries.entries as f64 / moments,
        entries.layers as f64 / moments,
        entries.longest_without,
        all.median,
        all.longest,
        events.median,
        events.longest,
        baked.push_limit(),
        headline = headline(baked),
        clips = ClipSizes::new(graph).text(graph.clips().len()),
        transitions = graph.transitions(),
        maps = baked.atlas().bytes() as f64 * 1e-6,
    )
}

/// A graph that was baked now, as text.
pub(crate) fn describe_bake(baked: &Baked) -> String {
    let mut text = describe(&baked.graph);
    let mut line = |text_line: String| {
        text.push_str(&text_line);
        text.push('\n');
    };
    if !baked.joints.is_empty() {
        line(format!("figure: {}", baked.joints));
    }
    let (report, feet, dropped) = (&baked.report, &baked.feet, &baked.report.dropped);
    line(format!(
        "read: {}, {:.1} s; dropped: {:.1} s and {} that the graph cannot reach and leave",
        counted(report.clips, "clip"),
        report.seconds,
        dropped.seconds,
        counted(dropped.clips.len(), "whole clip")
    ));
    if !report.joined.is_empty() {
        let far = report.joined.iter().flat_map(|clip| clip.links).flatten();
        let loops = report.joined.iter().filter(|clip| clip.is_loop).count();
        line(format!(
            "joined: {} (loops: {loops}) that nothing near leads to and from, {:.2} m away at most",
            counted(report.joined.len(), "clip"),
            far.fold(0.0, f32::max),
        ));
        for joined in report.joined.iter().take(MOST_JOINED) {
            let metres =
                |link: Option<f32>| link.map_or("none".to_owned(), |far| format!("{far:.2} m"));
            let [into, out] = joined.links.map(metres);
            line(format!("  {}: in {into}, out {out}", joined.clip));
        }
    }
    islands(report).into_iter().for_each(&mut line);
    for event in dropped.evasions.iter().chain(&dropped.attacks) {
        line(format!("dropped event: {event}"));
    }
    if feet.planted_seconds > 0.0 {
        line(format!(
            "slide of planted feet: {:.0} mm/s in transitions ({:.0} without foot locking), {:.0} mm/s in the clips",
            feet.kept, feet.blended, feet.clips
        ));
        let [median, most, largest] = feet.displacement.map(|metres| 1e3 * metres);
        line(format!(
            "feet that stand in both clips of a transition are {median:.0} mm apart in the median, {most:.0} at 90%,\n  \
             {largest:.0} at most; they take {} steps in place",
            feet.steps
        ));
    }
    line(format!(
        "{} transitions left out because a foot would move too fast or the body push too hard",
        report.impossible
    ));
    line(format!("baked in {:.2} s", baked.seconds));
    text.push_str(&baked.figure.describe());
    text.push_str(&left_out_and_notes(&baked.left_out, &baked.warnings));
    text
}

/// Files that were left out, and what is doubtful, a line for each.
pub(crate) fn left_out_and_notes(left_out: &[String], notes: &[String]) -> String {
    let left_out = left_out.iter().map(|file| format!("left out: {file}\n"));
    let notes = notes.iter().map(|note| format!("note: {note}\n"));
    left_out.chain(notes).collect()
}

/// Sizes of all clips together, in bytes, and the largest errors of compressing them, in metres.
#[derive(Default, Serialize)]
struct ClipSizes {
    stored: usize,
    plain: usize,
    ratio: f64,
    compressed_clips: usize,
    joint_error: f32,
    end_error: f32,
}

impl ClipSizes {
    fn new(graph: &MotionGraph) -> Self {
        let mut sizes = Self::default();
        for clip in graph.clips() {
            let [bytes, plain] = clip.stored_bytes();
            sizes.stored += bytes;
            sizes.plain += plain;
            if let Some([joints, ends]) = clip.compression_errors() {
                sizes.compressed_clips += 1;
                sizes.joint_error = sizes.joint_error.max(joints);
                sizes.end_error = sizes.end_error.max(ends);
            }
        }
        sizes.ratio = sizes.plain as f64 / sizes.stored.max(1) as f64;
        sizes
    }

    fn text(&self, clips: usize) -> String {
        let [joints, ends] = [self.joint_error, self.end_error].map(|metres| 1e3 * metres);
        format!(
            "compressed: {} of {}: {:.2} MB, {:.1} times smaller than plain, errors of {joints:.3} mm\n  \
             at the joints and {ends:.3} mm at the ends at most",
            self.compressed_clips,
            counted(clips, "clip"),
            1e-6 * self.stored as f64,
            self.ratio
        )
    }
}
