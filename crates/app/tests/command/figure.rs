//! Bodies and props from files.

use glam::Vec3;
use sabaki::anim::Skeleton;
use sabaki::archive;
use sabaki::maps::Body;
use sabaki_fixtures::demo;
use sabaki_import::BodyFile;
use sabaki_import::fit::BindPose;

use super::run::{folder, sabaki, write};
use sabaki_fixtures::shapes::Shape;

fn skeleton() -> Skeleton {
    demo::motions().unwrap().skeleton
}

#[test]
fn bake_takes_spheres_from_a_file() {
    let (folder, skeleton) = (folder(), skeleton());
    let mut body = Body::from_bones(&skeleton);
    body.spheres.truncate(9);
    let file = serde_json::to_vec(&BodyFile::of(&body, &skeleton)).unwrap();
    write(&folder, "body.json", file);
    let args = "bake --clips CLIPS --out g.sabaki --body body.json --json";
    let said = sabaki(&folder, args).json(0);
    assert_eq!(said["body_spheres"], 9);
    assert_eq!(said["props"], 0);
    assert_eq!(said["fits"], serde_json::json!([]));
    let baked = archive::read(&folder.path().join("g.sabaki")).unwrap();
    assert_eq!(baked.body(), &body);
}

#[test]
fn bake_fits_a_body_and_a_staff_and_says_how_well() {
    let (folder, skeleton) = (folder(), skeleton());
    let pose = BindPose::rest(&skeleton);
    // In millimetres, its origin between the feet.
    let mut man = Shape::man(&skeleton, pose.joints(), |_| 0.05);
    for place in &mut man.places {
        *place += Vec3::new(2.0, 1.0, 0.0);
    }
    write(&folder, "man.obj", man.obj(0.001));
    let mut staff = Shape::default();
    staff.capsule(Vec3::NEG_Y * 0.5, Vec3::Y, 0.015, 8);
    write(&folder, "staff.obj", staff.obj(0.01));
    let args = "bake --clips CLIPS --events EVENTS --out g.sabaki --body man.obj --body-stand --prop staff.obj --prop-joint RightHand --prop-grip -0.05,0,0,0.7071,0,0,0.7071";
    let text = sabaki(&folder, args).is(0).stdout;
    for word in [
        "man.obj",
        "at 0.001 m a unit",
        "LeftUpLeg",
        "staff.obj",
        "at 0.01 m a unit",
        "1.53",
    ] {
        assert!(text.contains(word), "{word:?} is not in: {text}");
    }
    let said = sabaki(&folder, &format!("{args} --json")).json(0);
    let fits = said["fits"].as_array().unwrap();
    assert_eq!((fits.len(), &said["props"]), (2, &1.into()));
    for fit in fits {
        let most = fit["all"]["mesh_out_max"].as_f64().unwrap();
        assert!(most > 0.0 && most <= 0.0201, "{fit}");
    }
    let baked = archive::read(&folder.path().join("g.sabaki")).unwrap();
    assert_eq!(fits[0]["all"]["spheres"], baked.body().spheres.len());
    let prop = &baked.body().props[0];
    assert_eq!(skeleton.joint(prop.joint).name, "RightHand");
    let furthest = prop.spheres.iter().map(|sphere| sphere.centre.z);
    let furthest = furthest.fold(0.0, f32::max);
    assert!(furthest > 0.95, "turned by its grip, it reaches forwards");
}

#[test]
fn figures_that_do_not_fit_are_refused() {
    let folder = folder();
    let tail = r#"{"spheres":[{"joint":"Tail","offset":[0,0,0],"radius":0.1}]}"#;
    let away = "v 0 90 0\nv 1 90 0\nv 0 91 0\nf 1 2 3\n";
    let files = [
        ("away.obj", away),
        ("none.obj", "v 0 0 0\n"),
        ("tail.json", tail),
    ];
    for (name, text) in files {
        write(&folder, name, text);
    }
    let cases: [(&str, &[&str]); 7] = [
        (
            "--body away.obj --body-scale 1",
            &["away.obj", "vertex 0", "m from the nearest bone"],
        ),
        ("--body tail.json", &["tail.json", "sphere 0", "Tail"]),
        ("--body away.obj --body-pose none.bvh:0", &["none.bvh"]),
        ("--body away.obj --body-pose none", &["CLIP:FRAME"]),
        ("--prop away.obj", &["--prop-joint"]),
        ("--prop away.obj --prop-joint Tail", &["Tail", "RightHand"]),
        (
            "--prop none.obj --prop-joint RightHand",
            &["none.obj", "no faces"],
        ),
    ];
    for (args, words) in cases {
        let whole = format!("bake --clips CLIPS --out g.sabaki {args}");
        sabaki(&folder, &whole).is_refused(words);
    }
    assert!(!folder.path().join("g.sabaki").exists());
}
