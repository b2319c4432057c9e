//! An exported answer equals the query's answer, when it is read by code that is independent of the
//! exporter.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use glam::DVec3;
use sabaki::anim::{JointTransform, Pose};
use sabaki::archive;
use sabaki::query::{Answer, Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::clips::joints_of;
use sabaki_fixtures::throw::{Throw, ThrowSettings, throw};
use sabaki_fixtures::with;
use sabaki_import::export::{ExportedAnswer, MotionFormat, evasion_placement, write_answer};
use sabaki_import::{ChannelFile, Chosen, RecordedRequest, Recording, RecordingError, read_bvh};
use serde_json::Value;

const ATTACKS: u64 = 25;
/// Steps from a frame to the next. At 40 m/s, which is a fast ball and a fast fist, half a step is 0.8 mm.
const STEPS: usize = 200;

/// Late paths are listed, too.
fn settings() -> QuerySettings {
    with(|s: &mut QuerySettings| s.list_late = true)
}

pub(crate) fn request(throw: &Throw, settings: QuerySettings) -> RecordedRequest {
    RecordedRequest {
        graph: archive::checksum(embedded()).unwrap(),
        playhead: throw.playhead,
        settings,
        evaluation: Evaluation::Lazy,
    }
}

fn answers() -> impl Iterator<Item = (Throw, Answer)> {
    (0..ATTACKS).map(|index| {
        let throw = throw(embedded(), &ThrowSettings::default(), 11, index).unwrap();
        let settings = settings();
        let query = Query::new(embedded(), &settings);
        let answer = answer_throw(&query, &throw, Evaluation::Lazy);
        (throw, answer)
    })
}

struct Exported {
    motion: ChannelFile,
    facts: Value,
}

fn export(folder: &Path, throw: &Throw, answer: &Answer) -> Exported {
    let (baked, request) = (embedded(), request(throw, settings()));
    let exported = ExportedAnswer {
        baked,
        request: &request,
        attack: &throw.attack,
        answer,
    };
    let written = write_answer(folder, "one", MotionFormat::Bvh, exported);
    let [motion, facts] = written.unwrap();
    Exported {
        motion: read_bvh(&motion).unwrap(),
        facts: serde_json::from_slice(&fs::read(facts).unwrap()).unwrap(),
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn vector(value: &Value) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| number(&value[axis])))
}

impl Exported {
    /// The frame of each joint in the world, by name, in metres.
    fn joints_at(&self, frame: usize) -> HashMap<&str, JointTransform> {
        let (metres, mut pose) = (number(&self.facts["metres_per_unit"]), Pose::default());
        self.motion.pose(frame, metres, &mut pose);
        let placed = joints_of(&self.motion.skeleton(metres).unwrap(), &pose);
        let names = self.motion.joints.iter().map(|joint| &*joint.name);
        names.zip(placed).collect()
    }

    /// For each frame the centres of the body's spheres, metres.
    fn body(&self) -> Vec<Vec<DVec3>> {
        let spheres = self.facts["body"]["spheres"].as_array().unwrap();
        let placed = |frame: usize| {
            let joints = self.joints_at(frame);
            let centre = |sphere: &Value| {
                let joint = &joints[sphere["joint"].as_str().unwrap()];
                joint.point(vector(&sphere["offset"]).as_vec3()).as_dvec3()
            };
            spheres.iter().map(centre).collect()
        };
        (0..self.motion.frames()).map(placed).collect()
    }

    fn attack(&self) -> Vec<Vec<(f64, DVec3, f64)>> {
        let key = |key: &Value| {
            let (t, radius) = (number(&key["t"]), number(&key["radius"]));
            (t, vector(&key["center"]), radius)
        };
        let spheres = self.facts["attack"]["spheres"].as_array().unwrap();
        let keys = |keys: &Value| keys.as_array().unwrap().iter().map(key).collect();
        spheres.iter().map(keys).collect()
    }

