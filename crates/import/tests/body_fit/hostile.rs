//! Degenerate and malicious meshes: each is an error or gives a usable body, in short time.

use glam::Vec3;
use sabaki::anim::{JointId, JointTransform};
use sabaki_import::fit::{BindPose, FitError, FitSettings, Mesh, MeshError, fit_body, fit_prop};
use sabaki_import::parse_obj;

use super::super::refused::cases;
use sabaki_fixtures::clips::small_skeleton;
use sabaki_fixtures::random::Random;
use sabaki_fixtures::with;

/// Fits what can be fitted; `None` where the text or the mesh is refused.
fn spheres(text: &[u8]) -> Option<usize> {
    let skeleton = small_skeleton();
    let mesh = parse_obj(text).ok()?;
    let settings = FitSettings::default();
    let (body, report) = fit_body(&BindPose::rest(&skeleton), &mesh, &settings).ok()?;
    assert!(body.is_sound(&skeleton), "{body:?}");
    for fit in &report.joints {
        let sums =
            fit.mesh_out_max + fit.mesh_out_mean + fit.spheres_out_max + fit.spheres_out_mean;
        let is_sound = sums.is_finite() && (1..=64).contains(&fit.spheres);
        assert!(is_sound, "{report:?}");
    }
    Some(body.spheres.len())
}

#[test]
fn texts_without_a_mesh_are_refused() {
    for [text] in cases(include_str!("../refused/obj.txt")) {
        assert_eq!(spheres(text.as_bytes()), None, "{text:?}");
    }
    assert_eq!(spheres(&[0xff, 0xfe, 0, b'v', b'\n']), None);
}

#[test]
fn what_is_hardly_a_mesh_still_gives_a_body() {
    for text in [
        // One triangle; one that is a line; one that is a point, in a group of a joint and in one of none.
        "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n",
        "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n",
        "v 0 0 0\ng LeftHand\nf 1 1 1\ng nobody\nf 1 1 1\n",
        // An edge of three triangles; a fan of one polygon; a vertex that no face uses, far away.
        "v 0 0 0\nv 0 0.3 0\nv 0.2 0 0\nv -0.2 0 0\nv 0 0 0.2\nf 1 2 3\nf 1 2 4\nf 1 2 5\n",
        "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0 0 90000\nf 1 2 3 4\n",
        "\u{FEFF}v 0 0 0\r\nv 0.1 0 0\r\nv 0 0.1 0\r\nvn 0 0 1\r\nf -3//-1 -2//-1 -1//-1\r\n",
        "mtllib none.mtl\nusemtl none\nv 0 0 0 1 1 1\nv 0.1 0 0 1 1 1\nv 0 0.1 0 1 1 1\ns 1\nf 1 2 3\n",
    ] {
        assert!(spheres(text.as_bytes()) > Some(0), "{text:?}");
    }
}

#[test]
fn a_mesh_that_stands_elsewhere_names_the_vertex() {
    let skeleton = small_skeleton();
    let (pose, settings) = (BindPose::rest(&skeleton), FitSettings::default());
    let mesh = parse_obj(b"v 0 0 0\nv 0.1 0 0\nv 0 70 0\nf 1 2 3\n").unwrap();
    match fit_body(&pose, &mesh, &settings).unwrap_err() {
        FitError::Far {
            vertex: 2,
            metres,
            joint,
            ..
        } => {
            assert!((metres - 69.2).abs() < 0.01, "{metres}");
            assert_eq!(joint, "Chest");
        }
        other => panic!("{other}"),
    }
    let held = fit_prop(JointId::ROOT, &mesh, &FitSettings::HELD);
    assert!(matches!(held, Err(FitError::Far { vertex: 2, .. })));
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let placed = mesh.placed(scale, JointTransform::IDENTITY);
        let is_named = matches!(placed, Err(MeshError::Placement { .. }));
        assert!(is_named, "{scale}");
    }
    let far = mesh.placed(1e6, JointTransform::IDENTITY);
    assert!(matches!(far, Err(MeshError::Far { vertex: 2, .. })));
    let spoilt: [fn(&mut FitSettings); 4] = [
        |settings| settings.cover = f32::NAN,
        |settings| settings.bulge = 0.0,
        |settings| settings.most_spheres = 0,
        |settings| settings.furthest = 1e9,
    ];
    for spoil in spoilt {
        let mut settings = settings;
        spoil(&mut settings);
        let refused = fit_body(&pose, &mesh, &settings);
        assert!(matches!(refused, Err(FitError::Settings(_))));
    }
}

#[test]
fn too_many_triangles_are_refused() {
    let places = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let triangles = vec![[0, 1, 2]; Mesh::MOST_TRIANGLES + 1];
    let mesh = Mesh::new(places, triangles, Vec::new());
    assert!(matches!(mesh, Err(MeshError::TooMany(_))));
}

/// All reach across one another, so that no group of them is ever far, and none has an inside.
#[test]
fn two_hundred_thousand_tangled_triangles_are_fitted() {
    let mut random = Random::new(11);
    let mut coordinate = || random.below(1001) as f32 / 1000.0 - 0.5;
    let mut place = || Vec3::new(coordinate(), coordinate(), coordinate());
    let places: Vec<Vec3> = (0..2000).map(|_| place()).collect();
    let mut random = Random::new(12);
    let triangles = (0..200_000).map(|_| [0; 3].map(|_: u32| random.below(2000) as u32));
    let mesh = Mesh::new(places, triangles.collect(), Vec::new()).unwrap();
    let skeleton = small_skeleton();
    // Few points of the surface are enough: each of them meets all triangles.
    let settings = with(|s: &mut FitSettings| s.cover = 0.2);
    let (body, report) = fit_body(&BindPose::rest(&skeleton), &mesh, &settings).unwrap();
    assert!(body.is_sound(&skeleton));
    assert!(report.worst().mesh_out_max.is_finite());
}
