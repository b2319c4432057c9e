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
    let file = BodyFile::of(&body, &skeleton);
    file.write(&folder.path().join("body.json")).unwrap();
    let args = "bake --clips FEW --out g.sabaki --body body.json --json";
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
    let args = "bake --clips FEW --out g.sabaki --body man.obj --body-stand --prop staff.obj --prop-joint RightHand --prop-grip -0.05,0,0,0.7071,0,0,0.7071";
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
    for (args, word) in [
        ("--body man.obj --body-pose none", "CLIP:FRAME"),
        ("--prop staff.obj", "--prop-joint"),
        ("--prop staff.obj --prop-joint Tail", "RightHand"),
    ] {
        let args = format!("bake --clips FEW --out h.sabaki {args}");
        sabaki(&folder, &args).is_refused(&[word]);
    }
}