    /// The smallest distance of the surfaces, by small steps through time.
    fn clearance(&self) -> f64 {
        let spheres = self.facts["body"]["spheres"].as_array().unwrap().iter();
        let radii: Vec<f64> = spheres.map(|sphere| number(&sphere["radius"])).collect();
        let (body, per_second) = (self.body(), self.motion.frame_rate);
        let mut smallest = f64::INFINITY;
        for keys in self.attack() {
            for pair in keys.windows(2) {
                let (from, to) = (&pair[0], &pair[1]);
                let count = ((to.0 - from.0) * per_second * STEPS as f64).ceil() as usize;
                for step in 0..=count {
                    let share = step as f64 / count as f64;
                    let t = from.0 + (to.0 - from.0) * share;
                    let ball = from.1.lerp(to.1, share);
                    let radius = from.2 + (to.2 - from.2) * share;
                    let frame = ((t * per_second) as usize).min(body.len() - 2);
                    let part = t * per_second - frame as f64;
                    for (index, own) in radii.iter().enumerate() {
                        let centre = body[frame][index].lerp(body[frame + 1][index], part);
                        smallest = smallest.min(centre.distance(ball) - own - radius);
                    }
                }
            }
        }
        smallest
    }
}

#[test]
fn the_files_are_the_answer() {
    let folder = tempfile::tempdir().unwrap();
    let mut clean = 0;
    for (throw, answer) in answers() {
        let exported = export(folder.path(), &throw, &answer);
        clean += usize::from(clearance_is_that_of_the_files(&exported, &answer));
        motion_begins_where_the_character_is(&exported, &throw);
        motion_lasts_until_the_attack_is_over(&exported, &throw);
        explanation_has_every_candidate(&exported.facts, &answer);
    }
    assert!(clean > 0);
}

/// Returns whether the attack is avoided.
fn clearance_is_that_of_the_files(exported: &Exported, answer: &Answer) -> bool {
    let stated = number(&exported.facts["clearance"]);
    let found = exported.clearance();
    let off = (stated - found).abs();
    assert!(off < 2e-3, "stated {stated} m, found {found} m");
    assert_eq!(stated as f32, answer.clearance().metres);
    let avoided = exported.facts["avoided"].as_bool().unwrap();
    assert_eq!(avoided, answer.avoided);
    // A hit that is deeper than the stepping is coarse is seen; and a clean answer is never a hit.
    if found.abs() > 1e-4 {
        assert_eq!(avoided, found > 0.0, "{found} m");
    }
    avoided
}

fn motion_begins_where_the_character_is(exported: &Exported, throw: &Throw) {
    let joints = exported.joints_at(0);
    let place = |name: &str| joints[name].translation;
    let root = place("Hips");
    assert!(root.x.abs() < 1e-3 && root.z.abs() < 1e-3, "{root}");
    // Left is +X where the character faces +Z.
    let across = place("LeftUpLeg") - place("RightUpLeg");
    assert!(across.x > 0.0 && (across.z / across.x).abs() < 1e-3);
    let (graph, mut pose) = (embedded().graph(), Pose::default());
    throw.playhead.pose(graph, &mut pose);
    let own = joints_of(graph.skeleton(), &pose);
    for (id, joint) in graph.skeleton().ids().zip(&own) {
        let name = &graph.skeleton().joint(id).name;
        let off = place(name).distance(joint.translation);
        assert!(off < 1e-4, "{name}");
    }
}

fn motion_lasts_until_the_attack_is_over(exported: &Exported, throw: &Throw) {
    let last = exported.motion.frames() - 1;
    let seconds = last as f64 / exported.motion.frame_rate;
    assert!(seconds >= f64::from(throw.attack.end()));
    let rate = number(&exported.facts["frames_per_second"]);
    assert!((rate / exported.motion.frame_rate - 1.0).abs() < 1e-9);
    let ends = exported.attack();
    let end = ends.iter().map(|keys| keys[keys.len() - 1].0);
    assert_eq!(end.fold(0.0, f64::max) as f32, throw.attack.end());
}

fn explanation_has_every_candidate(facts: &Value, answer: &Answer) {
    assert!((number(&facts["metres_per_unit"]) - 0.01).abs() < 1e-12);
    let candidates = facts["candidates"].as_array().unwrap();
    let count = |name: &str| facts["counts"][name].as_u64().unwrap() as usize;
    assert_eq!(candidates.len(), count("candidates") + count("not_in_time"));
    assert_eq!(candidates.len(), answer.candidates.len());
    let of_fate = |fate: &str| candidates.iter().filter(|c| c["fate"] == fate).count();
    assert_eq!(of_fate("chosen"), 1);
    assert_eq!(of_fate("not_in_time"), count("not_in_time"));
    let chosen = &candidates[facts["chosen"].as_u64().unwrap() as usize];
    assert_eq!(chosen["fate"], "chosen");
    assert_eq!(chosen["clearance"], facts["clearance"]);
    for candidate in candidates {
        assert!(candidate["path"].is_array());
        let in_time = candidate["fate"] != "not_in_time";
        assert_eq!(candidate["p"].is_number(), in_time);
        assert_eq!(candidate["reason"].is_string(), !in_time);
        // What was called clean has a score, unless the body would push off too hard.
        let clean = candidate["clearance"].as_f64().is_some_and(|m| m >= 0.0);
        let may_win = candidate["fate"] != "too_hard";
        assert_eq!(candidate["score"].is_object(), clean && may_win);
    }
    for name in ["joint", "offset", "radius"] {
        assert!(!facts["body"]["spheres"][0][name].is_null(), "{name}");
    }
}

