//! An answer as files that other tools can check: the motion as BVH, the attack and the body's
//! spheres as JSON, on one clock and in one world; and how it was found, so that it can be asked
//! again ([`Recording`](super::Recording)).

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::recording::Chosen;
use super::{Question, bvh, gltf};
use sabaki::anim::{Clip, ClipDesc, ClipError, Event, Pose};
use sabaki::archive::write_atomically;
use sabaki::graph::{ClipSource, EdgeId, EdgeMotion, Motion, MotionGraph, Playhead};
use sabaki::maps::BakedGraph;
use sabaki::math::Rigid2;
use sabaki::query::clearance::SAMPLE_RATE;
use sabaki::query::{Answer, Attack, CandidateReport};

/// Exported positions are in centimetres.
const METRES_PER_UNIT: f64 = 0.01;
/// The motion goes on this long after the attack, seconds.
const AFTER: f32 = 1.0;

/// What an answer's motion is written as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionFormat {
    /// `NAME.bvh`, in centimetres.
    #[default]
    Bvh,
    /// `NAME.glb`, in metres, with a figure of bones; the events that the answer plays stand in the animation's `extras`.
    Glb,
}

/// Where an answer is written, and as what.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// It must exist.
    pub folder: &'a Path,
    /// Of the files, without ending.
    pub name: &'a str,
    /// Of the motion.
    pub format: MotionFormat,
}

/// Writes `NAME.bvh` and `NAME.json` into `folder`, which must exist. Returns the two paths.
///
/// The BVH starts at the moment of the query and has the frames at which the exact test took the
/// body's spheres; between them these go in straight lines. The JSON is that of [`document`].
///
/// # Errors
/// What the file system refuses.
pub fn write_answer(
    folder: &Path,
    name: &str,
    baked: &BakedGraph,
    (question, answer): (&Question, &Answer),
) -> std::io::Result<[PathBuf; 2]> {
    let format = MotionFormat::Bvh;
    let target = Target {
        folder,
        name,
        format,
    };
    write_answer_as(target, baked, (question, answer))
}

/// The same with the motion in another format.
///
/// # Errors
/// What the file system refuses.
pub fn write_answer_as(
    target: Target<'_>,
    baked: &BakedGraph,
    (question, answer): (&Question, &Answer),
) -> std::io::Result<[PathBuf; 2]> {
    let Target {
        folder,
        name,
        format,
    } = target;
    let ending = match format {
        MotionFormat::Bvh => "bvh",
        MotionFormat::Glb => "glb",
    };
    let [motion, facts] =
        [ending, "json"].map(|extension| folder.join(format!("{name}.{extension}")));
    let graph = baked.graph();
    let played = whole_motion(baked, answer, &question.attack);
    let clip = as_clip(graph, &played).map_err(std::io::Error::other)?;
    write_atomically(&motion, |file| match format {
        MotionFormat::Bvh => bvh::write(file, graph.skeleton(), &clip, METRES_PER_UNIT),
        MotionFormat::Glb => {
            let source = ClipSource {
                skeleton: graph.skeleton(),
                clips: std::slice::from_ref(&clip),
                events: &events(graph, &played.0, clip.duration()),
            };
            gltf::write_labelled(file, source)
        }
    })?;
    let document = document(baked, question, answer);
    write_atomically(&facts, |file: &mut BufWriter<_>| {
        serde_json::to_writer_pretty(&mut *file, &document)?;
        writeln!(file)
    })?;
    Ok([motion, facts])
}

/// The answer from the moment of the query until it is over, and the seconds that it lasts.
fn whole_motion(baked: &BakedGraph, answer: &Answer, attack: &Attack) -> (Motion, f32) {
    let mut motion = answer.motion.clone();
    let seconds = motion.duration().max(attack.end() + AFTER);
    motion.extend(baked.graph(), seconds + 1.0 / SAMPLE_RATE);
    (motion, seconds)
}

/// The events that a motion plays, as far as a clip of so many seconds has them.
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
    { played }.filter(|event| event.start < event.end).collect()
}

