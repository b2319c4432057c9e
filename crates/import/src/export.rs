//! Exports an answer to files that other tools can check: the motion as BVH or glTF, and the attack
//! and the body's spheres as JSON, with the same clock and world. The JSON also contains the query,
//! so that it can be repeated ([`Recording`](super::Recording)).

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::recording::Chosen;
use super::{BodyFile, RecordedRequest, bvh, gltf};
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, Pose};
use sabaki::archive::write_atomically;
use sabaki::graph::{EdgeId, EdgeMotion, Motion, MotionGraph};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::clearance::SAMPLE_RATE;
use sabaki::query::{Answer, Attack, CandidateReport, EnteredAt};

/// Unit of exported BVH positions: centimetres.
const METRES_PER_UNIT: f64 = 0.01;
/// Duration of the exported motion after the attack, in seconds.
const AFTER: f32 = 1.0;

/// File format of an exported motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionFormat {
    /// `NAME.bvh`, in centimetres.
    #[default]
    Bvh,
    /// `NAME.glb`, in metres, with a figure of bones; the events that the answer plays stand in the animation's `extras`.
    Glb,
}

/// An answer to export, with the graph and the request that it belongs to.
#[derive(Clone, Copy, Debug)]
pub struct ExportedAnswer<'a> {
    /// Graph of the query.
    pub baked: &'a BakedGraph,
    /// Input of the query.
    pub request: &'a RecordedRequest,
    /// Attack of the query, in the world of the request's playhead.
    pub attack: &'a Attack,
    /// Answer of the query.
    pub answer: &'a Answer,
}

/// Writes the motion of an answer as `NAME.bvh` or `NAME.glb`, and everything else as `NAME.json`, to a folder that exists. Returns the two
/// paths.
///
/// The motion starts at the time of the query. Its frames are the moments at which the exact
/// test samples the body's spheres; between them the spheres move along straight lines. It has all joints of the clips' files, with the path in the
/// joint that had it ([`Skeleton::whole`](sabaki::anim::Skeleton::whole)). The JSON is that of [`document`].
///
/// # Errors
/// An error of the file system.
pub fn write_answer(
    folder: &Path,
    name: &str,
    format: MotionFormat,
    exported: ExportedAnswer<'_>,
) -> std::io::Result<[PathBuf; 2]> {
    let (baked, answer) = (exported.baked, exported.answer);
    let ending = match format {
        MotionFormat::Bvh => "bvh",
        MotionFormat::Glb => "glb",
    };
    let [motion, facts] =
        [ending, "json"].map(|extension| folder.join(format!("{name}.{extension}")));
    let graph = baked.graph();
    let (played, seconds) = whole_motion(baked, answer, exported.attack);
    let clip = as_clip(graph, &played, seconds).map_err(std::io::Error::other)?;
    let skeleton = graph.skeleton();
    write_atomically(&motion, |file| match format {
        MotionFormat::Bvh => bvh::write(file, skeleton, &clip, METRES_PER_UNIT),
        MotionFormat::Glb => {
            let events = events(graph, &played, clip.duration());
            gltf::write(file, skeleton, std::slice::from_ref(&clip), &events)
        }
    })?;
    let document = document(exported);
    write_atomically(&facts, |file| {
        serde_json::to_writer_pretty(&mut *file, &document)?;
        writeln!(file)
    })?;
    Ok([motion, facts])
}

/// Motion of the answer from the query until it is over, with its duration in seconds.
fn whole_motion(baked: &BakedGraph, answer: &Answer, attack: &Attack) -> (Motion, f32) {
    let mut motion = answer.motion.clone();
    let seconds = motion.duration().max(attack.end() + AFTER);
    motion.extend(baked.graph(), seconds + 1.0 / SAMPLE_RATE);
    (motion, seconds)
}

/// Events of a motion, limited to a clip of `seconds`.
fn events(graph: &MotionGraph, motion: &Motion, seconds: f64) -> Vec<Event> {
    let played = motion.events(graph).map(|(id, [start, end])| {
        let event = graph.event(id);
        Event {
            clip: 0,
            kind: event.kind,
            start: f64::from(start),
            end: f64::from(end).min(seconds),
            joints: event.joints.clone(),
        }
    });
    played.filter(|event| event.start < event.end).collect()
}

fn as_clip(graph: &MotionGraph, motion: &Motion, seconds: f32) -> Result<Clip, ClipError> {
    let skeleton = graph.skeleton();
    let moving_joints = graph.clips().iter().any(|clip| clip.moves_joints());
    let pose = |frame, pose: &mut Pose| {
        motion.sample(graph, frame as f32 / SAMPLE_RATE, pose);
        match moving_joints {
            true => pose.fill_translations(skeleton),
            false => pose.translations.clear(),
        }
    };
    let frames = (seconds * SAMPLE_RATE).ceil() as usize + 1;
    let desc = ClipDesc::of_poses("answer", f64::from(SAMPLE_RATE), frames, pose);
    Clip::new(skeleton, desc)
}

