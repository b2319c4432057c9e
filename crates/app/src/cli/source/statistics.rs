//! Statistics of a graph and of how it was built.

use sabaki::anim::EventKind;
use sabaki::graph::MotionGraph;
use serde_json::{Value, json};

use super::super::clip_sizes::ClipSizes;
use super::Baked;

fn count(graph: &MotionGraph, kind: EventKind) -> usize {
    graph
        .events()
        .iter()
        .filter(|event| event.kind == kind)
        .count()
}

/// Statistics of a graph as JSON, with stable keys.
pub(crate) fn statistics(baked: &Baked) -> Value {
    let graph = baked.graph.graph();
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
        "body_spheres": baked.graph.body().spheres.len(),
        "props": baked.graph.body().props.len(),
        "map_bytes": baked.graph.atlas().bytes(),
        "evasion_within": {
            "0.5": baked.graph.responsive_share(0.5),
            "1.0": baked.graph.responsive_share(1.0),
            "1.5": baked.graph.responsive_share(1.5),
        },
    });
    value["clip_bytes"] = ClipSizes::of(graph).to_json();
    let entries = baked.graph.entry_report();
    value["entries"] = json!(entries);
    value["entries"]["share"] = json!(entries.share());
    if let Some(made) = &baked.made {
        value["build_seconds"] = json!(made.seconds);
        value["report"] = json!(made.report);
        value["foot_slide"] = json!(made.feet);
        value["warnings"] = json!(made.warnings);
        value["left_out"] = json!(made.left_out);
        value["fits"] = made.figure.to_json();
    }
    value
}

/// Statistics of a graph as text.
pub(crate) fn describe(baked: &Baked) -> String {
    let graph = baked.graph.graph();
    let mut text = String::new();
    let mut line = |text_line: String| {
        text.push_str(&text_line);
        text.push('\n');
    };
    let kept = format!("{:.1} s of motion", graph.seconds_kept());
    line(match &baked.made {
        Some(made) => format!(
            "{} clips, {:.1} s; kept {kept}",
            made.report.clips, made.report.seconds
        ),
        None => format!("{} clips; {kept}", graph.clips().len()),
    });
    line(ClipSizes::of(graph).text());
    line(format!(
        "{} nodes, {} edges ({} of them transitions)",
        graph.nodes().len(),
        graph.edges().len(),
        graph.transitions()
    ));
    line(format!(
        "{} evasions and {} attacks",
        count(graph, EventKind::Evasion),
        count(graph, EventKind::Attack)
    ));
    if let Some(made) = &baked.made {
        line(format!(
            "{} transitions left out because a foot darts in them",
            made.report.darting
        ));
    }
    let share = |seconds| 100.0 * baked.graph.responsive_share(seconds);
    line(format!(
        "an evasion can start within 0.5 s from {:.0}% of all moments, within 1.0 s from {:.0}%, within 1.5 s from {:.0}%",
        share(0.5),
        share(1.0),
        share(1.5)
    ));
    let entries = baked.graph.entry_report();
    line(format!(
        "an evasion can be entered at once from {:.0}% of all moments, by {:.0} entries on average; the longest stretch of a clip without one is {:.2} s",
        100.0 * entries.share(),
        entries.entries as f64 / entries.moments.max(1) as f64,
        entries.longest_without
    ));
    line(format!(
        "the upper body can play an evasion over legs that go on, by {:.0} layers on average",
        entries.layers as f64 / entries.moments.max(1) as f64,
    ));
    let [all, events] = [entries.unbranched, entries.unbranched_in_events];
    line(format!(
        "stretches without a branch point (an entry, an exit or a choice of edges): {:.2} s in the median, {:.2} s at most; in evasions and attacks {:.2} and {:.2} s",
        all.median, all.longest, events.median, events.longest
    ));
    if let Some(made) = &baked.made {
        text.push_str(&made.figure.describe());
    }
    let mut line = |text_line: String| {
        text.push_str(&text_line);
        text.push('\n');
    };
    if let Some(made) = &baked.made {
        let dropped = &made.report.dropped;
        if dropped.seconds > 0.05 {
            line(format!(
                "dropped because the graph does not lead there and back: {:.1} s of motion, {} whole clips",
                dropped.seconds,
                dropped.clips.len()
            ));
        }
        for event in dropped.evasions.iter().chain(&dropped.attacks) {
            line(format!("dropped event: {event}"));
        }
        if made.feet.planted_seconds > 0.0 {
            line(format!(
                "slide of planted feet: {:.0} mm/s in transitions ({:.0} without foot locking), {:.0} mm/s in the clips",
                made.feet.kept, made.feet.blended, made.feet.clips
            ));
            let [median, most, largest] = made.feet.displacement.map(|metres| 1e3 * metres);
            line(format!(
                "feet that stand in both clips of a transition: {median:.0} mm apart in the median, {most:.0} mm at 90%, {largest:.0} mm at most; they take {} steps in place",
                made.feet.steps
            ));
        }
        line(format!(
            "baked in {:.2} s; {:.1} MB of maps",
            made.seconds,
            baked.graph.atlas().bytes() as f64 * 1e-6
        ));
        text.push_str(&left_out_and_notes(&made.left_out, &made.warnings));
    }
    text
}

/// Files that were left out, and what is doubtful, a line for each.
pub(crate) fn left_out_and_notes(left_out: &[String], notes: &[String]) -> String {
    let left_out = left_out.iter().map(|file| format!("left out: {file}\n"));
    let notes = notes.iter().map(|note| format!("note: {note}\n"));
    left_out.chain(notes).collect()
}
