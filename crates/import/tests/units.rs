//! The unit of a file, a body or a prop is that in which it has the size of one.

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki_import::fit::Mesh;
use sabaki_import::{LengthUnit, Scale, ScaleSource, USUAL_STATURE, body_scale, held_scale};

#[test]
fn a_person_is_recognised_in_every_unit() {
    for unit in LengthUnit::ALL {
        for metres in [1.5, 1.7, 1.95] {
            let scale = Scale::of_stature(metres / unit.metres());
            assert_eq!(scale.found, ScaleSource::Unit(unit), "{metres} m");
        }
    }
}

#[test]
fn what_fits_no_unit_is_made_a_person_high() {
    let scale = Scale::of_stature(7e6);
    assert_eq!(scale.found, ScaleSource::Stature);
    assert!((scale.metres_per_unit * 7e6 - USUAL_STATURE).abs() < 1e-9);
    for none in [0.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Scale::of_stature(none).found, ScaleSource::Assumed);
    }
}

fn stick(length: f32) -> Mesh {
    let places = vec![Vec3::ZERO, Vec3::X * 0.01 * length, Vec3::Y * length];
    Mesh::new(places, vec![[0, 1, 2]], Vec::new()).unwrap()
}

#[test]
fn a_body_is_as_large_as_its_skeleton() {
    let joints = [0.1, 1.6].map(|y| JointTransform {
        translation: Vec3::Y * y,
        ..JointTransform::IDENTITY
    });
    for unit in LengthUnit::ALL {
        let scale = body_scale(&stick((1.65 / unit.metres()) as f32), &joints);
        assert_eq!(scale.found, ScaleSource::Unit(unit));
    }
    let none = body_scale(&stick(4e5), &joints);
    assert_eq!(none.found, ScaleSource::Stature);
    assert!((none.metres_per_unit * 4e5 - 1.5).abs() < 1e-3);
}

#[test]
fn a_staff_is_in_the_clips_unit_if_it_can_be() {
    let (metre, centimetre, inch) = (1.0, 0.01, LengthUnit::Inch.metres());
    for (length, clips, wanted) in [
        (1.8, centimetre, metre),
        (180.0, centimetre, centimetre),
        (180.0, metre, centimetre),
        (70.0, inch, inch),
        (1800.0, centimetre, LengthUnit::Millimetre.metres()),
    ] {
        assert_eq!(
            held_scale(&stick(length), clips).metres_per_unit,
            wanted,
            "{length}"
        );
    }
    assert_eq!(held_scale(&stick(1e-6), 1.0).found, ScaleSource::Assumed);
}