/// All data of an answer as JSON with stable keys: the data to check the motion file with, the query, and the result of
/// every candidate.
#[must_use]
pub fn document(exported: ExportedAnswer<'_>) -> Value {
    let ExportedAnswer {
        baked,
        request,
        attack,
        answer,
    } = exported;
    let described = answer.candidates.iter().map(|candidate| {
        let mut value = describe(baked, answer, candidate);
        if let Some(place) = evasion_placement(exported, candidate) {
            let heading = place.heading().to_degrees();
            value["evades_at"] = json!({ "x": place.x, "z": place.z, "heading": heading });
        }
        value
    });
    json!({
        "avoided": answer.avoided,
        "clearance": answer.clearance().metres,
        "clearance_time": answer.clearance().time,
        "metres_per_unit": METRES_PER_UNIT,
        "frames_per_second": SAMPLE_RATE,
        "attack": { "spheres": attack.spheres() },
        "body": BodyFile::of(baked.body(), baked.graph().skeleton()),
        "query": request,
        "answer": Chosen::of(baked, answer),
        "source": answer.source,
        "chosen": answer.chosen,
        "counts": answer.counts,
        "search": answer.search,
        "candidates": described.collect::<Vec<_>>(),
    })
}

/// Character's frame at the start of a candidate's evasion, in the world of the request's playhead. Returns
/// `None` if the candidate has no evasion, or only its upper body plays one.
#[must_use]
pub fn evasion_placement(
    exported: ExportedAnswer<'_>,
    candidate: &CandidateReport,
) -> Option<Rigid2> {
    let ExportedAnswer {
        baked,
        request,
        answer,
        ..
    } = exported;
    let evasion = baked.evasion(candidate.evasion?)?;
    if candidate.layer.is_some() {
        return None;
    }
    if let Some(entered) = candidate.entry {
        return Some(entered.entry.clip_to_world * evasion.placement);
    }
    let graph = baked.graph();
    let at_node = request.playhead.next_clip_to_world(graph);
    let edges = answer.path(baked, candidate);
    let at_evasion = edges.fold(at_node, |so_far, edge| so_far * graph.clip_change(edge));
    Some(at_evasion * evasion.placement)
}

/// Describes a candidate as JSON: its path, its evasion, its rate, counts, score and result.
#[must_use]
pub fn describe(baked: &BakedGraph, answer: &Answer, candidate: &CandidateReport) -> Value {
    let path = answer.path(baked, candidate);
    let mut value = json!({
        "path": path.map(|edge| describe_edge(baked, edge)).collect::<Vec<_>>(),
        "evasion": candidate.evasion.and_then(|edge| describe_evasion(baked, edge)),
        "fate": candidate.result,
    });
    if let Some(EnteredAt { delay, entry }) = candidate.entry {
        let edge = baked.graph().edge(entry.edge);
        let from = baked.graph().node(edge.from);
        value["entry"] = json!({
            "after": delay,
            "blend": entry.blend,
            "clip": baked.graph().clip(from.clip).name(),
            "frame": from.frame as f32 + entry.frame,
        });
    }
    if let Some(layer) = candidate.layer {
        value["layer"] = json!({
            "clip": baked.graph().clip(layer.clip).name(),
            "frame": layer.frame,
            "envelope": layer.envelope,
        });
    }
    match &candidate.rate {
        Ok(rate) => value["p"] = json!(rate.rate),
        Err(error) => value["reason"] = json!(error.to_string()),
    }
    let overlap = candidate.overlap.map(|overlap| {
        json!({ "body": overlap.body, "outer": overlap.outer, "evasion": overlap.evasion })
    });
    let measured = [
        ("overlap", overlap),
        (
            "clearance",
            candidate.clearance.map(|own| json!(own.metres)),
        ),
        ("score", candidate.score.map(|score| json!(score))),
        ("warp", candidate.warp.map(|warp| json!(warp))),
    ];
    for (key, found) in measured {
        if let Some(found) = found {
            value[key] = found;
        }
    }
    value
}

/// Clip and seconds of the event on an edge, or `None` if it has no event.
#[must_use]
pub fn describe_evasion(baked: &BakedGraph, edge: EdgeId) -> Option<String> {
    let event = baked.graph().edge(edge).event?;
    Some(baked.graph().describe_event(baked.graph().event(event)))
}

/// Describes an edge: `CLIP 12-20` for a range of frames, `CLIP 12 > OTHER 40` for a transition.
#[must_use]
pub fn describe_edge(baked: &BakedGraph, edge: EdgeId) -> String {
    let graph = baked.graph();
    let edge = graph.edge(edge);
    let (from, to) = (graph.node(edge.from), graph.node(edge.to));
    let name = |node: sabaki::graph::Node| graph.clip(node.clip).name();
    match edge.motion {
        EdgeMotion::Clip => format!("{} {}-{}", name(from), from.frame, to.frame),
        EdgeMotion::Transition { .. } => {
            format!("{} {} > {} {}", name(from), from.frame, name(to), to.frame)
        }
    }
}
