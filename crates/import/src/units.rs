use glam::Vec3;

use super::bvh::BvhFile;
use sabaki::anim::{JointId, Pose, Skeleton, forward_kinematics};

/// Metres per unit of a file, and how that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Metres.
    pub metres_per_unit: f64,
    /// How it was found.
    pub found: ScaleSource,
}

/// How a [`Scale`] was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleSource {
    /// The caller gave it.
    Given,
    /// The format says so: glTF is in metres.
    Format,
    /// The unit in which the skeleton comes nearest to a person's height.
    Unit(LengthUnit),
    /// No unit fits: the skeleton is made [`USUAL_STATURE`] high.
    Stature,
    /// The skeleton has no height to judge by: centimetres.
    Assumed,
}

/// A unit that motion files are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// 1 m.
    Metre,
    /// 0.3048 m.
    Foot,
    /// 0.1 m, as `MakeHuman` writes.
    Decimetre,
    /// 1 / 0.45 inch, in which the CMU captures are written.
    Cmu,
    /// 0.0254 m.
    Inch,
    /// 0.01 m, the most usual.
    Centimetre,
    /// 0.001 m.
    Millimetre,
}

/// Metres. Statures are compared with it.
pub const USUAL_STATURE: f64 = 1.7;

/// A unit fits when the stature in it differs from [`USUAL_STATURE`] by no more than this factor.
///
/// Chosen so that no two units but decimetre and CMU's (1.77 apart) can both fit.
pub const STATURE_FACTOR: f64 = 1.45;

impl LengthUnit {
    /// All, from the largest.
    pub const ALL: [Self; 7] = [
        Self::Metre,
        Self::Foot,
        Self::Decimetre,
        Self::Cmu,
        Self::Inch,
        Self::Centimetre,
        Self::Millimetre,
    ];

    /// Metres in one.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Foot => 0.3048,
            Self::Decimetre => 0.1,
            Self::Cmu => 0.0254 / 0.45,
            Self::Inch => 0.0254,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
        }
    }
}

impl Scale {
    /// Of a file, by its skeleton's [`stature`].
    #[must_use]
    pub fn of(file: &BvhFile) -> Self {
        let units = file.skeleton(1.0).map_or(0.0, |skeleton| {
            let mut pose = Pose::default();
            file.pose(0, 1.0, &mut pose);
            stature(&skeleton, &pose)
        });
        Self::of_stature(units)
    }

    /// Of a skeleton so many units high.
    #[must_use]
    pub fn of_stature(units: f64) -> Self {
        if !(units.is_finite() && units > 0.0) {
            return Self {
                metres_per_unit: LengthUnit::Centimetre.metres(),
                found: ScaleSource::Assumed,
            };
        }
        let off = |unit: LengthUnit| (units * unit.metres() / USUAL_STATURE).ln().abs();
        let nearest = LengthUnit::ALL
            .into_iter()
            .filter(|&unit| off(unit) <= STATURE_FACTOR.ln())
            .min_by(|&a, &b| off(a).total_cmp(&off(b)));
        match nearest {
            Some(unit) => Self {
                metres_per_unit: unit.metres(),
                found: ScaleSource::Unit(unit),
            },
            None => Self {
                metres_per_unit: USUAL_STATURE / units,
                found: ScaleSource::Stature,
            },
        }
    }
}

/// Share of the highest leaf's height above the root that the crown has too, be the hands raised over the head.
const MOST_OF_REACH: f32 = 0.6;

/// How high a skeleton stands in `pose`: straight from the root to the crown, and along the bones to the sole, so that
/// bent knees do not count. In the skeleton's unit.
///
/// The crown is the leaf with the shortest chain of bones among those about as high as the highest (raised hands are higher,
/// but hang on longer chains), the sole likewise below the root. The pose's own translations are not used: in some
/// files they are all 0 where the offsets are right. Up is Y, or, of a figure less than half as high as it is long, Z or
/// at last X: not all files are Y-up.
#[must_use]
pub fn stature(skeleton: &Skeleton, pose: &Pose) -> f64 {
    let bare = Pose {
        root: Vec3::ZERO,
        rotations: pose.rotations.clone(),
        translations: Vec::new(),
    };
    let mut joints = Vec::new();
    forward_kinematics(skeleton, &bare, &mut joints);
    let place = |id: JointId| joints[id.index()].translation;
    let (low, high) = skeleton
        .ids()
        .map(place)
        .fold((Vec3::ZERO, Vec3::ZERO), |(low, high), place| {
            (low.min(place), high.max(place))
        });
    let extent = high - low;
    // Y where it can be; the arms of a T-pose are as long along X as the figure is high.
    let half = 0.5 * extent.max_element();
    let up = [1, 2, 0]
        .into_iter()
        .find(|&axis| extent[axis] >= half)
        .unwrap_or(1);
    let mut has_child = vec![false; skeleton.len()];
    for joint in skeleton.joints() {
        if let Some(parent) = joint.parent {
            has_child[parent.index()] = true;
        }
    }
    let leaves = || skeleton.ids().filter(|id| !has_child[id.index()]);
    let tip = |direction: f32| {
        let reach = |id: JointId| place(id)[up] * direction;
        let farthest = leaves().map(reach).fold(0.0, f32::max);
        leaves()
            .filter(|&id| farthest > 0.0 && reach(id) >= MOST_OF_REACH * farthest)
            .min_by(|&a, &b| {
                skeleton
                    .chain_length(a)
                    .total_cmp(&skeleton.chain_length(b))
            })
    };
    let to_crown = tip(1.0).map_or(0.0, |crown| place(crown).length());
    let to_sole = tip(-1.0).map_or(0.0, |sole| skeleton.chain_length(sole));
    f64::from(to_crown) + f64::from(to_sole)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
