//! The unit of length of a motion file or a mesh.
//!
//! The method is ours: the unit is the one in which the height of the figure ([`stature`]), the median of poses of all its files, is closest
//! to a person's. If none fits, the figure is scaled to a person's height. OBJ files do not contain their unit either.

use glam::Vec3;

use crate::figure::{COLLAPSED, Rooted};
use crate::fit::{Mesh, bounds};
use crate::motion_file::{ReadOptions, Up};
use sabaki::anim::{JointId, JointTransform, Limbs, Pose, Skeleton, forward_kinematics};

/// Unit of length of a file, and how it was determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Length of the unit, in metres.
    pub metres_per_unit: f64,
    /// How the scale was determined.
    pub found: ScaleSource,
}

/// How a [`Scale`] was determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleSource {
    /// The caller specified it.
    Given,
    /// The format specifies it: glTF is in metres.
    Format,
    /// It is the unit in which the skeleton is closest to a person's height.
    Unit(LengthUnit),
    /// No unit fits. The skeleton is scaled to a height of [`USUAL_STATURE`].
    Stature,
    /// The skeleton has no height. Centimetres are assumed.
    Assumed,
}

/// A unit of length that motion files use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// 1 m.
    Metre,
    /// 0.3048 m.
    Foot,
    /// 0.1 m, as `MakeHuman` writes.
    Decimetre,
    /// 1 / 0.45 inch, the unit of the CMU captures.
    Cmu,
    /// 0.0254 m.
    Inch,
    /// 0.01 m, the most common unit.
    Centimetre,
    /// 0.001 m.
    Millimetre,
}

/// Reference height of a person, in metres.
pub const USUAL_STATURE: f64 = 1.7;

/// Maximum factor between a skeleton's height and [`USUAL_STATURE`] for a unit to fit.
///
/// It is chosen so that at most one unit fits, except decimetre and CMU's unit, which differ by
/// 1.77.
pub const STATURE_FACTOR: f64 = 1.45;

impl LengthUnit {
    /// All units, from the largest to the smallest.
    pub const ALL: [Self; 7] = [
        Self::Metre,
        Self::Foot,
        Self::Decimetre,
        Self::Cmu,
        Self::Inch,
        Self::Centimetre,
        Self::Millimetre,
    ];

    /// Length of the unit, in metres.
    #[must_use]
    pub fn metres(self) -> f64 {
        [1.0, 0.3048, 0.1, 0.0254 / 0.45, 0.0254, 0.01, 0.001][self as usize]
    }
}

impl Scale {
    /// Scale of a skeleton with a given height in units.
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

/// How a figure stands in the poses of a file, in the file's unit and space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stance {
    pub(crate) skeleton: Option<Skeleton>,
    /// Median of its [`stature`]; 0 if it has none.
    pub(crate) stature: f64,
    /// Length of its longest chain of bones from the root, which does not depend on its pose.
    pub(crate) reach: f64,
    /// Sum of the directions from feet to hips; 0 if hands and feet are not known.
    pub(crate) up: Vec3,
    /// Number of poses in that sum.
    pub(crate) poses: usize,
    /// Whether it stands along +Y at rest. If it does not in the poses, it lies.
    pub(crate) rests_upright: bool,
}

/// Poses that stand for all frames of a motion.
pub(crate) fn sampled(frames: usize, pose: impl Fn(usize, &mut Pose)) -> Vec<Pose> {
    /// Number of poses of a file.
    const POSES: usize = 24;
    let step = frames.div_ceil(POSES).max(1);
    let one = |frame| {
        let mut out = Pose::default();
        pose(frame, &mut out);
        out
    };
    (0..frames).step_by(step).map(one).collect()
}

impl Stance {
    /// The stance in some poses. `rest` is the pose without motion.
    pub(crate) fn of(file: &Skeleton, rest: &Pose, poses: &[Pose]) -> Self {
        let rooted = Rooted::of(file).ok().flatten();
        let skeleton = rooted.as_ref().map_or(file, |rooted| &rooted.skeleton);
        let limbs = Limbs::of(skeleton);
        let is_known = !limbs.hands.is_empty() && !limbs.feet.is_empty();
        let mut stance = Self::default();
        let (mut joints, mut statures) = (Vec::new(), Vec::new());
        let own_pose = |pose: &Pose| match &rooted {
            Some(rooted) => rooted.pose(file, pose),
            None => pose.clone(),
        };
        let from_feet = |joints: &[JointTransform]| {
            let feet = limbs.feet.iter().map(|id| joints[id.index()].translation);
            let feet = feet.sum::<Vec3>() / limbs.feet.len() as f32;
            (joints[0].translation - feet).normalize_or_zero()
        };
        for pose in poses {
            let mut pose = own_pose(pose);
            let bones = bones(skeleton, &pose);
            statures.push(stature_of(skeleton, &pose, &bones));
            for id in skeleton.ids() {
                stance.reach = stance
                    .reach
                    .max(f64::from(chain_length(skeleton, id, &bones)));
            }
            if is_known {
                pose.translations.clone_from(&bones);
                forward_kinematics(skeleton, &pose, &mut joints);
                stance.up += from_feet(&joints);
                stance.poses += 1;
            }
        }
        if let (true, Some(pose)) = (is_known, poses.first()) {
            let rest = Pose {
                translations: bones(skeleton, &own_pose(pose)),
                ..own_pose(rest)
            };
            forward_kinematics(skeleton, &rest, &mut joints);
            stance.rests_upright = from_feet(&joints).y > UPRIGHT;
        }
        stance.skeleton = Some(skeleton.clone());
        statures.sort_by(f64::total_cmp);
        stance.stature = statures.get(statures.len() / 2).copied().unwrap_or(0.0);
        stance
    }

