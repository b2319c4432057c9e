//! Blends are those of the paper. If no graph can be built, the error gives the reason.

use glam::Vec3;
use sabaki::anim::{Clip, Event, EventKind, Pose};
use sabaki::graph::{self, GraphError, GraphSettings, LinkSettings, blend_weight};
use sabaki_fixtures::clips::{
    evasion, first_frames, joints_of, small_skeleton, source, swinging_clip, twice,
};
use sabaki_fixtures::demo;

use super::{alone, build, round_clip};
use crate::furthest;

#[test]
fn a_transition_out_of_a_clip_that_moves_joints_does_not_jump() {
    let skeleton = small_skeleton();
    let plain = swinging_clip(&skeleton, 60, 0.0);
    let mut desc = plain.desc().clone();
    // Bones a tenth longer than the skeleton's.
    for _ in 0..plain.frames() {
        let longer = skeleton.joints().iter().map(|joint| joint.offset * 1.1);
        desc.translations.extend(longer);
    }
    let longer = Clip::new(&skeleton, desc).unwrap();
    let clips = [longer, twice(&skeleton, &plain)];
    let mut settings = alone();
    settings.threshold = 1.0;
    let (graph, _) = build(&clips, &[], &settings).unwrap();
    let places = |pose: &Pose| {
        let joints = joints_of(&skeleton, pose).into_iter();
        joints.map(|joint| joint.translation).collect()
    };
    let mut mixed = 0;
    for id in graph.edge_ids() {
        let edge = graph.edge(id);
        let (from, to) = (graph.node(edge.from), graph.node(edge.to));
        if from.clip == to.clip {
            continue;
        }
        mixed += 1;
        let (mut pose, mut before) = (Pose::default(), Vec::<Vec3>::new());
        let last = 8 * edge.frames as i32;
        // From the source's own pose to the target's.
        for step in -1..=last + 1 {
            if step < 0 {
                graph.clip(from.clip).pose(from.frame as usize, &mut pose);
            } else if step > last {
                graph.clip(to.clip).pose(to.frame as usize, &mut pose);
                pose.place(graph.clip_change(id));
            } else {
                graph.sample_edge(id, step as f32 / 8.0, &mut pose);
            }
            let now: Vec<Vec3> = places(&pose);
            assert!(furthest(&before, &now) < 0.03, "edge {id:?}, step {step}");
            before = now;
        }
    }
    assert!(mixed > 0);
}

#[test]
fn the_blend_weight_is_kovars() {
    let k = 10;
    for i in -1..k {
        let s = (i + 1) as f32 / k as f32;
        let expected = 2.0 * s.powi(3) - 3.0 * s.powi(2) + 1.0;
        assert!((blend_weight(s) - expected).abs() < 1e-6);
    }
    assert_eq!((blend_weight(0.0), blend_weight(1.0)), (1.0, 0.0));
}

#[test]
fn without_a_way_back_there_is_no_graph() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 25, 0.0)];
    let mut settings = alone();
    settings.threshold = 1e-4;
    let error = build(&clips, &[], &settings).unwrap_err();
    let is_named = matches!(error, GraphError::NoCycle { clips: 1, .. });
    assert!(is_named, "{error}");
    let none = build(&[], &[], &settings).unwrap_err();
    assert!(matches!(none, GraphError::NoClips));
    let pose = first_frames(&skeleton, &clips[0], 1);
    let error = build(&[pose], &[], &settings).unwrap_err();
    assert_eq!(error, GraphError::NoMotion { clips: 1 });
}

#[test]
fn bad_settings_and_events_are_named() {
    let skeleton = small_skeleton();
    let clips = [swinging_clip(&skeleton, 60, 0.0)];
    type Change = fn(&mut GraphSettings, &mut LinkSettings);
    let bad: [(&str, Change); 8] = [
        ("threshold", |s, _| s.threshold = f32::NAN),
        ("frame_rate", |s, _| s.frame_rate = 0.0),
        ("window", |s, _| s.window = -1.0),
        ("3 joint weights for 9 joints", |s, _| {
            s.joint_weights = vec![1.0; 3];
        }),
        ("links.loosest", |_, links| links.loosest = f32::NAN),
        ("links.most_per_second", |_, links| {
            links.most_per_second = -1.0;
        }),
        ("links.goals.share", |_, links| links.goals[0].share = 1.5),
        ("links.goals.seconds", |_, links| {
            links.goals[0].seconds = f64::INFINITY;
        }),
    ];
    for (words, change) in bad {
        let (mut settings, mut links) = (GraphSettings::default(), LinkSettings::default());
        change(&mut settings, &mut links);
        settings.links = Some(links);
        let said = build(&clips, &[], &settings).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
    let refused = |bad: Event| build(&clips, &[bad], &GraphSettings::default()).unwrap_err();
    for bad in [
        evasion(1, 0.1, 0.2),
        evasion(0, 5.0, 6.0),
        evasion(0, 1.5, 6.0),
        evasion(0, 0.5, 0.2),
        evasion(0, 2.0, 2.0),
        evasion(0, -1.0, 1.0),
        evasion(0, f64::NAN, 1.0),
        evasion(0, 1.0, f64::NAN),
    ] {
        let error = refused(bad);
        assert!(matches!(error, GraphError::Event { index: 0, .. }));
    }
    let said = refused(evasion(0, 5.0, 6.0)).to_string();
    let named = format!("\"{}\", event 0 of all: 5 s to 6 s", clips[0].name());
    assert!(said.starts_with(&named), "{said}");
    let said = refused(evasion(1, 0.1, 0.2)).to_string();
    assert!(said.starts_with("event 0: 0.1 s to 0.2 s"), "{said}");
}

#[test]
fn what_cannot_be_kept_whole_is_refused_or_reported() {
    let clips = [round_clip(60, 0.0)];
    let mut settings = alone();
    settings.threshold = 10.0;
    let stranger = demo::motions().unwrap().skeleton;
    let error = graph::build(source(&stranger, &clips, &[]), &settings).unwrap_err();
    assert!(matches!(error, GraphError::ClipJoints { found: 9, .. }));
    // One ends where the next one starts: no overlap. The last is shorter than a frame.
    let events = [(0.5, 0.8), (0.8, 0.9), (0.95, 0.96)].map(|(start, end)| evasion(0, start, end));
    let (graph, report) = build(&clips, &events, &settings).unwrap();
    assert_eq!((report.events.evasions, report.events.attacks), (3, 0));
    let dropped = report.dropped.evasions;
    assert_eq!(graph.events().len() + dropped.len(), events.len());
    let is_named = dropped.iter().any(|name| name.ends_with("0.97-0.97"));
    assert!(is_named, "{dropped:?}");
}

#[test]
fn clips_at_other_frame_rates_are_resampled() {
    let motions = demo::motions().unwrap();
    let fast = motions.clips.iter();
    let fast: Vec<Clip> = fast.map(|clip| clip.resampled(120.0).unwrap()).collect();
    let source = source(&motions.skeleton, &fast, &motions.events);
    let (graph, report) = graph::build(source, &alone()).unwrap();
    assert!(graph.clips().iter().all(|clip| clip.frame_rate() == 30.0));
    let original: f64 = motions.clips.iter().map(Clip::duration).sum();
    assert!((report.seconds - original).abs() < 0.1);
    assert!(graph.edges_with(EventKind::Evasion).count() >= 8);
}