fn as_clip(graph: &MotionGraph, (motion, seconds): &(Motion, f32)) -> Result<Clip, ClipError> {
    let mut desc = ClipDesc {
        name: "answer".to_owned(),
        frame_rate: f64::from(SAMPLE_RATE),
        roots: Vec::new(),
        rotations: Vec::new(),
        translations: Vec::new(),
    };
    let moving_joints = graph
        .clips()
        .iter()
        .any(|clip| !clip.desc().translations.is_empty());
    let mut pose = Pose::default();
    for frame in 0..=(seconds * SAMPLE_RATE).ceil() as usize {
        motion.sample(graph, frame as f32 / SAMPLE_RATE, &mut pose);
        desc.roots.push(pose.root);
        desc.rotations.extend_from_slice(&pose.rotations);
        if moving_joints {
            pose.fill_translations(graph.skeleton());
            desc.translations.extend_from_slice(&pose.translations);
        }
    }
    Clip::new(graph.skeleton(), desc)
}

/// All facts of an answer, with stable keys: what the BVH needs to be checked, what was asked, and
/// each candidate with what became of it.
#[must_use]
pub fn document(baked: &BakedGraph, question: &Question, answer: &Answer) -> Value {
    let skeleton = baked.graph().skeleton();
    let body = baked.body().spheres.iter().map(|sphere| {
        let joint = &skeleton.joint(sphere.joint).name;
        json!({ "joint": joint, "offset": sphere.offset, "radius": sphere.radius })
    });
    let described = answer.candidates.iter().map(|candidate| {
        let mut value = describe(baked, answer, candidate);
        if let Some(place) = evasion_placement(baked, question.playhead, answer, candidate) {
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
        "attack": { "spheres": question.attack.spheres() },
        "body": { "spheres": body.collect::<Vec<_>>() },
        "query": question.asked(),
        "answer": Chosen::of(baked, answer),
        "source": answer.source,
        "chosen": answer.chosen,
        "counts": answer.counts,
        "search": answer.search,
        "candidates": described.collect::<Vec<_>>(),
    })
}

/// Where a candidate's evasion starts: the character's frame then, in the world of `playhead`.
/// `None` for a path that only moves.
#[must_use]
pub fn evasion_placement(
    baked: &BakedGraph,
    playhead: Playhead,
    answer: &Answer,
    candidate: &CandidateReport,
) -> Option<Rigid2> {
    let evasion = baked.evasion(candidate.evasion?)?;
    let graph = baked.graph();
    let at_node = playhead.next_clip_to_world(graph);
    let edges = answer.path(baked, candidate);
    let at_evasion = { edges }.fold(at_node, |so_far, edge| so_far * graph.clip_change(edge));
    Some(at_evasion * evasion.placement)
}

/// A candidate of an answer in words and numbers: its path, what it performs, its rate, counts,
/// score and fate.
#[must_use]
pub fn describe(baked: &BakedGraph, answer: &Answer, candidate: &CandidateReport) -> Value {
    let path = answer.path(baked, candidate);
    let mut value = json!({
        "path": path.map(|edge| describe_edge(baked, edge)).collect::<Vec<_>>(),
        "evasion": candidate.evasion.and_then(|edge| describe_evasion(baked, edge)),
        "fate": candidate.fate,
    });
    match &candidate.rate {
        Ok(rate) => value["p"] = json!(rate.rate),
        Err(error) => value["reason"] = json!(error.to_string()),
    }
    if let Some(overlap) = candidate.overlap {
        value["overlap"] = json!({
            "body": overlap.body,
            "outer": overlap.outer,
            "evasion": overlap.evasion,
        });
    }
    if let Some(clearance) = candidate.clearance {
        value["clearance"] = json!(clearance.metres);
    }
    if let Some(score) = candidate.score {
        value["score"] = json!(score);
    }
    value
}

/// The event that an edge plays, by clip and seconds; `None` where it plays none.
#[must_use]
pub fn describe_evasion(baked: &BakedGraph, edge: EdgeId) -> Option<String> {
    let event = baked.graph().edge(edge).event?;
    Some(baked.graph().describe_event(baked.graph().event(event)))
}

/// `CLIP 12-20` for a stretch of a clip, `CLIP 12 > OTHER 40` for a transition; numbers are frames.
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
