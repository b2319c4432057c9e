//! Detection of legs, and foot data that is missing or invalid.

use glam::Vec3;
use sabaki::anim::{Joint, Leg, Pose, Skeleton};
use sabaki::graph::{GraphSettings, MotionGraph};
use serde_json::json;

use super::super::build;
use super::{places, transitions, walker};
use sabaki_fixtures::clips::{skeleton, small_skeleton, swinging_clip};
use sabaki_fixtures::with;

#[test]
fn where_no_legs_are_known_nothing_is_done() {
    // Feet hang from the pelvis itself: there is no knee.
    let skeleton = small_skeleton();
    let clips = [0.3, 0.4].map(|seed| swinging_clip(&skeleton, 120, seed));
    let settings = with(|s: &mut GraphSettings| s.threshold = 3.0);
    let (graph, _) = build(&clips, &[], &settings).unwrap();
    assert!(graph.feet().legs().is_empty());
    assert_eq!(graph.foot_slide(100).planted_seconds, 0.0);
    // Names tell no feet.
    let walk = walker::walk(0.0);
    let joints = walk.skeleton.joints().iter().map(|joint| Joint {
        name: joint.name.replace("Foot", "Part"),
        ..joint.clone()
    });
    assert!(Leg::all(&Skeleton::new(joints.collect()).unwrap()).is_empty());
}

#[test]
fn twist_joints_and_hips_on_the_pelvis_are_no_bones() {
    let skeleton = skeleton(&[
        ("Hips", None, Vec3::Y * 0.0),
        ("Pelvis", Some(0), Vec3::Y * -0.05),
        ("LHipJoint", Some(1), Vec3::Y * 0.0),
        ("LeftUpLeg", Some(2), Vec3::Y * -0.05),
        ("LeftUpLegTwist", Some(3), Vec3::Y * -0.2),
        ("LeftLeg", Some(4), Vec3::Y * -0.22),
        ("LeftLegTwist", Some(5), Vec3::Y * -0.3),
        ("LeftFoot", Some(6), Vec3::Y * -0.1),
        ("LeftToeBase", Some(7), Vec3::Y * -0.05),
        ("RightUpLeg", Some(1), Vec3::Y * -0.05),
        ("RightLeg", Some(9), Vec3::Y * -0.42),
        ("RightFoot", Some(10), Vec3::Y * -0.4),
    ]);
    let legs = Leg::all(&skeleton);
    let named = |leg: &Leg| [leg.hip, leg.knee, leg.foot].map(|id| skeleton.joint(id).name.clone());
    assert_eq!(named(&legs[0]), ["LeftUpLeg", "LeftLeg", "LeftFoot"]);
    assert_eq!(named(&legs[1]), ["RightUpLeg", "RightLeg", "RightFoot"]);
    assert_eq!(legs[0].toe, skeleton.find("LeftToeBase"));
    assert_eq!(legs[1].toe, None);
    assert!((legs[0].length(&skeleton) - 0.82).abs() < 1e-5);
}

#[test]
fn spoilt_tables_of_feet_are_refused_or_do_no_harm() {
    let graph = walker::walk(0.0).graph();
    graph.validate().unwrap();
    let whole = serde_json::to_value(&graph).unwrap();
    let spoilt = |place: &str, value: serde_json::Value| {
        let mut hostile = whole.clone();
        *hostile.pointer_mut(place).unwrap() = value;
        serde_json::from_value::<MotionGraph>(hostile)
    };
    let blends = whole["feet"]["blends"].as_array().unwrap();
    let blend = blends.iter().position(|blend| !blend.is_null()).unwrap();
    let blend = |field: &str| format!("/feet/blends/{blend}/{field}");
    let frames = 1000.0;
    let refused = [
        ("/feet/legs/0/hip".to_owned(), json!(0)),
        ("/feet/legs/0/hip".to_owned(), json!(6)),
        ("/feet/legs/1/knee".to_owned(), json!(2)),
        ("/feet/legs/1/foot".to_owned(), json!(60_000)),
        ("/feet/legs/0/toe".to_owned(), json!(8)),
        ("/feet/legs".to_owned(), json!([])),
        ("/feet/plants".to_owned(), json!([])),
        ("/feet/plants/0/0/last".to_owned(), json!(u32::MAX)),
        ("/feet/plants/0/1/first".to_owned(), json!(0)),
        ("/feet/blends".to_owned(), json!([])),
        ("/feet/sinks".to_owned(), json!([])),
        ("/feet/sinks/0".to_owned(), json!(-0.1)),
        ("/feet/sinks/0".to_owned(), json!(1e30)),
        (blend("leave"), json!(-1.0)),
        (blend("leave"), json!(frames)),
        (blend("land"), json!(0.0)),
        (blend("land"), json!(frames)),
        (blend("lift"), json!(-1e9)),
    ];
    for (place, value) in refused {
        let graph = spoilt(&place, value.clone()).unwrap();
        let error = graph.validate().expect_err(&place);
        assert!(error.contains("feet"), "{place} = {value}: {error}");
    }
    // NaN has no place in JSON, but any bits have one in a file: a number that is none is refused.
    for (field, value) in [("leave", 1e-38), ("land", 1e-38), ("lift", 1e6)] {
        let graph = spoilt(&blend(field), json!(value)).unwrap();
        if graph.validate().is_ok() {
            let mut pose = Pose::default();
            for id in transitions(&graph) {
                graph.sample_edge(id, 2.5, &mut pose);
                assert!(places(&graph, &pose).iter().all(|place| place.is_finite()));
            }
        }
    }
}