#[test]
fn an_exported_answer_can_be_asked_again() {
    let folder = tempfile::tempdir().unwrap();
    let baked = embedded();
    let mut evasions = 0;
    for (throw, answer) in answers().take(8) {
        let facts = export(folder.path(), &throw, &answer).facts;
        let recording = Recording::parse(facts.to_string().as_bytes()).unwrap();
        assert_eq!(recording.request, request(&throw, settings()));
        assert_eq!(recording.attack, throw.attack);
        assert_eq!(recording.chosen, Chosen::of(baked, &answer));
        let again = recording.replay(baked).unwrap();
        assert!(Chosen::of(baked, &again).is_same(&recording.chosen));
        evasions += usize::from(answer.chosen().evasion.is_some());
    }
    assert!(evasions > 0);
}

#[test]
fn a_recording_that_is_none_or_of_another_graph_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (throw, answer) = answers().next().unwrap();
    let facts = export(folder.path(), &throw, &answer).facts;
    let changed = |pointer: &str, value: Value| {
        let mut facts = facts.clone();
        *facts.pointer_mut(pointer).unwrap() = value;
        Recording::parse(facts.to_string().as_bytes())
    };
    let asked = |pointer: &str, value: Value| changed(pointer, value).unwrap().replay(embedded());
    let graph = asked("/query/graph", 1.into());
    let is_named = matches!(graph, Err(RecordingError::Graph { expected: 1, .. }));
    assert!(is_named, "{:?}", graph.err());
    for (key, value) in [
        ("edge", Value::from(u32::MAX)),
        ("frame", (-1.0).into()),
        ("frame", 1e9.into()),
        ("clip_to_world/cos", 7.0.into()),
        ("clip_to_world/x", 1e30.into()),
    ] {
        let playhead = asked(&format!("/query/playhead/{key}"), value);
        assert!(matches!(playhead, Err(RecordingError::Playhead)), "{key}");
    }
    let attack = changed("/attack/spheres", Value::Array(Vec::new()));
    assert!(matches!(attack, Err(RecordingError::Attack(_))));
    let judging = changed("/query/judging", "perhaps".into());
    assert!(matches!(judging, Err(RecordingError::Json(_))));
    assert!(Recording::parse(b"{}").is_err() && Recording::parse(b"").is_err());
}

#[test]
fn a_candidates_evasion_is_placed_where_its_motion_performs_it() {
    let baked = embedded();
    let mut evasions = 0;
    for (throw, answer) in answers() {
        let chosen = answer.chosen();
        let exported = ExportedAnswer {
            baked,
            request: &request(&throw, settings()),
            attack: &throw.attack,
            answer: &answer,
        };
        let place = evasion_placement(exported, chosen);
        assert_eq!(place.is_some(), chosen.evasion.is_some());
        let Some(place) = place else { continue };
        if let Some(entered) = chosen.entry {
            let there = answer.motion.playhead(baked.graph(), entered.delay + 1e-4);
            assert_eq!(there.edge, entered.entry.edge);
            let moved = there.clip_to_world.ground() - entered.entry.clip_to_world.ground();
            assert!(moved.length() < 1e-3, "{moved}");
            evasions += 1;
            continue;
        }
        let mut start = throw.playhead.seconds_to_next_node(baked.graph());
        let edges = answer.path(baked, chosen).count();
        for step in answer.motion.steps().take(edges) {
            start += baked.graph().seconds(step.edge) / step.rate;
        }
        let there = answer.motion.playhead(baked.graph(), start + 1e-4);
        let there = there.placement(baked.graph());
        let turned = (place.inverse() * there).heading().abs();
        assert!(place.ground().distance(there.ground()) < 0.01 && turned < 0.02);
        evasions += 1;
    }
    assert!(evasions > 0);
}
