//! Estimates the unit of a mesh, because OBJ files do not contain it.

use glam::Vec3;

use super::{LengthUnit, Scale, ScaleSource, USUAL_STATURE};
use crate::fit::Mesh;
use sabaki::anim::JointTransform;

/// Scale of a body's mesh: the unit in which the mesh is as large as its skeleton in the given
/// pose. If no unit fits, the mesh is scaled to the skeleton's size. `joints` are in metres.
#[must_use]
pub fn body_scale(mesh: &Mesh, joints: &[JointTransform]) -> Scale {
    let places = joints.iter().map(|joint| joint.translation);
    let (low, high) = places.fold(
        (Vec3::INFINITY, Vec3::NEG_INFINITY),
        |(low, high), place| (low.min(place), high.max(place)),
    );
    let skeleton = f64::from((high - low).max_element());
    // Height of a person's mesh, in units, if it had the same proportion to a person's skeleton.
    let units = f64::from(longest_side(mesh)) * USUAL_STATURE / skeleton;
    Scale::of_stature(units)
}

/// Scale of a prop's mesh: the first unit in which its longest side is between 0.1 and 3.5 m. The
/// clips' own unit is tried first, then metre, centimetre, millimetre and the others. If none fits,
/// the unit is the metre.
#[must_use]
pub fn held_scale(mesh: &Mesh, clips: f64) -> Scale {
    let longest = f64::from(longest_side(mesh));
    let fits = |metres: f64| (0.1..=3.5).contains(&(longest * metres));
    let units = LengthUnit::ALL.into_iter();
    let of_clips = LengthUnit::ALL
        .into_iter()
        .filter(|unit| unit.metres() == clips);
    let usual = [
        LengthUnit::Metre,
        LengthUnit::Centimetre,
        LengthUnit::Millimetre,
    ];
    let mut in_order = of_clips.chain(usual).chain(units);
    match in_order.find(|unit| fits(unit.metres())) {
        Some(unit) => Scale {
            metres_per_unit: unit.metres(),
            found: ScaleSource::Unit(unit),
        },
        None => Scale {
            metres_per_unit: 1.0,
            found: ScaleSource::Assumed,
        },
    }
}

fn longest_side(mesh: &Mesh) -> f32 {
    let (low, high) = mesh.bounds();
    (high - low).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
