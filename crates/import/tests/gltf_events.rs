//! Written glTF files are read back: poses to 0.1 mm, and events exactly. Queries give the same
//! answers.

use std::path::Path;

use sabaki::anim::{EventKind, JointId, Pose};
use sabaki::query::{Evaluation, Query, QuerySettings};
use sabaki_fixtures::answer::answer_throw;
use sabaki_fixtures::baked::embedded;
use sabaki_fixtures::clips::{attack, clips_apart, evasion, joints_of, most_apart};
use sabaki_fixtures::files::{glb, glb_parts};
use sabaki_fixtures::throw::{ThrowSettings, throw};
use sabaki_import::export::{ExportedAnswer, MotionFormat, write_answer};
use sabaki_import::{ClipSet, EventsFile, ReadError, ReadOptions, gltf, read_clips};

use super::common::{refusal, write_glb, written};
use super::export::request;

fn read(path: &Path, events: Option<&Path>) -> Result<ClipSet, ReadError> {
    read_clips(&[path.to_owned()], events, &ReadOptions::default())
}

#[test]
fn poses_and_events_come_back() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    // Times that no few digits say.
    let mut events = motions.events.clone();
    for (event, index) in events.iter_mut().zip(1..) {
        event.start += f64::from(index) * 1e-7 / 3.0;
        event.end -= f64::from(index) * 1e-7 / 7.0;
    }
    let folder = tempfile::tempdir().unwrap();
    let (skeleton, clips) = (&motions.skeleton, &motions.clips);
    let path = write_glb(folder.path(), "all.glb", skeleton, clips, &events);
    let set = read(&path, None).unwrap();
    assert!(set.skeleton.differences(&motions.skeleton).is_empty());
    for (again, clip) in set.clips.iter().zip(clips) {
        assert!(clips_apart((skeleton, again), (skeleton, clip)) < 1e-4);
    }
    assert!(events.len() > 8);
    // To the bit: equal numbers, since none is 0 of either sign.
    assert_eq!(set.events, events);
}

#[test]
fn an_events_file_has_the_word_for_the_clips_that_it_names() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    let (skeleton, clips) = (&motions.skeleton, &motions.clips[..2]);
    let event = |clip, start| attack(clip, start, start + 0.5, vec![JointId(3)]);
    let inside = [event(0, 0.25), event(1, 0.5)];
    let folder = tempfile::tempdir().unwrap();
    let path = write_glb(folder.path(), "all.glb", skeleton, clips, &inside);
    let set = read(&path, None).unwrap();
    assert_eq!(set.events, inside);
    let mut file = EventsFile::of(&[event(0, 1.0)], &set.clips, skeleton).unwrap();
    let with = |file: &EventsFile| {
        let json = serde_json::to_vec(file).unwrap();
        let beside = written(folder.path(), "events.json", json);
        read(&path, Some(&beside)).unwrap().events
    };
    assert_eq!(with(&file), [event(0, 1.0), event(1, 0.5)]);
    // A clip that it names without an event has none.
    file.clips[0].events.clear();
    assert_eq!(with(&file), [event(1, 0.5)]);
}

#[test]
fn extras_of_others_are_let_be_and_wrong_ones_of_ours_are_named() {
    let motions = sabaki_fixtures::demo::motions().unwrap();
    let (skeleton, clips) = (&motions.skeleton, &motions.clips[..1]);
    let events = [evasion(0, 0.5, 1.0)];
    let mut bytes = Vec::new();
    gltf::write(&mut bytes, skeleton, clips, &events).unwrap();
    let (document, binary) = glb_parts(&bytes);
    let folder = tempfile::tempdir().unwrap();
    let with = |from: &str, to: &str| {
        let text = document.to_string();
        assert!(text.contains(from), "{text}");
        let changed = serde_json::from_str(&text.replace(from, to)).unwrap();
        let path = written(folder.path(), "extras.glb", glb(&changed, &binary));
        read(&path, None)
    };
    assert_eq!(with("sabaki\":{", "sabaki\":{").unwrap().events, events);
    assert_eq!(with("\"sabaki\":{", "\"others\":{").unwrap().events, []);
    let error = refusal(with("evasion", "evasive"));
    let is_named = error.contains("events in its extras") && error.contains("evasive");
    assert!(is_named, "{error}");
    let nowhere = [evasion(7, 0.5, 1.0)];
    let error = refusal(gltf::write(&mut Vec::new(), skeleton, clips, &nowhere));
    assert!(error.contains("clip 7"), "{error}");
}

#[test]
fn an_answer_as_gltf_is_the_motion_and_says_when_it_evades() {
    let baked = embedded();
    let folder = tempfile::tempdir().unwrap();
    let settings = QuerySettings::default();
    let mut evasions = 0;
    for index in 0..6 {
        let throw = throw(baked, &ThrowSettings::default(), 11, index).unwrap();
        let answer = answer_throw(&Query::new(baked, &settings), &throw, Evaluation::Lazy);
        let request = request(&throw, settings);
        let format = MotionFormat::Glb;
        let exported = ExportedAnswer {
            baked,
            request: &request,
            attack: &throw.attack,
            answer: &answer,
        };
        let written = write_answer(folder.path(), "one", format, exported);
        let [path, facts] = written.unwrap();
        assert!(path.ends_with("one.glb") && facts.ends_with("one.json"));
        let set = read(&path, None).unwrap();
        let clip = &set.clips[0];
        assert!(clip.duration() >= f64::from(throw.attack.end()));
        let (mut now, mut then) = (Pose::default(), Pose::default());
        let mut motion = answer.motion.clone();
        motion.extend(baked.graph(), clip.duration() as f32 + 0.1);
        for frame in (0..clip.frames()).step_by(7) {
            clip.pose(frame, &mut now);
            motion.sample(baked.graph(), frame as f32 / 120.0, &mut then);
            let [now, then] = [&now, &then].map(|pose| joints_of(&set.skeleton, pose));
            assert!(most_apart(&now, &then) < 1e-4, "frame {frame}");
        }
        let wanted = answer.chosen().evasion;
        let wanted = wanted.and_then(|edge| baked.graph().edge(edge).event);
        let mut events = motion.events(baked.graph());
        if let Some((_, [start, _])) = events.find(|(event, _)| Some(*event) == wanted) {
            let mut own = set.events.iter();
            let event = own.find(|event| event.start == f64::from(start));
            assert_eq!(event.unwrap().kind, EventKind::Evasion);
            evasions += 1;
        }
    }
    assert!(evasions > 1, "{evasions}");
}