    /// The axis that is up: the given one, or the one along which the figure stands.
    pub(crate) fn up(&self, options: &ReadOptions) -> Up {
        let found = || self.axis().unwrap_or_default();
        options.up.unwrap_or_else(found)
    }

    /// The axis along which the figure stands in nearly all poses, with its sign. `None` for a figure that lies.
    pub(crate) fn axis(&self) -> Option<Up> {
        let axis = self.up.abs().max_position();
        let is_clear = self.up[axis].abs() >= UPRIGHT * self.poses as f32 && self.poses > 0;
        (is_clear && (!self.rests_upright || axis == 1 && self.up.y > 0.0))
            .then(|| Up::nearest(self.up))
    }
}

/// Least length of the mean direction from feet to hips along an axis of a figure that stands along it.
const UPRIGHT: f32 = 0.8;

/// Bones from each joint's parent to the joint in its parent's frame: those of the pose, unless they are all near 0, as in files whose
/// positions are not used.
fn bones(skeleton: &Skeleton, pose: &Pose) -> Vec<Vec3> {
    let offsets = || skeleton.joints().iter().map(|joint| joint.offset);
    let sum = |bones: &[Vec3]| bones.iter().skip(1).map(|bone| bone.length()).sum::<f32>();
    let rest: Vec<Vec3> = offsets().collect();
    match pose.translations.len() == rest.len() && sum(&pose.translations) >= COLLAPSED * sum(&rest)
    {
        true => pose.translations.clone(),
        false => rest,
    }
}

/// Length of the bones from the root to a joint.
fn chain_length(skeleton: &Skeleton, id: JointId, bones: &[Vec3]) -> f32 {
    let below_root = skeleton.ancestry(id).filter(|&id| id != JointId::ROOT);
    below_root.map(|id| bones[id.index()].length()).sum()
}

/// Minimum height of the crown above the root, as a share of the highest leaf's height. Raised
/// hands can be higher than the crown.
const MOST_OF_REACH: f32 = 0.6;

/// Height of a skeleton in `pose`, in the skeleton's unit: the straight distance from the body's root to
/// the crown, plus the length of the bones to the sole, so that bent knees do not matter.
///
/// The crown is the leaf with the shortest chain of bones among the highest leaves, because raised
/// hands are higher but have longer chains. The sole is the corresponding leaf below the root. Up is Y. If the figure is less than half as
/// high as it is long, up is Z or, as a last choice, X, because not all files are Y-up.
#[must_use]
pub fn stature(skeleton: &Skeleton, pose: &Pose) -> f64 {
    match Rooted::of(skeleton) {
        Ok(Some(rooted)) => {
            let own = rooted.pose(skeleton, pose);
            stature_of(&rooted.skeleton, &own, &bones(&rooted.skeleton, &own))
        }
        _ => stature_of(skeleton, pose, &bones(skeleton, pose)),
    }
}

fn stature_of(skeleton: &Skeleton, pose: &Pose, bones: &[Vec3]) -> f64 {
    let bare = Pose {
        root: Vec3::ZERO,
        rotations: pose.rotations.clone(),
        translations: bones.to_vec(),
    };
    let mut joints = Vec::new();
    forward_kinematics(skeleton, &bare, &mut joints);
    let place = |id: JointId| joints[id.index()].translation;
    // The root is at the origin.
    let (low, high) = bounds(skeleton.ids().map(place));
    let extent = high - low;
    // Prefer Y: the arms of a T-pose are as long along X as the figure is high.
    let half = 0.5 * extent.max_element();
    let up = [1, 2, 0]
        .into_iter()
        .find(|&axis| extent[axis] >= half)
        .unwrap_or(1);
    let mut has_child = vec![false; skeleton.len()];
    for parent in skeleton.joints().iter().filter_map(|joint| joint.parent) {
        has_child[parent.index()] = true;
    }
    let leaves = || skeleton.ids().filter(|id| !has_child[id.index()]);
    let length = |id: JointId| chain_length(skeleton, id, bones);
    let tip = |direction: f32| {
        let reach = |id: JointId| place(id)[up] * direction;
        let farthest = leaves().map(reach).fold(0.0, f32::max);
        leaves()
            .filter(|&id| farthest > 0.0 && reach(id) >= MOST_OF_REACH * farthest)
            .min_by(|&a, &b| length(a).total_cmp(&length(b)))
    };
    let to_crown = tip(1.0).map_or(0.0, |crown| place(crown).length());
    let to_sole = tip(-1.0).map_or(0.0, length);
    f64::from(to_crown) + f64::from(to_sole)
}

/// Scale of a body's mesh: the unit in which the mesh is as large as its skeleton in the given
/// pose. If no unit fits, the mesh is scaled to the skeleton's size. `joints` are in metres.
#[must_use]
pub fn body_scale(mesh: &Mesh, joints: &[JointTransform]) -> Scale {
    let (low, high) = bounds(joints.iter().map(|joint| joint.translation));
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
